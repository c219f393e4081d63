"""Measure a cycle: from the channel's paths to the multipath components that the receiver reports."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.measurement.bound_receiver import measure_bound
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.hardware import FrontEnd
from rislam_rt.measurement.received_paths import Clutter, direct_gain, receive
from rislam_rt.measurement.waveform_receiver import measure_waveform
from rislam_rt.model import Measurement, Paths, PathTruth, RadioConfig


def measure(
    paths: Paths, cycle: int, heading: float, radio: RadioConfig, config: ReceiverConfig,
    previous: Measurement | None = None, doppler: Floats | None = None, front_end: FrontEnd | None = None,
    clutter: Clutter | None = None, *, rng: np.random.Generator,
) -> tuple[Measurement, PathTruth]:  # fmt: skip
    """Measure one cycle with the receiver: multipath components in the order of their delays, and their true paths.

    Parameters
    ----------
    paths
        Under the code that the panel is set to. With `config.alternation` those under the phase-reversed code follow:
        paths over the panel change their sign.
    cycle
        Row of `paths`.
    heading
        Of the body about z [rad].
    previous
        What was measured in the cycle before: `waveform` begins its search there, which saves a third of its time and
        more; `bound` has no use for it.
    doppler
        (P,) Doppler shifts [Hz] of the paths, which turn within the slot; None if nothing moves.
    front_end
        A receiver as it was built (`waveform`); None for an ideal one.
    clutter
        Paths without identity that are heard besides (row `cycle` too): a component of theirs is -1 in the truth.
    """
    if front_end is not None and front_end.config.carrier_offset_hz:
        doppler = (np.zeros(paths.num_paths) if doppler is None else doppler) + front_end.config.carrier_offset_hz
    received, extra = receive(paths, cycle, heading, radio, config, doppler), 0
    if clutter is not None:
        received = clutter.beside(received, paths.num_paths, cycle, heading, radio, config)
        extra = clutter.paths.num_paths
    if config.estimator == "waveform":
        leakage = direct_gain(paths, cycle) if front_end is not None else 0.0
        found, truth = measure_waveform(received, radio, config, previous, front_end, leakage, rng=rng)
    else:
        found, truth = measure_bound(received, radio, config, paths.num_paths, extra, rng=rng)
    return found, PathTruth(np.where(truth.path < paths.num_paths, truth.path, -1)) if extra else truth
