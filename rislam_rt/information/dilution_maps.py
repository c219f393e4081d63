"""Position bounds over many places at once: GDOP maps."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.information.gradient import GradientMode, vertex_gradient
from rislam_rt.information.position import PositionBound, position_bound, position_information
from rislam_rt.model import PathKind, Paths, RadioConfig

LANDMARK_PATHS = (PathKind.PS, PathKind.VS, PathKind.RIS, PathKind.VRIS)
"""Classes whose far end stands still, so that they say where the agent is once the map is known."""


def position_error_map(
    paths: Paths,
    tx: Floats,
    rx: Floats,
    radio: RadioConfig,
    *,
    mode: GradientMode = "exact",
    prior: Floats | float = 0.0,
    least_snr: float = 0.0,
    use_vt: bool = False,
) -> PositionBound:
    """Horizontal position bound (K,) at K places, for the code that the paths' gains carry; the map is known.

    Parameters
    ----------
    paths
        One cycle a place, e.g. a grid over the room.
    tx, rx
        (K, 3) ends of the agent [m].
    prior
        (2, 2) or (K, 2, 2) information beforehand [1/m^2].
    least_snr
        SNR over all antennas, linear, below which a path is not detected.
    use_vt
        Whether wall returns count (the walls being known).
    """
    kinds = (*LANDMARK_PATHS, PathKind.VT) if use_vt else LANDMARK_PATHS
    gradient = vertex_gradient(tx, rx, paths.vertices, paths.num_vertices, mode=mode)[..., :2]
    snr = radio.integrated_snr(paths.gain)
    heard = paths.valid & np.isin(paths.kind, kinds) & (snr >= least_snr)
    return position_bound(position_information(gradient, np.where(heard, snr, 0.0), radio), prior)
