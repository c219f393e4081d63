"""Hypothesis fits: one Gauss-Newton fit for all hypotheses of all tracks at once, with its marginal likelihood.

Known walls are affine maps here. What is sought is a wall `w` (as image of the agent's place), with the Tx's image
`m = S_out R_w(S_in x + t_in) + t_out`, or a point `p`, seen by the Rx at `S_r p + t_r` and by the Tx at `S_t p + t_t`.
With `S_in = 0` the wall mirrors a known point `t_in`, for the Rx while the Tx sees it as it is, or the other way round.
What two unknown walls throw together is `m = S_in x + d`, the shift `d` being sought: opposite walls turn nothing, at
right angles they turn by half a turn about their edge.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import AXES
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary
from rislam_rt.slam.window.solver_limits import ASTRAY, CERTAIN, STEPS


class Trials(NamedTuple):
    """Inputs of the fits of H hypotheses of what caused a track: initial value of the new feature, affine maps of known
    walls."""

    track: Integers
    """(H,) row of the track summary."""
    is_wall: Booleans
    """(H,) whether the new feature is a wall."""
    is_pair: Booleans
    """(H,) whether two unknown walls are sought, as the shift that both make."""
    start: Floats
    """(H, 3) [m] initial value of the new feature."""
    turn: Floats
    """(H, 2, 3, 3) linear parts of the two maps: for a wall S_in, S_out; for a point S_t, S_r."""
    shift: Floats
    """(H, 2, 3) [m] translations of the two maps."""
    uncertainty: Floats
    """(H, 2, 3, 3) square roots of the covariance that the errors of the two maps give to what they map
    (at about the start)."""
    mixed: Booleans
    """(H,) whether the return is unresolved from that of the new wall reflected in a known one (`beyond`), at an
    unknown share..."""
    even: Booleans
    """(H,) ...or at one half: it is the return over the known wall and the new one, met in the other order."""
    beyond: Floats
    """(H, 3, 4) linear part and translation of the reflection in that wall."""
    fixed: Booleans
    """(H,) whether the wall mirrors a known point, which is `shift[:, 0]`, and not the Tx..."""
    far: Booleans
    """(H,) ...on the leg to the Tx..."""
    aside: Booleans
    """(H,) ...or on that to the Rx, with a known wall on the other: its map is that of `other`."""
    other: Floats
    """(H, 3) what stands for that point on the leg that the new wall is not on; of `far`, `turn[:, 1]` makes it."""


class Fits(NamedTuple):
    """Fitted hypotheses of what caused a track, H of them: place of the new feature, covariance, cost and log
    evidence."""

    place: Floats
    """(H, 3) [m] of the new feature."""
    covariance: Floats
    """(H, 3, 3) [m^2] of the place, with all else uncertain."""
    held: Floats
    """(H, 3, 3) [m^2] of the place with the poses held fixed: what keeps the map from being linear in it."""
    cost: Floats
    """(H,) twice the negative log likelihood under Student's t, without its constants."""
    share: Floats
    """(H,) weight of the reflection in a known wall, where the return is unresolved from it."""
    log_evidence: Floats
    """(H,) Laplace's log evidence under a prior density 1 over the place, without the constants that hypotheses of a
    track share."""


