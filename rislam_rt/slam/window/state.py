"""The window filter's state, carried from cycle to cycle."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import RisCode, SensorModel
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.landmark_update import VisibilityObservations
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.smoother import attitude, heave
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.solver_limits import STILL
from rislam_rt.slam.window.start_frame import StartFrame
from rislam_rt.slam.window.tracks import WindowTracks


class WindowState(NamedTuple):
    """State of the window filter: poses and map as one Gaussian, landmark table, measurement log, tracks, motion modes,
    and the odds of being lost."""

    cycle: int
    """Number of cycles that have passed."""
    config: SlamConfig
    """Settings of the filter."""
    window: Window
    """Gaussian of the last K poses and the map."""
    landmarks: WindowTable
    """What is known of the features besides their places."""
    log: Log
    """Measurements of the window's cycles, and the paths that they were associated with."""
    tracks: WindowTracks
    """Components that no path of the map explains, followed over cycles."""
    visibility: VisibilityObservations
    """Occlusion and scatter of each path that was looked for."""
    motion_mode: Floats
    """(2, L) probabilities of the motion modes in the step before the window's first, horizontal and vertical; (3, L)
    with the rate of turn, where the heading is not known."""
    level: Floats
    """(2, L) or (3, L) filtered probabilities of the motion modes in the last step."""
    is_level: bool
    """Whether the floor is held for level, on which the height does not change."""
    is_coordinated: bool
    """Whether the agent is held to go where it faces (see `coordinated_turn`)."""
    coordinated_log_odds: float
    """Log odds of that, from the steps that have left the window."""
    heading: Floats
    """(K,) [rad] headings of the poses as the compass told; without one, what the estimated offsets are relative to."""
    attitude: Floats
    """(K, 3) [rad] estimated rotation vectors of the body in the window's cycles, beyond the heading (see
    `attitude`)."""
    attitude_information: Floats
    """(K, A, A) [1/rad^2] of these rotations, before their prior."""
    sway: Floats
    """(2, L) probabilities of the levels of the attitude's deviation, of tilt and yaw; (1, L) without a compass."""
    heave_levels: Floats
    """(L,) probabilities of the levels of the heave's deviation (see `heave`)."""
    start_height: Floats
    """(2,) [m] height that was told of the start, and its standard deviation within the Gaussian."""
    shift: Floats
    """(3,) [m] standard deviation of the start's position, an error that no measurement tells."""
    frame: StartFrame
    """Frame of the poses and the map, which may be turned with the start (see `start_frame`)."""
    scene: KnownEnvironment
    """What the filter is told beforehand: body, radio, sensor (but see `sensor`), panels."""
    lost_log_odds: float
    """Log odds that the agent is lost: that the map explains nothing of what is heard (see `divergence`)."""
    start_was_wrong: bool
    """Whether the first tracks have shown that the start's velocity or heading was told wrong."""
    turned: float
    """[rad] correction of the compass since it was found to be wrong."""
    codes: tuple[RisCode | None, ...]
    """(K,) phase codes of the window's cycles, as the agent believes they were applied."""
    passed: Floats
    """(P, 3) [m] smoothed positions of the poses that have left the window."""
    sensor: SensorModel
    """The sensor model as it was told; that of `scene` has the detection threshold that reports show."""
    reported: tuple[Floats, ...]
    """SNRs (M,) of the components reported in each of the last cycles, as many as a window has."""

    @property
    def attitude_variance(self) -> Floats:
        """Expected variance (A,) [rad^2] of the window state's attitude about each axis."""
        return attitude.variance(self.sway)

    @property
    def heave_variance(self) -> float:
        """Variance [m^2] by which the window state's heave of the present cycle is estimated, 0 if it is held for
        none."""
        return heave.variance(self.heave_levels)

    @property
    def heave_uncertainty(self) -> float:
        """Expected variance [m^2] of the window state's heave, whether it is held for none or not."""
        return heave.expected_variance(self.heave_levels) if self.may_heave else 0.0

    @property
    def may_heave(self) -> bool:
        """Whether the window state estimates the body's height above the floor in each cycle: where its motion is
        learnt, and walls tell of it."""
        return self.config.motion == "learnt" and self.scene.use_vt

    @property
    def heaves(self) -> bool:
        """Whether the window state holds a heave in any of its cycles."""
        return bool(self.window.heave_variance.any())

    @property
    def nuisance(self) -> Floats:
        """Estimates (K, Z) of each cycle's nuisances in the window state: the attitude [rad] about each axis that is
        estimated and, if there is any, the heave [m]."""
        rotation = self.attitude[:, : len(self.sway) + 1]
        return np.column_stack([rotation, self.window.heave]) if self.heaves else rotation

    @property
    def nuisance_variance(self) -> Floats:
        """Prior variances (K, Z) of the window state's `nuisance`; of a heave that there is not, those of `STILL`."""
        turned = np.tile(self.attitude_variance, (self.window.num_poses, 1))
        return np.column_stack([turned, np.maximum(self.window.heave_variance, STILL**2)]) if self.heaves else turned

    @property
    def attitude_covariance(self) -> Floats:
        """Covariance (K, A, A) [rad^2] of the window state's attitude in its cycles, under the deviations that are
        known by now."""
        return np.asarray(np.linalg.inv(self.attitude_information + np.diag(1.0 / self.attitude_variance)))
