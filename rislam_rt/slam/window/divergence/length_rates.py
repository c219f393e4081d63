"""Rates at which path lengths change, of tracks and of explained paths, by line fits to what the estimated positions
leave of them: what `egomotion` asks for a motion that many agree on."""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.measurement_log import Log, unique_forms

MEASURED = 6
"""Measurements of a track from which on it has a rate of length: as many as births ask for."""


class _PlainRates(NamedTuple):
    """Rates of the path lengths of T tracks or explained paths, E in all: of each were it over a wall, by a point, and
    over two walls at right angles, with an upright edge and with a level one."""

    toward: Floats
    """(E, 3) derivative of the length by the position: the rate is its product with the velocity."""
    rate: Floats
    """(E,) [m/s] rate at which the path length changes."""
    variance: Floats
    """(E,) [m^2/s^2] of the rate."""
    blur: Floats
    """(E,) error of the rate by the direction's, as a share of the speed, and to second order by the baseline."""
    whole: Floats
    """(E,) rate of the measured length itself; `rate` may be that of what the positions leave of it."""
    share: Floats
    """(E,) probability beforehand of each of the ways in which a track or path may come."""
    owner: Integers
    """(E,) track or path of each way."""
    turning: Floats
    """(E,) [m/s] speed of Tx and Rx against each other, as the body turns; 0 where it changes no length."""
    tried: int
    """Number of the ways, the first of them, of which two give a first guess of the motion."""
    bend: Floats | None = None
    """(E,) [m/s^2] at which the rates change."""
    bend_variance: Floats | None = None
    """(E,) [m^2/s^4] of that change, with what it is for a point that an agent passes at constant speed."""
    believed: Floats | None = None
    """(3,) motion of the agent beside the one that is asked for; None where what is no path of a thing at
    rest may have any rate."""


class Rates(_PlainRates):
    """Rates at which the lengths of T tracks or explained paths change, by the E ways in which they may come."""

    @cached_property
    def number(self) -> int:
        """Number T of the tracks and paths whose lengths have a rate."""
        return int(self.owner.max(initial=-1)) + 1

    def each(self, value: Floats) -> Floats:
        """Values (..., E) by track or path: of those (..., T) given."""
        return np.asarray(value[..., self.owner])

    def mixed(self, value: Floats) -> Floats:
        """Sums (..., T) of values (..., E) over the ways in which a track or path may come."""
        return np.asarray(value @ self._mixing)

    @cached_property
    def _mixing(self) -> Floats:
        """(E, T) 1 where a way is of a track or path."""
        return np.asarray(self.owner[:, None] == np.arange(self.number), dtype=np.float64)

    @cached_property
    def kept(self) -> Floats:
        """(E,) densities of the rates were they of lengths that stay as they are."""
        return np.exp(-0.5 * self.whole**2 / self.variance) / np.sqrt(2.0 * np.pi * self.variance)


def lone_rates(toward: Floats, rate: Floats, variance: Floats) -> Rates:
    """Rates (T,) with variances (T,) of paths that come in one way each, along `toward` (T, 3)."""
    count = len(rate)
    return Rates(
        toward, rate, variance, np.zeros(count), rate, np.ones(count), np.arange(count), np.zeros(count), count
    )  # fmt: skip


class Heard(NamedTuple):
    """What rates of path lengths are fitted to: the log's components in the cycles of K poses."""

    log: Log
    """All components that were measured; the last cycle's are those of the last pose."""
    heading: Floats
    """(K,) [rad] the agent's headings."""
    place: Floats
    """(K, 3) [m] its estimated positions."""
    step: float
    """[s] from pose to pose."""
    baseline: Floats
    """(2,) [m] from Tx to Rx, in the body's axes."""
    spacing: float
    """[wavelengths] of the antennas."""


class Lengths(NamedTuple):
    """Lengths of tracks and explained paths to which lines are fitted, E of them as in `Rates`, by N components."""

    heard: Heard
    """What they are taken from."""
    which: Integers
    """(N,) the direction of a track or path that each component is of."""
    time: Floats
    """(N,) [s] until the last pose, negative."""
    weight: Floats
    """(N,) [1/m^2] one over the variances of the lengths."""
    length: Floats
    """(N,) [m] measured..."""
    left: Floats
    """(4, N) [m] ...and what the positions leave of it, were it over a wall, by a point, or over two walls at right
    angles with an upright or a level edge."""
    toward: Floats
    """(4, E, 3) derivative of the length by the position, likewise."""
    number: Integers
    """(E,) number of components."""
    blur: Floats
    """(E,) as in `Rates`."""
    owner: Integers
    """(E,) track or path of each direction."""
    share: Floats
    """(T, 4) probability that each track or path is of these kinds, if it follows the positions."""

    def total(self, value: Floats) -> Floats:
        """Sums (E,) over each history of lengths of values (N,)."""
        return np.asarray(np.bincount(self.which, value, len(self.number)), dtype=np.float64)


