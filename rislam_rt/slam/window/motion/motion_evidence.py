"""What may tell of the motion before it is understood: all that is heard, or, where wall returns are thrown away, what
is held for none.

How loud a track is tells it from a wall's return long before its bends do: a mirror of any building material is louder
than a small thing. What is held for no wall return tells of the motion, as the points do that it may become.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.ris.path_gain import point_amplitude
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import PANEL, free_space
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.state import WindowState


def with_motion_evidence(state: WindowState) -> WindowState:
    """State whose log holds what may tell of the motion: all of it, or, without wall returns, explained components that
    bounce off more than walls, and tracks that are held for no wall return by how loud they are (`born`)."""
    if state.scene.use_vt:
        return state
    log = state.log
    free = (~log.explained & (log.track >= 0)).nonzero()[0]
    tells = log.explained & (log.form[:, 0, 0] != TX)
    if len(free):
        _, which = np.unique(log.track[free], return_inverse=True)
        tells[free] = (log_odds_of_no_wall_return(state, log.take(free), which) > CONSTANTS.log_born)[which]
    return state._replace(log=log.take(tells))


def log_odds_of_no_wall_return(state: WindowState, log: Log, which: np.ndarray) -> Floats:
    """Log odds (T,) that tracks, to which the components of a `log` belong as `which` (N,) tells, are paths over points
    or panels against returns over one wall or two, by their mean length and amplitude.

    Densities beforehand are those by which births weigh the same paths (`hypothesis_evidence`), but that what is louder
    than a mirror may be a wall return, too, which others have joined.
    """
    radio, count = state.scene.radio, np.bincount(which)
    level, length = (np.bincount(which, value) / count for value in (log.log_amplitude, log.seen[:, 0]))
    over_panel = np.bincount(which, log.side >= PANEL) > 0.5 * count
    free = free_space(radio) - np.log(length)
    wall, wall_variance, fading = CONSTANTS.wall_ratio, CONSTANTS.wall_ratio_std**2, CONSTANTS.fading**2
    anywhere = np.log(length**2 / 8.0) - CONSTANTS.log_volume
    unit = np.log(point_amplitude(np.ones(len(length)), 0.5 * length, 0.5 * length, radio)) + np.log(CONSTANTS.strength)
    wide = CONSTANTS.strength_std**2 + fading
    point = anywhere + np.logaddexp(
        _log_normal(level - unit, wide), _log_normal(level - unit - wall, wide + wall_variance) + 2.0 * wall
    )
    single = _log_normal(level - free - wall, wall_variance + fading) - np.log(8.0 * np.pi * CONSTANTS.size)
    double = _log_normal(level - free - 2.0 * wall, 2.0 * wall_variance + fading) + 2.0 * wall + anywhere
    return np.where(over_panel, np.inf, point - np.logaddexp(single, double))


def _log_normal(off: Floats, variance: float) -> Floats:
    """Log densities (T,), but for a constant, of centred normals, for loudness."""
    return np.asarray(-0.5 * (off**2 / variance + np.log(variance)))
