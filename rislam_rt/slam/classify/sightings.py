"""Sightings: the filter's own tracks as the classifier wants them."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.classify.features import Sightings


def sightings_of(
    seen: Floats, std: Floats, cycles: Integers, log_amplitude: Floats, position: Floats, heading: Floats, now: int
) -> Sightings:
    """Sightings of T tracks up to the cycle `now`.

    Parameters
    ----------
    seen, std
        (T, W, 3) length [m] and cosines, and their deviations, cycle k at column k % W.
    cycles
        (T, W) of each column, -1 where there was no measurement.
    log_amplitude
        (T, W) likewise; or (T,) of the last one, if the
        others were not kept: fading is then taken for none.
    position, heading
        (W, 3) [m] and (W,) [rad] of the agent as it believes, in the same order.
    """
    window = cycles.shape[1]
    columns = np.arange(now + 1, now + 1 + window) % window
    level = np.asarray(log_amplitude, dtype=np.float64)
    level = np.broadcast_to(level[:, None], cycles.shape) if level.ndim == 1 else level[:, columns]
    held = cycles[:, columns] >= 0
    return Sightings(seen[:, columns], std[:, columns], level, held, position[columns], heading[columns])