def try_all(trials: Trials, summary: TrackSummary) -> Fits:
    """Fit all hypotheses of what caused the tracks by Gauss-Newton, whose steps are shortened if they lead no closer;
    those hopelessly behind after the first step are dropped, at infinite cost."""
    count, common = len(trials.track), COMMON + summary.twist.shape[-1]
    active, cost, log_det = np.arange(count), np.full(count, np.inf), np.zeros(count)
    covariance, held = np.tile(AXES, (count, 1, 1)), np.tile(AXES, (count, 1, 1))
    place, error, first = trials.start.copy(), np.zeros((count, common)), cost
    normal, step = np.zeros((count, common + 3, common + 3)), np.zeros((count, common + 3))
    for turn in range(STEPS + 1):
        at = place[active] + step[active, common:], error[active] + step[active, :common]
        # all measurements count for the first step: what is far off a first guess may be near to the place
        now = _equations(trials, summary, active, *at, robust=turn > 0)
        closer = now.cost <= cost[active]
        some, back = active[closer], active[~closer]
        place[some], error[some], cost[some] = at[0][closer], at[1][closer], now.cost[closer]
        if turn == 0:
            first = cost.copy()
        now = _Equations(*(field[closer] for field in now))
        step[back] *= 0.25  # one that led away from what is heard, as near the horizon, most often went too far
        if turn == 2 and (stuck := back[cost[back] == first[back]]).size:
            # where all measurements pull need not be where most of them lie
            again = _equations(trials, summary, stuck, place[stuck], error[stuck], robust=True)
            some, now = np.append(some, stuck), _Equations(*map(np.concatenate, zip(now, again, strict=True)))
        normal[some] = now.normal
        if turn == STEPS:
            break
        stiff = now.normal.copy()
        # a length alone leaves a ring of places, and an angle's square a flat ridge, along which steps lead astray
        stiff[(trials.far | trials.even)[some], common:, common:] += AXES / ASTRAY**2
        step[some] = np.linalg.solve(stiff, now.slope[..., None])[..., 0]
        length = np.sqrt(np.vecdot(step[some, common:], step[some, common:]))[:, None]
        step[some] *= np.minimum(1.0, 1.5 / np.maximum(length, 1e-12))
        if turn in (1, STEPS - 1):
            best = np.full(len(summary.seen), np.inf)
            np.minimum.at(best, trials.track, cost)
            # an angle that its sine tells takes more steps
            lost = ~((cost < best[trials.track] + 2.0 * CERTAIN) | (trials.even & (turn == 1)))
            active, cost[lost] = np.flatnonzero(~lost), np.inf
    last = np.eye(common + 3)[:, common:]
    covariance[active] = np.linalg.solve(normal[active], last)[:, common:]
    held[active] = np.linalg.inv(normal[active, common:, common:])
    log_det[active] = np.linalg.slogdet(normal[active])[1]
    evidence = -0.5 * cost - 0.5 * log_det + 1.5 * np.log(2.0 * np.pi)
    share = np.where(trials.mixed, _shares(trials.even, error), 0.0)
    # a component lies between the two that it is made of
    evidence -= 20.0 * (np.maximum(-share, 0.0) + np.maximum(share - 1.0, 0.0))
    return Fits(place, covariance, held, cost, share, evidence)


COMMON = 13
"""Number of a fit's unknowns beside the place: errors of pose and velocity, of the two maps, and of the share; headings
come on top."""


class _Equations(NamedTuple):
    """Normal equations of H fits, and their costs."""

    normal: Floats
    slope: Floats
    cost: Floats


def _equations(
    trials: Trials, summary: TrackSummary, rows: Integers, place: Floats, error: Floats, *, robust: bool
) -> _Equations:
    """Normal equations of the next Gauss-Newton step of hypotheses `rows`, at places (H, 3) and errors (H, E) of poses
    and maps, with their costs; measurements weigh as Student's t weighs their residuals, if it is to be `robust`."""
    track, wall, pair = trials.track[rows], trials.is_wall[rows], trials.is_pair[rows]
    moving = wall | pair
    tx, rx = summary.tx[track], summary.rx[track]
    turn, shift = trials.turn[rows], trials.shift[rows]
    first, second = turn[:, 0], turn[:, 1]
    # a point: fixed images; a wall: the image of the Tx, which moves
    inner = tx @ np.swapaxes(first, 1, 2) + shift[:, None, 0]
    mirrored, by_wall, flip = _mirrored(inner, place, summary.middle)
    out, fixed = trials.far[rows][:, None, None], trials.fixed[rows][:, None, None]
    base = np.where(wall[:, None, None], mirrored, place[:, None] + np.where(pair[:, None, None], inner, 0.0))
    base = np.where(out, inner, base)
    image = base @ np.swapaxes(second, 1, 2) + shift[:, None, 1]
    inside = np.where(wall[:, None, None, None], np.where(out[..., None], 0.0, by_wall), AXES)
    by_tx = np.where(wall[:, None, None], second @ flip @ first, np.where(pair[:, None, None], first, 0.0))
    to_rx = image - rx
    reach = np.maximum(np.sqrt(np.vecdot(to_rx, to_rx)), 1e-6)
    arrival = to_rx / reach[..., None]
    by_image = _by_image(arrival, reach)
    # the point's leg to the Tx
    far = np.where(fixed, trials.other[rows][:, None], place[:, None, :] @ np.swapaxes(first, 1, 2) + shift[:, None, 0])
    far = np.where(out, mirrored, far)
    to_tx = np.where(moving[:, None, None] & ~fixed, 0.0, far - tx)
    leg = np.sqrt(np.vecdot(to_tx, to_tx))
    toward = to_tx / np.maximum(leg, 1e-6)[..., None]
    seen = np.concatenate([(reach + leg)[..., None], arrival[..., :2]], axis=-1)
    new = _through(by_image, second) @ inside
    new[..., 0, :] += np.where(out, (toward[..., None, :] @ by_wall)[..., 0, :], toward @ first)
    pose = _through(by_image, by_tx - AXES)
    pose[..., 0, :] -= toward
    maps = _by_maps(trials, rows, by_image, toward, flip)
    split = _mix(trials, rows, (tx, rx, place, summary.middle), error, (seen, new, pose))
    wide = np.concatenate(
        [summary.twist[track], pose @ summary.uncertainty[track], *maps, split, new], axis=-1
    )  # fmt: skip
    weight = summary.weight[track]
    wide *= weight[..., None]
    # the share stands in the prediction itself, the other errors are linear
    size = wide.shape[-1]
    flat = wide.reshape(len(rows), -1, size)
    told = flat[..., : error.shape[1] - 1] @ error[:, :-1, None]
    left = (summary.seen[track] - seen) * weight - told.reshape(seen.shape)
    squared, tail = np.vecdot(left, left), CONSTANTS.tail
    if robust:
        trust = np.sqrt((tail + 3.0) / (tail + squared))
        left *= trust[..., None]
        flat *= np.repeat(trust, 3, axis=1)[..., None]
    normal = np.swapaxes(flat, 1, 2) @ flat
    slope = (np.swapaxes(flat, 1, 2) @ left.reshape(len(rows), -1, 1))[..., 0]
    common, own = np.arange(error.shape[1]), np.arange(error.shape[1], size)
    normal[:, np.arange(size), np.arange(size)] *= 1.0 + 1e-12  # a blind direction that rounding would make singular
    normal[:, common, common] += 1.0
    span = place - summary.middle
    ridge = (2.0 * CONSTANTS.size) ** -2.0  # what nothing tells of lies in the room
    normal[:, own, own] += np.where(trials.far[rows], 1.0 / np.maximum(np.vecdot(span, span), 0.01), ridge)[:, None]
    slope[:, common] -= error
    cost = (tail + 3.0) * np.log1p(squared / tail).sum(axis=1) + np.vecdot(error, error)
    return _Equations(normal, slope, cost)


