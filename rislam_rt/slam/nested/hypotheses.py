"""Hypotheses of what a track could be: fits of a static point, an image of a known point, a moving image, the floor."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z, unit
from rislam_rt.slam.observations import UNTOLD
from rislam_rt.slam.returns import AXES, NONE, TX, Poses, Returns, linearise, reflect

POINT = Returns(np.array([[0, NONE, NONE]]), np.array([0]), np.array([0]))
"""A static point; the feature sought is row 0."""
IMAGE = Returns(np.array([[1, NONE, NONE], [1, 0, NONE]]), np.array([0]), np.array([1]))
"""Tx, point (row 1), wall (row 0, sought), Rx."""
RECIPROCAL = Returns(np.array([[1, 0, NONE], [1, NONE, NONE]]), np.array([0]), np.array([1]))
"""Tx, wall (row 0, sought), point (row 1), Rx."""
TWIN = Returns(IMAGE.legs, np.array([0, 1]), np.array([1, 0]))
"""Both of them in one resolution cell: alike in length and strength, they come out as one, halfway between."""
MOVING = Returns(np.array([[TX, NONE, NONE], [TX, 0, NONE]]), np.array([0]), np.array([1]))
"""Tx, wall (row 0, sought), Rx: the image of the Tx moves with the agent."""

DAMPING = 1e-5
"""Levenberg's damping in units of the information's trace: keeps steps along blind directions short."""
CONVERGED = 1e-3
"""Length [m] of a step after which a fit has settled."""
TAIL = 4.0
"""Degrees of freedom of Student's t: paths that nobody expected, in the same cell, make the errors' tails heavy."""
COST_MEAN, COST_STD = 3.56, 2.17
"""Mean and standard deviation of `(TAIL + 3) log(1 + chi^2 / TAIL)` for chi^2 with 3 degrees of freedom."""
HELD = 1e-3
"""Standard deviation [m] of a position that is held."""
RIDGE = 1e-4
"""Prior information [1/m^2], (100 m)^-2, that keeps blind directions finite."""
UPRIGHT_TILT = 0.01
"""Standard deviation [rad] of a wall's lean, where its own returns do not tell it: they arrive level."""
FLOOR_TILT = 0.05
"""Standard deviation [rad] of the angle between the floor and the plane that the agent moves in."""


class Fit(NamedTuple):
    """Least-squares estimates of one feature from K measurements, for any leading axes."""

    feature: Floats
    """(..., 3) [m]."""
    covariance: Floats
    """(..., 3, 3) [m^2] about where the agent is: its own error moves the feature along and is no reason to wait."""
    cost: Floats
    """(...,) twice the negative log likelihood under Student's t, without its constants."""


class History(NamedTuple):
    """K measurements and the poses they were taken from."""

    seen: Floats
    """(K, 3)."""
    std: Floats
    """(K, 3)."""
    poses: Poses
    """Tx and Rx (..., K, 3), heading (K,)."""
    lag: Floats
    """(K,) time [s] since each measurement."""
    ratio: float
    """Log of the amplitude over that of free space of the same length."""
    uncertainty: Floats
    """(6, D) square root of the covariance of today's position and velocity, through which all poses err together;
    no columns where the poses are taken as certain."""
    panel: float = 0.0
    """By how much chi^2 its amplitudes speak for a point (see `tracks.panel_surplus`)."""
    side: int = UNTOLD
    """Whether it runs over the panel (see `tracks.Observations`)."""

    @property
    def pose_uncertainty(self) -> Floats:
        """(K, 3, D) the same for the positions at the measurements."""
        return self.uncertainty[:3] - self.lag[:, None, None] * self.uncertainty[3:]