def lengths(heard: Heard) -> Lengths:
    """Lengths of tracks and explained paths, with what the positions leave of them, so that a turn or an acceleration
    bends none."""
    log, heading, place, step, baseline, spacing = heard
    last = int(log.cycle.max(initial=0))
    first, known = last - len(heading) + 1, log.explained
    rows = ((known | (log.track >= 0)) & (log.cycle >= first)).nonzero()[0]
    forms = np.where(known[rows, None], log.form[rows, 0], UNKNOWN)
    every = np.concatenate([forms, np.where(known[rows], -1, log.track[rows])[:, None]], axis=1)
    forms, which = unique_forms(every)
    share = _kinds(forms)
    rows, which, flat, spread_of, owner = log.both_ends(rows, which, spacing)
    count = np.bincount(which)

    def total(value: Floats) -> Floats:
        return np.asarray(np.bincount(which, value), dtype=np.float64)

    weight, length, since = 1.0 / log.std[rows, 0] ** 2, log.seen[rows, 0], log.cycle[rows] - first
    angle = heading[since]
    cos, sin = np.cos(angle), np.sin(angle)
    toward = np.stack([total(cos * flat[:, 0] - sin * flat[:, 1]), total(sin * flat[:, 0] + cos * flat[:, 1])], axis=1)
    toward /= count[:, None]
    up = np.sqrt(np.maximum(1.0 - np.sum(toward**2, axis=1), 0.0))
    toward = np.concatenate([toward, up[:, None]], axis=1)
    # a wall's image is seen along its normal from the Tx, whose way to it the wall halves
    mass = total(weight)
    far = np.maximum(total(weight * length) / mass, 1e-3)
    across = total(cos * baseline[0] - sin * baseline[1]), total(sin * baseline[0] + cos * baseline[1])
    ray, apart = toward, np.stack([*across, np.zeros(len(far))], axis=1) / (count * far)[:, None]
    normal = (ray + apart) / np.linalg.norm(ray + apart, axis=1)[:, None]
    wall = -2.0 * np.vecdot(ray, normal)[:, None] * normal
    moved = place[since] - (np.stack([total(weight * each) for each in place[since].T]) / mass).T[which]
    follow = np.vecdot(wall[which], moved)
    # two walls turn round by half a turn about their edge, upright or level, along which nothing moves
    flat_ray, edge = ray * [1.0, 1.0, 0.0], np.stack([-ray[:, 1], ray[:, 0], np.zeros(len(ray))], axis=1)
    edge /= np.maximum(np.linalg.norm(edge, axis=1), 1e-9)[:, None]
    beside = moved - np.vecdot(moved, edge[which])[:, None] * edge[which]
    turned = ((normal, moved), (ray, moved * [1.0, 1.0, 0.0]), (ray, beside))
    bend = [2.0 * np.linalg.norm(0.5 * far[which, None] * each[which] - by, axis=1) for each, by in turned]
    doubt = total((spread_of**2).mean(axis=1)) / count**2
    return Lengths(
        heard, which, np.asarray((log.cycle[rows] - last) * step), weight, length,
        length - np.stack([follow, *bend]), np.stack([wall, wall, -2.0 * flat_ray, -2.0 * ray]), count,
        np.hypot(2.0 * np.sqrt(doubt), np.vecdot(apart, apart)), owner, share,
    )  # fmt: skip


def _kinds(forms: Integers) -> Floats:
    """Probabilities (T, 4) that paths of forms (T, 6) are over a wall, by a point, or over two walls at right angles
    with either edge, if they are any of these: as many are over two walls as are not, unless the map explains them."""
    walls, found = (forms[:, 1:5] >= 0).sum(axis=1), np.full((len(forms), 4), 0.25)
    of_walls, of_point = forms[:, 0] == TX, forms[:, 0] >= 0
    found[of_walls & (walls == 1)], found[of_point & (walls == 0)] = np.eye(4)[:2]
    found[of_walls & (walls == 2)] = [0.0, 0.0, 0.5, 0.5]
    return found


