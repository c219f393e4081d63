"""Gaussian view of the nested filter's particles: their mean and covariance as a sliding window of poses.

Prediction, association, births and the map ask a belief for its present mean and covariance and for the way that led
there (`slam.window`). A window whose accelerations follow the trail of the particles, and whose first pose is as
uncertain as the present one makes it, tells just that.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.nested.particles.particle_belief import Nested, gaussian
from rislam_rt.slam.window.smoother.cholesky import inverse
from rislam_rt.slam.window.smoother.direction_priors import no_holds
from rislam_rt.slam.window.smoother.motion_basis import HEAD, POSE, TURN, last_pose_matrix, pose_matrix
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic, Window
from rislam_rt.slam.window.solver_limits import STILL

FOLLOWED, MET = 1e-4, 1e-8
"""Deviations [m, rad] with which the window follows the particles' trail, and [m, m/s, rad] meets the present."""
ROUNDING = 1e-14
"""Variance [m^2, ...] up to which a coordinate counts as known exactly: rounding makes as much of none."""


def gaussian_view(belief: Nested, step: Floats, heading: Floats, config: SlamConfig) -> Window:
    """Gaussian of the particles as a window of K poses `step` (K - 1,) [s] apart; compass `heading` (K,) [rad]."""
    mean, covariance = gaussian(belief)
    exact = np.diag(covariance) < ROUNDING
    covariance[exact] = covariance[:, exact] = 0.0
    trail = np.einsum("n,knj->kj", belief.weight, belief.trail)
    trail[:, 3] -= heading
    mean[6] -= heading[-1]
    turns, straight = config.heading != "known", np.zeros(len(step))
    std = np.append(np.where(config.axes > 0.0, config.sigma_a, STILL), max(config.turn_std, STILL) * 10.0)[: 3 + turns]
    head, accel = _motion(step, trail, mean, std, turns)
    size, count, slim = len(mean), len(heading), POSE + len(mean) - HEAD
    back = np.eye(size)
    back[:HEAD, :HEAD] = np.linalg.inv(last_pose_matrix(step.tobytes(), straight.tobytes(), turns)[:, :HEAD])
    whole = np.zeros((size + accel.size,) * 2)
    whole[:size, :size] = back @ covariance @ back.T
    prior = Quadratic(inverse(whole[:size, :size] + ROUNDING * np.eye(size)), np.zeros(size), head)
    slots = Quadratic(np.zeros((count, slim, slim)), np.zeros((count, slim)), np.zeros((count, slim)))
    precision = np.tile(std**-2.0, (count - 1, 1))
    none = np.zeros(accel.shape)
    return Window(
        head, accel, precision, precision, none, precision[:, 2], step, straight, prior,
        np.zeros((size, size)), slots, whole, no_holds(), np.zeros(count), np.zeros(count),
    )  # fmt: skip


def _motion(step: Floats, trail: Floats, mean: Floats, std: Floats, turns: bool) -> tuple[Floats, Floats]:
    """Gaussian view's smoothest motion along the particles' trail (K, 4) to now: window head (7 + 3F,), accelerations
    (K - 1, A)."""
    count, free, head = len(trail), len(std), mean.copy()
    straight, known = np.zeros(count - 1), HEAD if free > TURN else HEAD - 1
    weight = np.append(np.full(count - 1, 1.0 / FOLLOWED), 1.0 / MET)
    design = weight[:, None, None] * pose_matrix(step.tobytes(), straight.tobytes(), turns)
    speed = last_pose_matrix(step.tobytes(), straight.tobytes(), turns)[3:6] / MET
    calm = np.eye(design.shape[2])[HEAD:] / np.tile(std, count - 1)[:, None]
    rows = np.concatenate([design.reshape(-1, design.shape[2]), speed, calm])
    values = np.concatenate([(weight[:, None] * trail[:, :free]).ravel(), mean[3:6] / MET, np.zeros(len(calm))])
    found = np.linalg.lstsq(rows, values, rcond=None)[0]
    head[:known] = found[:known]
    return head, found[HEAD:].reshape(-1, free)
