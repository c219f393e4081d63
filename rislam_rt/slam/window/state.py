"""The window filter's state, carried from cycle to cycle."""

from typing import NamedTuple

from rislam_rt.arrays import Floats
from rislam_rt.model import RisCode
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.landmark_update import VisibilityObservations
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.tracks import WindowTracks


class WindowState(NamedTuple):
    """All that the filter knows."""

    cycle: int
    config: SlamConfig
    window: Window
    landmarks: WindowTable
    log: Log
    tracks: WindowTracks
    visibility: VisibilityObservations
    motion_mode: Floats
    """(2, L) probabilities of the liveliness of the step before the window's first, across and upwards; (3, L) with
    the rate of turn, where the heading is not known."""
    level: Floats
    """(2, L) or (3, L) of the last step's, filtered."""
    heading: Floats
    """(K,) [rad] that the compass told; where it is not asked, what offsets are against."""
    shift: Floats
    """(3,) [m] standard deviation of the start's position: what no measurement tells."""
    scene: KnownEnvironment
    lost_log_odds: float
    """Log odds that the agent is lost: that the map explains nothing of what is heard (see `divergence`)."""
    asked: bool
    """Whether the first tracks told that the start is another."""
    turned: float
    """[rad] by which the compass was found to be wrong."""
    codes: tuple[RisCode | None, ...]
    """(K,) as the agent believes they were applied."""
    passed: Floats
    """(P, 3) [m] positions that left the window, each with the hindsight of its whole length."""