def rates(found: Lengths) -> Rates:
    """Rates at which the lengths of tracks and explained paths change, by weighted line fits over time to what the
    positions leave of the lengths' change."""
    place, time = found.heard.place, found.heard.step * max(len(found.heard.place) - 1, 1)
    velocity = (place[-1] - place[0]) / time
    every, variance, fine = _slopes(found, found.time, *found.left)
    rate = np.stack(every) + found.toward @ velocity
    bends = _bends(found, float(velocity @ velocity))
    return _rates(found, fine, (rate, variance, rate[0]), time, np.zeros(3), bends)


def accelerations(found: Lengths, steps: int) -> Rates:
    """Rates [m/s^2] at which the lengths of tracks and explained paths change with the way of a constant acceleration
    over the last `steps`, by weighted line fits to what the positions leave of the lengths' change: 0 for a path that
    follows the positions as they are."""
    place, step = found.heard.place, found.heard.step
    by = 0.5 * np.maximum(found.time + steps * step, 0.0) ** 2
    (*rate, whole), variance, fine = _slopes(found, by, *found.left, found.length)
    way = 0.5 * (step * np.maximum(np.arange(steps + 1 - len(place), steps + 1), 0.0)) ** 2
    way -= way.mean()
    believed = way @ place / (way @ way)
    return _rates(found, fine, (np.stack(rate), variance, whole), 0.5 * (steps * step) ** 2, believed)


def _slopes(found: Lengths, x: Floats, *values: Floats) -> tuple[list[Floats], Floats, Booleans]:
    """Slopes (E,) of weighted line fits over `x` (N,) to each of some values (N,), their variance (E,), and whether
    there are enough components (E,) for a fit."""
    total, weighted = found.total, found.weight * x
    s, sx, sxx = total(found.weight), total(weighted), total(found.weight * x**2)
    spread = s * sxx - sx**2
    enough = (found.number >= MEASURED) & (spread > 1e-9 * s * s * found.heard.step**2)
    spread = np.where(enough, spread, 1.0)
    slopes = [(s * total(weighted * value) - sx * total(found.weight * value)) / spread for value in values]
    return slopes, CONSTANTS.crowd * s / spread, enough


def _rates(
    found: Lengths, fine: Booleans, fits: tuple[Floats, Floats, Floats], unit: float, believed: Floats,
    bends: tuple[Floats, Floats] | None = None,
) -> Rates:  # fmt: skip
    """Rates of those lengths (E,) that are `fine`, from `fits`: their rates (4, E), the variances, and the rates of
    measured lengths, over a `unit` [s or s^2]."""
    heard, ray = found.heard, found.toward[-1]
    fine = fine & (np.vecdot(ray[:, :2], ray[:, :2]) <= 4.0 + 1e-9)  # at the rim, but for rounding
    turning = float(np.hypot(*heard.baseline) * np.abs(np.diff(heard.heading)).sum()) / unit
    paths, owner = np.unique(found.owner[fine], return_inverse=True)
    share = (found.share[paths][owner] / np.bincount(owner)[owner, None]).T.ravel()
    rate, variance, whole = fits
    variance, blur, whole = (np.tile(each[fine], 4) for each in (variance, found.blur, whole))
    bend, bend_variance = (np.tile(each[fine], 4) for each in bends) if bends else (None, None)
    return Rates(
        found.toward[:, fine].reshape(-1, 3), rate[:, fine].ravel(), variance, blur, whole, share, np.tile(owner, 4),
        np.repeat([0.0, 0.0, turning, turning], len(owner)), len(owner), bend, bend_variance, believed,
    )  # fmt: skip


def _bends(found: Lengths, square_speed: float) -> tuple[Floats, Floats]:
    """Quadratic parts (E,) [m/s^2] of lengths over time, beside their lines, and the variances of these, for an agent
    of squared speed `square_speed` [m^2/s^2] which passes points."""
    which, x = found.which, found.time

    def total(value: Floats | float) -> Floats:
        return found.total(found.weight * value)

    s = total(1.0)
    u = x - (total(x) / s)[which]
    line = total(u**3) / np.maximum(total(u**2), 1e-300)
    u2 = u**2 - (total(u**2) / s)[which] - line[which] * u
    square = np.maximum(total(u2**2), 1e-300)
    passing = square_speed * s / np.maximum(total(found.length), 1e-9)
    return 2.0 * total(u2 * found.length) / square, 4.0 * CONSTANTS.crowd / square + (4.0 * passing) ** 2