def fit_feature(
    kind: Returns,
    start: Floats,
    parent: Floats | None,
    anchor: Floats,
    history: History,
    steps: int,
    upright: float = np.inf,
) -> Fit:
    """Fit a hypothesis of a feature to a track: Gauss-Newton from `start` (..., 3), outliers by Student's t.

    `parent` (..., 3) is the known point of an image hypothesis. With `history.pose_uncertainty` the pose is fitted
    along, held by its own covariance: a wrong speed must not speak against a hypothesis that is right. `upright` is the
    standard deviation [m] of the feature's height about the anchor's, 0 lean for a wall.
    """
    anchors = np.stack([anchor, anchor])
    solution = _solve(kind, np.array(start), parent, anchors, history, None, upright)
    for _ in range(steps):
        damping = DAMPING * np.trace(solution.normal, axis1=-2, axis2=-1)[..., None, None] * AXES
        step = np.linalg.solve(solution.normal + damping, solution.slope[..., None])[..., 0]
        length = np.sqrt(np.vecdot(step, step))[..., None]
        feature = solution.feature + step * np.minimum(1.0, 1.0 / np.maximum(length, 1e-12))
        solution = _solve(kind, feature, parent, anchors, history, solution.trust, upright)
        if length.max() < CONVERGED:
            break
    return Fit(solution.feature, np.asarray(np.linalg.inv(_held(solution.gram, history.uncertainty))), solution.cost)


def _held(gram: Floats, uncertainty: Floats) -> Floats:
    """Information (..., 3, 3) on a hypothesis, today's position held and the velocity as uncertain as it is."""
    size = uncertainty.shape[1]
    inner = gram[..., :size, :size] + np.eye(size) + uncertainty[:3].T @ uncertainty[:3] / HELD**2
    lost = gram[..., size:-1, :size] @ np.linalg.solve(inner, gram[..., :size, size:-1])
    return np.asarray(gram[..., size:-1, size:-1] - lost)


class _Solution(NamedTuple):
    """The normal equations at one place, the pose's error eliminated."""

    feature: Floats
    normal: Floats
    """(..., 3, 3)."""
    slope: Floats
    """(..., 3)."""
    cost: Floats
    """(...,)."""
    trust: Floats
    """(..., K) weight that Student's t gives each measurement."""
    gram: Floats
    """(..., D + 4, D + 4) before that: the pose's D numbers, without their prior, the feature's three, the residual."""


def _solve(
    kind: Returns,
    feature: Floats,
    parent: Floats | None,
    anchors: Floats,
    history: History,
    trust: Floats | None,
    upright: float = np.inf,
) -> _Solution:
    linear = linearise(kind, _features(feature, parent), anchors, history.poses)
    by_uncertainty = linear.by_pose @ history.pose_uncertainty[:, None]
    # what comes out as one lies halfway between: by the pose's D numbers, by the feature's three, and the prediction
    columns = np.concatenate([by_uncertainty, linear.by_feature[..., 0, :], linear.seen[..., None]], axis=-1)
    columns = columns[..., 0, :, :] if len(kind.tx) == 1 else columns.mean(axis=-3)
    columns[..., -1] = history.seen - columns[..., -1]
    columns /= history.std[..., None]
    weighted = columns if trust is None else columns * trust[..., None, None]
    tall = (*columns.shape[:-3], -1, columns.shape[-1])
    gram = np.swapaxes(weighted.reshape(tall), -1, -2) @ columns.reshape(tall)
    size = history.uncertainty.shape[1]
    gram[..., size:-1, size:-1] += np.diag([RIDGE, RIDGE, RIDGE + upright**-2])
    solved = np.linalg.solve(gram[..., :size, :size] + np.eye(size), gram[..., :size, size:])
    rest = gram[..., size:, size:] - gram[..., size:, :size] @ solved
    normal, slope = rest[..., :3, :3], rest[..., :3, 3]
    lean = feature[..., 2] - anchors[0, 2]
    slope[..., 2] -= upright**-2 * lean
    pose_error = solved[..., 3]
    left = columns[..., -1] - (columns[..., :size] @ pose_error[..., None, :, None])[..., 0]
    squared = np.vecdot(left, left)
    cost = (TAIL + 3.0) * np.log1p(squared / TAIL).sum(axis=-1) + np.vecdot(pose_error, pose_error)
    cost = cost + (lean / upright) ** 2
    return _Solution(feature, normal, slope, cost, (TAIL + 3.0) / (TAIL + squared), gram)


