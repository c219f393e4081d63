"""Sensor model of a receiver: detection threshold, false alarms and resolution that follow from its settings."""

from functools import lru_cache

from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.false_alarms import detection_threshold, expected_false_alarms
from rislam_rt.measurement.signal import num_tones
from rislam_rt.model import RadioConfig, SensorModel
from rislam_rt.model.sensor import ONE_PULSE

GRID_SHARE = 0.83
"""Share of the noise's peaks above the threshold that the search on a grid finds: measured on noise alone
(docs/receiver.md)."""


@lru_cache(maxsize=64)
def build_sensor(radio: RadioConfig, config: ReceiverConfig) -> SensorModel:
    """Sensor model of a receiver's settings: detection threshold, false-alarm rate, delay window, resolution.

    The bound-driven receiver draws as many false components as it is set to; the waveform's are the peaks of its noise.
    """
    threshold = detection_threshold(radio, config)
    rate, period = config.clutter_rate, ONE_PULSE
    if config.estimator == "waveform":
        expected = expected_false_alarms(threshold, radio, config.max_delay - config.min_delay)
        rate = config.num_captures * GRID_SHARE * expected
        period = num_tones(radio, config) / radio.bandwidth
    resolution = "cell" if config.estimator == "bound" and config.resolution == "cell" else "joint"
    return SensorModel(
        radio, threshold=threshold, false_alarms=rate, window=(config.min_delay, config.max_delay), period=period,
        resolution=resolution if config.merge else "all", alternation=config.alternation,
    )  # fmt: skip
