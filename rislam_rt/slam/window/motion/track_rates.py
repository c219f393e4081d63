"""Rates of the tracks that nothing explains yet, as measurements of the agent's way.

Whatever throws it, a return grows shorter by the way that the agent goes towards where it arrives from, and towards
where it leaves to: by twice the way, over a wall, a point, or two walls at right angles; over two other things there is
a reciprocal path, which tells (`reciprocal_paths`). So a track tells of the way before it is a feature: its length
follows the poses along these directions, but for a constant and a rate of its own, which nobody knows (the length at
the start, and what the baseline, a turn of the body and errors of the direction do). It counts by its probability of
being such a path. Once it is born, its history enters with the feature, and the window's rows count here no more.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import FAR
from rislam_rt.slam.window.motion.length_rates import enough_measured, shown_scatter
from rislam_rt.slam.window.reciprocal_paths import PathDirections, spread_by_legs, with_reciprocal
from rislam_rt.slam.window.smoother import window_gaussian
from rislam_rt.slam.window.smoother.marginals import way_variance
from rislam_rt.slam.window.smoother.rate_factor import RateFactor
from rislam_rt.slam.window.solver_limits import STILL
from rislam_rt.slam.window.state import WindowState


class _Histories(NamedTuple):
    """Components of T tracks, N in all, track by track in the order of time, and what the poses leave of them."""

    which: Integers
    """(N,) direction of which track each component is of: one for each track but those that an array hears alike from
    two directions."""
    slot: Integers
    """(N,) pose of the window."""
    time: Floats
    """(N,) [s] since the track's weighted mean time."""
    length: Floats
    """(N,) [m] measured."""
    weight: Floats
    """(N,) [1/m^2] one over the variance that a length is expected to have."""
    toward: Floats
    """(N, 3) derivative of the length by the position: the direction of arrival in the room's axes, times -2."""
    left: Floats
    """(N,) [m] length less what the estimated way since the track's first component makes of it."""
    ends: Integers
    """(T, 2) slots of each track's first and last component."""
    span: Floats
    """(T,) [s] between these."""
    speed: Floats
    """(T,) [m/s] mean speed of the agent in between."""
    own_variance: Floats
    """(T,) [m^2/s^2] of the rate of its own."""
    owner: Integers
    """(T,) track of each direction."""

    def total(self, value: Floats) -> Floats:
        """Sums (T,) over each track's history of values (N,)."""
        return np.asarray(np.bincount(self.which, value, len(self.span)), dtype=np.float64)

    def means(self, *values: Floats) -> list[Floats]:
        """Weighted means (T,) over each track's history of each of some values (N,)."""
        weight = self.total(self.weight)
        return [self.total(self.weight * value) / weight for value in values]

    def slopes(self, *values: Floats) -> tuple[list[Floats], Floats]:
        """Rates (T,) [m/s] of the tracks, slopes of weighted line fits to each of some values (N,), and their
        variances."""
        information, weighted = self.total(self.weight * self.time**2), self.weight * self.time
        return [self.total(weighted * value) / information for value in values], 1.0 / information


def with_rates(state: WindowState) -> WindowState:
    """State whose window holds what the rates of its unexplained tracks tell of the poses."""
    return state._replace(window=state.window._replace(rates=rate_factor(state)))


def rate_factor(state: WindowState) -> RateFactor | None:
    """What the lengths of the window's unexplained tracks tell of its poses; None where no track is long enough, where
    their directions hang on an estimated heading, and without wall returns, which then must move nothing."""
    window, log = state.window, state.log
    if window.turns or not state.scene.use_vt or len(state.heading) != window.num_poses:
        return None
    first = state.cycle - window.num_poses + 1
    rows = (~log.explained & (log.track >= 0) & (log.cycle >= first)).nonzero()[0]
    before = log.cycle[(log.cycle >= first) & (log.cycle < state.cycle)]
    rows = rows[np.bincount(log.track[rows])[log.track[rows]] >= enough_measured(before)]
    if not len(rows) or not (window.step > 0.0).all():
        return None
    rows = rows[np.argsort(log.track[rows], kind="stable")]
    which = np.cumsum(np.diff(log.track[rows], prepend=log.track[rows[0]]) != 0)
    ends = log.both_ends(rows, which, state.scene.radio.array.spacing)
    apart = state.scene.body.tx_offset - state.scene.body.rx_offset
    found = _histories(state, with_reciprocal(log, ends, apart), first)
    return _factor(found, _shares(found, state), state)