def _mirrored(spots: Floats, place: Floats, middle: Floats) -> tuple[Floats, Floats, Floats]:
    """Images (H, B, 3) of spots (H, B, 3) in the new walls of hypotheses, which mirror `middle` (3,) to `place` (H, 3),
    and their derivatives by that place (H, B, 3, 3) and by the spots (H, 3, 3)."""
    span = place - middle
    scaled = span / np.maximum(np.vecdot(span, span), 1e-9)[:, None]
    depth = np.vecdot(scaled[:, None], spots - 0.5 * (place + middle)[:, None])
    image = spots - 2.0 * depth[..., None] * span[:, None]
    by_place = depth[..., None, None] * AXES + scaled[:, None, :, None] * (image - place[:, None])[..., None, :]
    return image, -2.0 * by_place, AXES - 2.0 * span[:, :, None] * scaled[:, None, :]


def _by_maps(trials: Trials, rows: Integers, by_image: Floats, toward: Floats, flip: Floats) -> tuple[Floats, Floats]:
    """Slopes (H, B, 3, 3) of a hypothesis's fit by the errors of the known walls' affine maps before and behind the new
    feature.

    What is seen moves by `by_image` (H, B, 3, 3) with the image that the Rx hears, its length by `toward` (H, B, 3)
    with what the Tx sees; `flip` (H, 3, 3) mirrors.
    """
    (near, behind), second = np.moveaxis(trials.uncertainty[rows], 1, 0), trials.turn[rows, 1]
    far, wall, aside = (field[rows][:, None, None] for field in (trials.far, trials.is_wall, trials.aside))
    mirrored = flip @ near
    heard = np.where(far, second @ near, np.where(wall, second @ mirrored, 0.0))
    first, last = _through(by_image, heard), _through(by_image, np.where(aside, 0.0, behind))
    first[..., 0, :] += toward @ np.where(far, mirrored, near)
    last[..., 0, :] += toward @ np.where(aside, behind, 0.0)
    return first, last


def _through(slopes: Floats, maps: Floats) -> Floats:
    """Slopes (H, B, 3, 3) multiplied by matrices (H, 3, 3) (chain rule), one product of matrices for each
    hypothesis."""
    count, points = slopes.shape[:2]
    return np.asarray((slopes.reshape(count, 3 * points, 3) @ maps).reshape(count, points, 3, 3))


def _shares(even: Booleans, error: Floats) -> Floats:
    """Weights (H,) of the second of two unresolved returns, from their errors, the last of (H, E)."""
    return np.where(even, 0.5, CONSTANTS.weaker * (1.0 + error[:, -1]))


