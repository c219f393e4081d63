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
        np.zeros((size, size)), slots, whole, no_holds(),
    )  # fmt: skip


def _motion(step: Floats, trail: Floats, mean: Floats, std: Floats, turns: bool) -> tuple[Floats, Floats]:
    """Gaussian view's smoothest motion along the particles' trail (K, 4) to now: window head (7 + 3F,), accelerations
    (K - 1, A)."""
    count, head = len(trail), mean.copy()
    accel = np.zeros((count - 1, len(std)))
    weight = np.append(np.full(count - 1, 1.0 / FOLLOWED), 1.0 / MET)
    design = pose_matrix(step.tobytes(), np.zeros(count - 1).tobytes(), turns)
    for axis in range(len(std)):
        along = np.zeros((count, count + 1))
        along[:, 0], along[:, 2:] = design[:, axis, axis], design[:, axis, (2 * len(std) - turns) + axis :: len(std)]
        if axis < TURN:
            along[:, 1] = design[:, axis, len(std) + axis]
        speed = np.concatenate([[0.0, 1.0], step]) / MET
        calm = np.eye(count - 1, count + 1, 2) / std[axis]
        rows = np.concatenate([weight[:, None] * along, speed[None], calm])
        values = np.concatenate([weight * trail[:, axis], [mean[3 + axis] / MET if axis < TURN else 0.0]])
        if axis == TURN:
            rows[count] = 0.0
        found = np.linalg.lstsq(rows, np.append(values, np.zeros(count - 1)), rcond=None)[0]
        head[6 if axis == TURN else axis], accel[:, axis] = found[0], found[2:]
        if axis < TURN:
            head[3 + axis] = found[1]
    return head, accel
