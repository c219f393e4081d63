"""Sensor model, what is known of the receiver: detection, false alarms, the range of delays, and resolution.

One object says it all. The simulation draws from the one that its settings make; filters and bounds reckon with the one
that they are told, which may be wrong.
"""

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import ConfigError
from rislam_rt.model.radio import RadioConfig

RESOLUTIONS = ("cell", "joint", "all")
"""Rules by which two paths are resolved: they lie outside each other's resolution cell; their amplitudes can be told
when all else is unknown (`measurement.joint_bound`); always."""
ONE_PULSE = 1.0
"""Period [s] that stands for a sounding which does not repeat: longer than any path."""
CERTAIN_SNR = 10.0
"""Deviations of the measured SNR's root above the threshold from which on detection is sure to double precision."""


@dataclass(frozen=True, slots=True)
class SensorModel:
    """Sensor model of the receiver: detection, false alarms and resolution of multipath components. SI units; SNRs
    linear, over all antennas."""

    radio: RadioConfig
    """Radio (noise, band, gains and array) that the rest refers to."""
    threshold: float = 10.0
    """Detection threshold: a component is reported when its measured SNR exceeds this."""
    false_alarms: float = 0.5
    """Mean number of false components a cycle."""
    window: tuple[float, float] = (0.0, 80e-9)
    """First and last delay [s] at which components are reported."""
    period: float = ONE_PULSE
    """Period [s] after which a sounding of tones repeats: what comes later is measured whole periods earlier."""
    resolution: str = "cell"
    """Rule by which two paths are resolved, one of `RESOLUTIONS`."""
    alternation: bool = False
    """Whether components are reported with the probability that they ran over a RIS panel."""

    def __post_init__(self) -> None:
        for name, least in (("threshold", 1e-300), ("false_alarms", 0.0), ("period", 1e-300)):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= least):
                raise ConfigError(f"sensor.{name}: {value} received; give a finite number of at least {least:g}")
        if not self.window[1] > self.window[0]:
            raise ConfigError(f"sensor.window: {self.window} received; give a last delay after the first")
        if self.resolution not in RESOLUTIONS:
            raise ConfigError(f"sensor.resolution: '{self.resolution}' received; give one of {', '.join(RESOLUTIONS)}")

    @property
    def cell(self) -> Floats:
        """Widths (3,) of the sensor's resolution cell: 1/B [s], and the beam in either cosine (2 without aperture)."""
        array = self.radio.array
        beams = [1.0 / (count * array.spacing) if count > 1 else 2.0 for count in (array.rows, array.cols)]
        return np.array([1.0 / self.radio.bandwidth, *beams])

    @property
    def cell_length(self) -> Floats:
        """Widths (3,) of the sensor's resolution cell: path length [m] and two direction cosines."""
        return self.cell * np.array([SPEED_OF_LIGHT, 1.0, 1.0])

    def in_window(self, delay: Floats) -> Booleans:
        """Sensor model's window: whether (...,) the receiver reports components of delays [s] (...,) at all."""
        return np.asarray((delay >= self.window[0]) & (delay <= self.window[1]))

    def heard_as(self, length: Floats) -> Floats:
        """Path lengths (...,) [m] as the sensor measures them: true ones (...,) [m] less whole sounding periods."""
        return np.asarray(np.mod(length, SPEED_OF_LIGHT * self.period))

    def nearest(self, gap: Floats) -> Floats:
        """Differences (...,) of path lengths [m] as the sensor tells them: less the nearest whole sounding periods."""
        period = SPEED_OF_LIGHT * self.period
        return np.asarray(gap - period * np.round(gap / period))

    def detection_probability(self, snr: ArrayLike) -> Floats:
        """Probability (...,) that the sensor reports a lone path of this expected SNR (see the function
        `detection_probability`)."""
        return detection_probability(snr, self.threshold)

    def false_alarm_density(self, tau: ArrayLike, cosines: Floats) -> Floats:
        """Expected number (...,) of the sensor's false components a cycle, per second of delay and unit of either
        direction cosine.

        Noise is stationary in delay and cosines, so that its peaks lie evenly over the window and the unit disc.
        """
        delay = np.asarray(tau, dtype=np.float64)
        inside = self.in_window(delay) & (np.sum(cosines**2, axis=-1) <= 1.0)
        return np.where(inside, self.false_alarms / (np.pi * (self.window[1] - self.window[0])), 0.0)

    def false_alarm_snr_density(self, snr: ArrayLike) -> Floats:
        """Probability density (...,) of the measured SNR of a sensor's false component: noise above the threshold."""
        excess = np.asarray(snr, dtype=np.float64) - self.threshold
        return np.where(excess >= 0.0, np.exp(-np.maximum(excess, 0.0)), 0.0)

    def may_merge(self, gap: Floats) -> Booleans:
        """Whether (...,) paths `gap` (..., 3) apart in delay [s] and cosines share the sensor's resolution cell."""
        if self.resolution == "all":
            return np.zeros(gap.shape[:-1], dtype=np.bool_)
        return np.asarray((np.abs(gap) < self.cell).all(axis=-1))


def detection_probability(snr: ArrayLike, threshold: float) -> Floats:
    """Probability (...,) that a sensor of that detection threshold reports a lone path of this expected SNR
    (non-central chi squared)."""
    level = np.sqrt(2.0 * threshold)
    mean = np.sqrt(2.0 * np.maximum(np.asarray(snr, dtype=np.float64), 0.0))
    doubtful, found = mean < level + CERTAIN_SNR, np.ones(mean.shape)
    found[doubtful] = 1.0 - scipy.special.chndtr(level**2, 2.0, mean[doubtful] ** 2)
    return found


def merged_pull(ratio: ArrayLike) -> tuple[Floats, Floats]:
    """Sensor model of two paths that cannot be resolved: mean and variance (...,) of where they are measured as one, as
    a share of the gap between them.

    Counted from the path that is `1 / ratio` times as strong as the other. One path fits both best, to first order, at
    `Re sum alpha_i conj(alpha) z_i / |alpha|^2` with alpha the sum. Over an even relative phase, each weighed by the
    energy |alpha|^2 with which it is measured, the share has the mean `r^2 / (1 + r^2)`, the centre of energy, and the
    mean square `r^2 / 2 / (1 + r^2)`.
    """
    square = np.asarray(ratio, dtype=np.float64) ** 2
    mean = square / (1.0 + square)
    return mean, np.maximum(0.5 * mean - mean**2, 0.0)