def _mix(
    trials: Trials, rows: Integers, ends: tuple[Floats, Floats, Floats, Floats], error: Floats,
    seen: tuple[Floats, Floats, Floats],
) -> Floats:  # fmt: skip
    """Move predictions, and their slopes by place and pose, in place towards the new wall's return as reflected in a
    known wall, from which they are unresolved; returns the slope (H, B, 3, 1) by the share's error.

    `ends` are Tx and Rx positions (H, B, 3), new walls (H, 3) and the place that these are images of (3,). By the known
    wall's error both are moved alike (`_by_maps`), as they are at right angles.
    """
    value, new, pose = seen
    split = np.zeros((*value.shape, 1))
    both = trials.mixed[rows].nonzero()[0]
    if not len(both):
        return split
    (tx, rx, place), middle = (end[both] for end in ends[:3]), ends[3]
    mirror, even = trials.beyond[rows[both]], trials.even[rows[both]]
    image, inside, flip = _mirrored(tx, place, middle)
    out = image @ np.swapaxes(mirror[..., :3], 1, 2) + mirror[:, None, :, 3] - rx
    length = np.sqrt(np.vecdot(out, out))
    ray = out / length[..., None]
    gap = np.concatenate([length[..., None], ray[..., :2]], axis=-1) - value[both]
    share = _shares(even, error[both])[:, None, None]
    value[both] += share * gap
    split[both] = np.where(even, 0.0, CONSTANTS.weaker)[:, None, None, None] * gap[..., None]
    across = _by_image(ray, length)
    turned = _through(across, mirror[..., :3])
    by_new, by_agent = turned @ inside, _through(turned, flip) - across
    new[both] += share[..., None] * (by_new - new[both])
    pose[both] += share[..., None] * (by_agent - pose[both])
    return split


def _by_image(arrival: Floats, reach: Floats) -> Floats:
    """Derivatives (..., 3, 3), for a hypothesis's fit, of a path's length and cosines by the apparent place from which
    its ray arrives."""
    found = np.empty((*reach.shape, 3, 3))
    found[..., 0, :] = arrival
    found[..., 1:, :] = (AXES[:2] - arrival[..., :2, None] * arrival[..., None, :]) / reach[..., None, None]
    return found


def smooth_paths(summary: TrackSummary) -> tuple[Floats, Floats]:
    """Fits of no hypothesis: log evidence (T,) and cost (T,) of tracks as paths of no listed kind, whose length and
    cosines change smoothly.

    Their first two derivatives are beforehand what the agent's own speed makes of things at rest or mirrored; the place
    counts with a density 1 over length and cosines.
    """
    count = len(summary.seen)
    reach = np.maximum(summary.mean[0][:, 0], 0.3)
    speed = np.sqrt(2.0) * summary.speed
    rate = speed * np.stack([np.ones(count), 1.0 / reach, 1.0 / reach], axis=1)
    bend = speed**2 * np.stack([1.0 / reach, reach**-2.0, reach**-2.0], axis=1) + 0.1 * rate
    time = summary.time - summary.time.mean(axis=1, keepdims=True)
    rows = np.stack([np.ones(time.shape), time, 0.5 * time**2], axis=-1)[:, None]
    tail = CONSTANTS.tail
    trust = np.ones(time.shape)
    value, weight = np.swapaxes(summary.seen, 1, 2), np.swapaxes(summary.weight, 1, 2)
    spread = np.stack([rate, bend], axis=-1)
    for _ in range(3):
        heavy = rows * (weight**2 * trust[:, None])[..., None]
        normal = np.swapaxes(heavy, 2, 3) @ rows
        normal[..., 0, 0] += 1e-9
        normal[..., [1, 2], [1, 2]] += spread**-2.0
        best = np.linalg.solve(normal, np.swapaxes(heavy, 2, 3) @ value[..., None])[..., 0]
        left = (value - (rows @ best[..., None])[..., 0]) * weight
        squared = np.sum(left**2, axis=1)
        trust = (tail + 3.0) / (tail + squared)
    cost = (tail + 3.0) * np.log1p(squared / tail).sum(axis=1) + ((best[..., 1:] / spread) ** 2).sum(axis=(1, 2))
    log_det = np.linalg.slogdet(normal)[1].sum(axis=1) + 2.0 * np.log(spread).sum(axis=(1, 2))
    return -0.5 * cost - 0.5 * log_det + 1.5 * np.log(2.0 * np.pi), cost