def plausible(fit: Fit, count: int, parameters: int) -> bool:
    """Whether a hypothesis that fits `count` measurements costs at most 2.5 deviations more than it should."""
    # each parameter takes out about as much as one of the 3 count squared residuals contributes
    expected = COST_MEAN * (count - parameters / 3.0)
    return bool(fit.cost < expected + 2.5 * COST_STD * np.sqrt(count))


def initial_value(kind: Returns, parent: Floats | None, anchor: Floats, history: History) -> Floats | None:
    """Start (3,) of a hypothesis' fit from the averages over the history; None where the geometry forbids it."""
    weight = 1.0 / history.std[:, 0] ** 2
    seen = weight @ history.seen / weight.sum()
    tx, rx = history.poses.tx.mean(axis=-2), history.poses.rx.mean(axis=-2)
    up = np.sqrt(max(1.0 - seen[1] ** 2 - seen[2] ** 2, 0.01))
    ray = rotation_z(np.asarray(np.mean(history.poses.heading))) @ np.array([seen[1], seen[2], up])
    ray /= np.linalg.norm(ray)
    if kind is POINT:
        base = tx - rx
        return rx + ray * (seen[0] ** 2 - base @ base) / (2.0 * (seen[0] - base @ ray))
    if kind is MOVING:
        return wall_between(tx, rx + seen[0] * ray, anchor)
    assert parent is not None
    if kind is TWIN:
        ray = 2.0 * ray - unit(parent - rx)
        ray = unit(np.array([ray[0], ray[1], max(ray[2], 0.05)]))
    reach = seen[0] - float(np.linalg.norm(tx - parent))
    return wall_between(parent, rx + reach * ray, anchor) if reach > 0.1 else None


def fit_reciprocal(parent: Floats, anchor: Floats, history: History) -> Fit | None:
    """Hypothesis of a wall on the Tx leg to a known point: only distances speak of it, so that many may fit."""
    tx, rx = history.poses.tx, history.poses.rx
    reach = float(np.mean(history.seen[:, 0] - np.linalg.norm(rx - parent, axis=-1)))
    middle = tx.mean(axis=0)
    if reach < float(np.linalg.norm(middle - parent)) + 0.05:
        return None
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    starts = [wall_between(parent, middle + reach * axis, anchor) for axis in axes]
    good = np.array([start for start in starts if start is not None])
    if not len(good):
        return None
    fits = fit_feature(RECIPROCAL, good, parent, anchor, history, 6)
    best = int(np.argmin(fits.cost))
    return Fit(fits.feature[best], fits.covariance[best], fits.cost[best])


def fit_floor(parent: Floats, anchor: Floats, history: History) -> Fit | None:
    """Hypothesis of a floor below: level as the agent's motion is, at the height that Tx leg lengths tell.

    The array is blind for what comes from below, so that the floor shows on Tx legs alone, and distances taken on a
    straight line cannot tell below from beside. That floors are level is what the agent knows from driving on it.
    """
    height, information = floor_height(parent, history)
    if not np.isfinite(height) or height > min(float(history.poses.tx[:, 2].min()), float(parent[2])) - 0.05:
        return None
    image = floor_image(height, anchor)
    cost = _solve(RECIPROCAL, image, parent, np.stack([anchor, anchor]), history, None).cost
    lever = 2.0 * (anchor[2] - height)
    spread = np.array([lever * FLOOR_TILT, lever * FLOOR_TILT, 2.0 / np.sqrt(information)])
    return Fit(image, np.diag(spread**2), cost)


def fit_doubles(wall: Floats, anchor: Floats, history: History) -> list[Fit]:
    """Hypotheses of two walls, where the one `wall` (3,) throws a moving image: opposite, edge, corner.

    Until the agent has moved enough these look like the image in one wall, or like a point.
    """
    return [
        _fit_opposite(wall, anchor, history),
        _fit_edge(wall, anchor, history),
        _fit_corner(wall, anchor, history),
    ]


def _fit_opposite(wall: Floats, anchor: Floats, history: History) -> Fit:
    """Hypothesis of opposite walls: the image goes along with the agent, as if it stood still."""
    poses = history.poses
    tx = np.broadcast_to(poses.tx.mean(axis=-2, keepdims=True), poses.tx.shape)
    still = Poses(tx, tx + poses.rx - poses.tx, poses.heading)
    return fit_feature(MOVING, wall, None, anchor, history._replace(poses=still, uncertainty=np.zeros((6, 0))), 6)


