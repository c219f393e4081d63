"""Which tracks and paths are evidence of the motion: all that are heard, or, where wall returns are thrown away, those
that are classified as none.

How loud a track is tells it from a wall return long before the bends of its length do: most walls reflect more than a
small thing scatters. A track that is classified as no wall return is evidence, as the point is that it may become.
"""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.ris.path_gain import point_amplitude
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import PANEL, free_space
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.window.divergence.length_rates import BEYOND_WALLS, Rates
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.state import WindowState


def with_evidence(state: WindowState, found: Rates) -> Rates:
    """Rates of path lengths that are evidence of the motion: all, or, without wall returns, those of explained paths
    over more than walls and of tracks that are classified as no wall return."""
    if state.scene.use_vt:
        return found
    assert found.name is not None
    track = found.name[:, -1]
    return found.take(np.where(track < 0, found.name[:, 0] != TX, are_no_wall_returns(state, track)))._replace(
        shares=BEYOND_WALLS
    )


def are_no_wall_returns(state: WindowState, track: Integers) -> Booleans:
    """Which of the tracks with these idents (T,) are classified as no wall returns (`born`), as evidence of the motion,
    by those of their components that nothing explains."""
    free = state.log.take(~state.log.explained & (state.log.track >= 0))
    ident, which = np.unique(free.track, return_inverse=True)
    return np.isin(track, ident[log_odds_of_no_wall_return(state, free, which) > CONSTANTS.log_born])


def log_odds_of_no_wall_return(state: WindowState, log: Log, which: Integers) -> Floats:
    """Log odds (T,) that tracks, to which the components of a `log` belong as `which` (N,) tells, are paths over points
    against returns over one wall or two, by their mean length and log amplitude; what most codes tell to run over a
    panel is no wall return.

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