def _histories(state: WindowState, ends: PathDirections, start: int) -> _Histories:
    """Histories of the tracks whose rates are asked, from the window's first cycle `start` on."""
    window, log, body = state.window, state.log, state.scene.body
    rows, which, slot = ends.row, ends.which, log.cycle[ends.row] - start
    place, clock = window_gaussian.poses(window)[:, :3], np.concatenate([[0.0], np.cumsum(window.step)])
    first = np.searchsorted(which, np.arange(which[-1] + 1))
    spans = np.stack([slot[first], slot[np.append(first[1:], len(slot)) - 1]], axis=1)

    def total(value: Floats) -> Floats:
        return np.asarray(np.bincount(which, value), dtype=np.float64)

    weight, time = log.std[rows, 0] ** -2.0, clock[slot]
    mass = total(weight)
    toward, doubt = _directions(state.heading, ends, slot, time)
    time = time - (total(weight * time) / mass)[which]
    moved, joined = np.diff(place[slot], axis=0), np.diff(which) == 0
    follow = np.append(0.0, np.cumsum(np.where(joined, np.vecdot(0.5 * (toward[1:] + toward[:-1]), moved), 0.0)))
    way = np.append(0.0, np.cumsum(np.where(joined, np.linalg.norm(moved, axis=1), 0.0)))
    span = clock[spans[:, 1]] - clock[spans[:, 0]]
    last = np.append(first[1:], len(slot)) - 1
    speed = (way[last] - way[first]) / span
    baseline = float(np.linalg.norm(body.tx_offset - body.rx_offset))
    turned = np.append(0.0, np.cumsum(np.abs(np.diff(state.heading))))
    turning = baseline * (turned[spans[:, 1]] - turned[spans[:, 0]]) / span
    length = log.seen[rows, 0]
    # seen from the two ends a point, or a wall's normal, lies in directions so much apart
    apart = 2.0 * baseline * mass / np.maximum(total(weight * length), 1e-9)
    own = (apart**2 + doubt) * speed**2 + turning**2 + STILL**2
    weight = weight / (1.0 + CONSTANTS.memory * (shown_scatter(which, time, length, weight) - 1.0))[which]
    return _Histories(
        which, slot, time, length, weight, toward, length - (follow - follow[first][which]), spans, span, speed, own,
        ends.owner,
    )  # fmt: skip


def _directions(heading: Floats, ends: PathDirections, slot: Integers, clock: Floats) -> tuple[Floats, Floats]:
    """Derivatives (N, 3) of tracks' lengths by the position, for their rates, in the room's axes: the directions from
    which each path comes and into which it leaves, times -1, smoothed by lines over the times `clock` (N,) [s] for each
    track; and the variance (T,) of their error along a way of one metre."""
    which, seen, angle = ends.which, ends.cosines, heading[slot]
    cos, sin = np.cos(angle), np.sin(angle)
    flat = np.stack([cos * seen[:, 0] - sin * seen[:, 1], sin * seen[:, 0] + cos * seen[:, 1]], axis=1)
    weight = ends.std.mean(axis=1) ** -2.0
    middle = np.bincount(which, weight * clock) / np.bincount(which, weight)
    time = clock - middle[which]
    s, sxx = (np.bincount(which, weight * time**power) for power in (0, 2))
    mean = np.stack([np.bincount(which, weight * side) for side in flat.T]) / s
    rate = np.stack([np.bincount(which, weight * time * side) for side in flat.T]) / sxx
    toward = np.zeros((len(which), 3))
    for leg in ends.legs[which].T:
        smooth = mean[:, leg].T + rate[:, leg].T * (clock - middle[leg])[:, None]
        smooth /= np.maximum(np.linalg.norm(smooth, axis=1, keepdims=True), 1.0)
        up = np.sqrt(np.maximum(1.0 - np.vecdot(smooth, smooth), 0.0))
        toward -= np.concatenate([smooth, up[:, None]], axis=1)
    return toward, spread_by_legs(1.0 / s, ends.legs)