def _fit_edge(wall: Floats, anchor: Floats, history: History) -> Fit:
    """Hypothesis of an upright wall and the ceiling: the image moves as in the wall alone, at another height."""
    tx, rx, seen = history.poses.tx.mean(axis=-2), history.poses.rx.mean(axis=-2), history.seen
    up = np.sqrt(np.maximum(1.0 - seen[:, 1] ** 2 - seen[:, 2] ** 2, 0.0))
    rise = (np.mean(seen[:, 0] * up) + rx[2] - tx[2]) * AXES[2]
    image = reflect(tx, wall, anchor)
    image[2] = tx[2] + rise[2]
    upright = wall_between(tx + rise, image, anchor)
    upright = wall if upright is None else upright  # right above: the ceiling alone
    raised = history._replace(poses=history.poses._replace(tx=history.poses.tx + rise))
    return fit_feature(MOVING, upright, None, anchor, raised, 6, slack_of_height(upright, anchor))


def _fit_corner(wall: Floats, anchor: Floats, history: History) -> Fit:
    """Hypothesis of two upright walls: the image is turned about their edge, met there and back between both ends."""
    middle = 0.5 * (history.poses.tx + history.poses.rx)
    centre = middle.mean(axis=-2)
    edge = 0.5 * (centre + reflect(centre, wall, anchor))
    edge[2] = centre[2]
    turned = history._replace(poses=Poses(middle, middle, history.poses.heading))
    return fit_feature(POINT, edge, None, centre, turned, 6, slack_of_height(edge, centre))


def slack_of_height(feature: Floats, anchor: Floats) -> float:
    """Standard deviation [m] of the height of what upright walls throw, under a birth hypothesis."""
    return max(float(np.linalg.norm(feature - anchor)) * UPRIGHT_TILT, 1e-3)


def floor_height(parent: Floats, history: History) -> tuple[Floats, Floats]:
    """Height (...,) [m] of a level mirror on the Tx leg to `parent` (..., 3), and its information [1/m^2]."""
    tx, rx = history.poses.tx, history.poses.rx
    to_parent = parent[..., None, :] - tx
    reach = history.seen[:, 0] - np.linalg.norm(rx - parent[..., None, :], axis=-1)
    drop = np.sqrt(np.clip(reach**2 - np.sum(to_parent[..., :2] ** 2, axis=-1), 0.0, None))
    # reach^2 = across^2 + drop^2 and drop = tx_z + parent_z - 2 height, so d reach / d height = -2 drop / reach
    weight = (2.0 * drop / np.maximum(reach, 1e-9) / history.std[:, 0]) ** 2
    information = np.sum(weight, axis=-1)
    height = 0.5 * (tx[..., 2] + parent[..., None, 2] - drop)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sum(weight * height, axis=-1) / information, information


def floor_image(height: Floats, anchor: Floats) -> Floats:
    """Hypothesis of a level mirror at heights (...,) as images (..., 3) of the anchor."""
    height = np.asarray(height)
    return np.stack(
        [np.full(height.shape, anchor[0]), np.full(height.shape, anchor[1]), 2.0 * height - anchor[2]], axis=-1
    )


def wall_between(point: Floats, image: Floats, anchor: Floats) -> Floats | None:
    """The wall that mirrors `point` to `image`, as the image (3,) of the anchor; None if they nearly coincide."""
    span = image - point
    if np.linalg.norm(span) < 0.2:
        return None
    wall = reflect(anchor, image, point)
    return wall if np.linalg.norm(wall - anchor) > 0.05 else None


def _features(feature: Floats, parent: Floats | None) -> Floats:
    """(..., 1, F, 3): the axis of ones broadcasts over the K measurements."""
    if parent is None:
        return feature[..., None, None, :]
    known = np.empty((*feature.shape[:-1], 1, 2, 3))
    known[..., 0, 0, :], known[..., 0, 1, :] = feature, parent
    return known
