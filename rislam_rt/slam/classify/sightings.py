"""The filter's own tracks as the classifier wants them."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.classify.features import Sightings
from rislam_rt.slam.tracks import Tracks


def sightings_of(tracks: Tracks, log_amplitude: Floats, position: Floats, heading: Floats, cycle: int) -> Sightings:
    """What T tracks have shown up to a cycle.

    Parameters
    ----------
    log_amplitude
        (T, W) of their measurements, cycle k at column k % W as in `Tracks.seen`; or (T,) of the last one, if the
        others were not kept: fading is then taken for none.
    position, heading
        (W, 3) [m] and (W,) [rad] of the agent as it believes, in the same order.
    """
    window = tracks.cycle.shape[1]
    columns = np.arange(cycle + 1, cycle + 1 + window) % window
    level = np.asarray(log_amplitude, dtype=np.float64)
    level = np.broadcast_to(level[:, None], tracks.cycle.shape) if level.ndim == 1 else level[:, columns]
    held = tracks.cycle[:, columns] >= 0
    return Sightings(tracks.seen[:, columns], tracks.std[:, columns], level, held, position[columns], heading[columns])