def _shares(found: _Histories, state: WindowState) -> Floats:
    """Probability (T,) that each track's rate tells of the agent's way, as for half of all; of the others a quarter
    keep their length, as over opposite walls, and the rest have any rate that the agent's speed allows."""
    (rate, whole), spread = found.slopes(found.left, found.length)
    mean = np.stack(found.means(*found.toward.T), axis=1)
    doubt = np.vecdot(mean**2, way_variance(state.window, *found.ends.T)) / found.span**2
    half = 1.0 / np.bincount(found.owner)[found.owner]
    along = 0.5 * half * _normal(rate, spread + found.own_variance + doubt)
    kept = 0.5 / 4.0 * _normal(whole, spread)
    either = np.bincount(found.owner, along)[found.owner]
    return along / (either + kept + 0.5 * 3.0 / 4.0 / (4.0 * found.speed + 2.0 * np.sqrt(doubt)))


def _factor(found: _Histories, share: Floats, state: WindowState) -> RateFactor:
    """Rates of tracks as a quadratic cost on the window's positions, by tracks that follow them with probabilities
    `share` (T,)."""
    (middle,), count, many = found.means(found.left), len(found.span), state.window.num_poses
    left = found.left - middle[found.which]
    (rate,), spread = found.slopes(left)
    trust = (CONSTANTS.tail + 1.0) / (CONSTANTS.tail + found.weight * (left - rate[found.which] * found.time) ** 2)
    weight = share[found.which] * found.weight * trust
    own = _own_numbers(found, weight)
    taken = np.stack([found.total(weight * side * left) for side in own.T], axis=1)
    pull, heavy = weight * (left - np.vecdot(own, taken[found.which])), weight[:, None] * found.toward
    single, common, gradient = (np.zeros((many, 3, *rest)) for rest in ((3,), (count, 2), ()))
    np.add.at(single, found.slot, heavy[:, :, None] * found.toward[:, None])
    common[found.slot, :, found.which] = heavy[:, :, None] * own[:, None]  # one component of a track in a cycle
    np.add.at(gradient, found.slot, -pull[:, None] * found.toward)
    return RateFactor(
        single, common.reshape(many, 3, 2 * count), gradient, window_gaussian.floor_poses(state.window)[:, :3],
        *_first_step(found, share, rate, spread, float(state.window.step[0])),
    )  # fmt: skip


def _own_numbers(found: _Histories, weight: Floats) -> Floats:
    """Derivatives (N, 2) of the components' lengths by the two unknowns of their track, a constant and a rate, as
    numbers of unit information under weights (N,) and what is known beforehand: to be eliminated."""
    s, sx, sxx = (found.total(weight * found.time**power) for power in range(3))
    s, sxx = s + FAR**-2.0, sxx + 1.0 / found.own_variance
    constant, rate, lean = np.sqrt(sxx / (s * sxx - sx**2)), 1.0 / np.sqrt(sxx), sx / sxx
    which, time = found.which, found.time
    return np.stack([constant[which] * (1.0 - lean[which] * time), rate[which] * time], axis=1)


def _first_step(found: _Histories, share: Floats, rate: Floats, spread: Floats, step: float) -> tuple[Floats, Floats]:
    """Hessian (3, 3) and gradient (3,) by the displacement over the window's first step of `step` [s], from the line
    fits (T,) of the tracks that begin there: an equal part of what they tell of the whole way."""
    old = found.ends[:, 0] == 0
    toward = found.toward[np.searchsorted(found.which, np.arange(len(old)))][old]
    precision = (share / ((spread + found.own_variance) * found.span * step))[old]
    return np.einsum("t,ti,tj->ij", precision, toward, toward), -(precision * rate[old] * step) @ toward


def _normal(off: Floats, variance: Floats) -> Floats:
    """Densities (T,) of centred normals, for the tracks' rates."""
    return np.asarray(np.exp(-0.5 * off**2 / variance) / np.sqrt(2.0 * np.pi * variance))
