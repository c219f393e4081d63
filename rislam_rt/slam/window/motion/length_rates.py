"""Rates at which path lengths change, of tracks and of explained paths, by line fits to what the estimated positions
leave of them: what `egomotion` asks for a motion that many agree on."""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.reciprocal_paths import spread_by_legs, with_reciprocal

MEASURED = 6
"""Measurements of a track from which on it has a rate of length: as many as births ask for..."""
EARLY = 4
"""...and of one of the first tracks, while there are no longer ones: the fewest that scatter about a quadratic."""


class _PlainRates(NamedTuple):
    """Rates of the path lengths of T tracks or explained paths, E in all."""

    toward: Floats
    """(E, 3) sum of the directions of arrival and departure in the room's axes, times -1: the rate is its product with
    the velocity."""
    rate: Floats
    """(E,) [m/s] rate at which the path length changes."""
    variance: Floats
    """(E,) [m^2/s^2] of the rate."""
    blur: Floats
    """(E,) error of the rate by the baseline between Tx and Rx and by the direction's, as a share of the speed."""
    whole: Floats
    """(E,) rate of the measured length itself; `rate` may be that of what the positions leave of it."""
    turning: float = 0.0
    """[m/s] speed of Tx and Rx against each other, as the body turns."""
    bend: Floats | None = None
    """(E,) [m/s^2] at which the rates change."""
    bend_variance: Floats | None = None
    """(E,) [m^2/s^4] of that change, with what it is for a point that an agent passes at constant speed."""
    owner: Integers | None = None
    """(E,) track or path of each direction; None where each has one."""
    believed: Floats | None = None
    """(3,) motion of the agent beside the one that is asked for; None where what is no path of a thing at rest may have
    any rate."""
    astray: Floats | float = CONSTANTS.rare
    """(E,) probability of a rate that no thing at rest gives: the track changed paths, or something moves by itself."""
    name: Integers | None = None
    """(E, 6) what names the track or path for life."""
    known: "Kinds | None" = None
    """What each path is held for by what it did before; None where nothing is known of that."""


class Kinds(NamedTuple):
    """Probabilities of what T tracks or explained paths are, by how their lengths change as the agent moves."""

    follows: Floats
    """(E,) it nears and recedes with the agent, from this direction."""
    keeps: Floats
    """(T,) it keeps its length, as over opposite walls."""
    other: Floats
    """(T,) it does neither."""


class Rates(_PlainRates):
    """Rates at which the lengths of T tracks or explained paths change, with their directions of arrival: E in all, as
    an array hears some alike from two."""

    @cached_property
    def number(self) -> int:
        """Number T of the tracks and paths whose lengths have a rate."""
        return len(self.rate) if self.owner is None else int(self.owner.max(initial=-1)) + 1

    def each(self, value: Floats) -> Floats:
        """Values (..., E) by track or path: of those (..., T) given."""
        return value if self.owner is None else value[..., self.owner]

    def mixed(self, value: Floats) -> Floats:
        """Sums (..., T) of values (..., E) over the directions that a track or path may have."""
        return value if self.owner is None else np.asarray(value @ self._belongs)

    @cached_property
    def _belongs(self) -> Floats:
        """(E, T) 1 where a direction is one of the track or path."""
        assert self.owner is not None
        return (self.owner[:, None] == np.arange(self.number)).astype(np.float64)

    @cached_property
    def share(self) -> Floats:
        """(E,) probability of each direction beforehand: a half where there are two."""
        return np.ones(len(self.rate)) if self.owner is None else 1.0 / np.bincount(self.owner)[self.owner]

    @cached_property
    def kinds(self) -> Kinds:
        """What each path is held for: half of all follow the agent; of the others a quarter keep their length."""
        every = np.ones(self.number)
        return self.known or Kinds(0.5 * self.share, 0.125 * every, 0.375 * every)

    @cached_property
    def lean(self) -> Floats:
        """(E,) error of the rate by that of the direction's elevation, as a share of the vertical speed: what errs in
        the cosines by `blur` errs in the elevation's sine by the more, the lower it is."""
        up = np.maximum(0.25 * self.toward[:, 2] ** 2, np.maximum(0.5 * self.blur, 1e-12))
        return self.blur * np.sqrt(np.maximum(1.0 - up, 0.0) / up)

    @cached_property
    def kept(self) -> Floats:
        """(E,) densities of the rates were they of lengths that stay as they are."""
        return np.exp(-0.5 * self.whole**2 / self.variance) / np.sqrt(2.0 * np.pi * self.variance)

    @cached_property
    def mixed_kept(self) -> Floats:
        """(T,) these densities by track or path, over its directions."""
        return self.mixed(self.share * self.kept)


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
    apart: Floats
    """(3,) [m] from Rx to Tx, in the body's axes."""
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
    """(N,) [m] ...and what the positions leave of it."""
    toward: Floats
    """(E, 3) as in `Rates`."""
    inside: Booleans
    """(E,) whether the directions of arrival and departure lie within the unit disc, its rim included."""
    number: Integers
    """(E,) number of components."""
    blur: Floats
    """(E,) as in `Rates`."""
    owner: Integers | None
    """(E,) track or path of each direction; None where each has one."""
    enough: int
    """Number of components from which on a line is fitted."""
    name: Integers
    """(E, 6) as in `Rates`."""

    def total(self, value: Floats) -> Floats:
        """Sums (E,) over each history of lengths of values (N,)."""
        return np.asarray(np.bincount(self.which, value, len(self.number)), dtype=np.float64)


def enough_measured(cycle: Integers) -> int:
    """Measurements of a track from which on it has a rate of length, where components (N,) were measured in these
    cycles, in the order of time."""
    return min(MEASURED, max(EARLY, int(np.count_nonzero(cycle[1:] != cycle[:-1])) + 1))


def lengths(heard: Heard) -> Lengths:
    """Lengths of tracks and explained paths, with what the positions leave of them, so that a turn or an acceleration
    bends none."""
    log, heading, place, step, apart, spacing = heard
    baseline = float(np.linalg.norm(apart))
    last = int(log.cycle.max(initial=0))
    first = last - len(heading) + 1
    rows, which, names = log.histories(first)
    ends = log.both_ends(rows, which, spacing)
    rows, which, flat, spread_of, owner, legs = with_reciprocal(log, ends, apart)
    count = np.bincount(which)

    def total(value: Floats) -> Floats:
        return np.asarray(np.bincount(which, value), dtype=np.float64)

    weight, length, since = 1.0 / log.std[rows, 0] ** 2, log.seen[rows, 0], log.cycle[rows] - first
    angle = heading[since]
    cos, sin = np.cos(angle), np.sin(angle)
    sure = 1.0 / (spread_of**2).mean(axis=1)
    seen = np.stack([cos * flat[:, 0] - sin * flat[:, 1], sin * flat[:, 0] + cos * flat[:, 1]], axis=1)
    toward = np.stack([total(sure * seen[:, 0]), total(sure * seen[:, 1])], axis=1) / total(sure)[:, None]
    # directions that scatter by more than they deviate by are as much less sure of their mean (Birge's ratio)
    scatter = 0.5 * total(sure * ((seen - toward[which]) ** 2).sum(axis=1)) / np.maximum(count - 1, 1)
    doubt = np.maximum(scatter, 1.0) / total(sure)
    rim = 1.0 - np.sum(toward**2, axis=1)
    up = np.sqrt(np.maximum(rim, 0.0))
    toward = -np.concatenate([toward, up[:, None]], axis=1)[legs].sum(axis=1)
    # seen from the two ends a point, or a wall's normal, lies in directions so much apart
    blur = 2.0 * baseline * total(weight) / np.maximum(total(weight * length), 1e-9)
    return Lengths(
        heard, which, np.asarray((log.cycle[rows] - last) * step), weight, length,
        length - np.vecdot(toward[which], place[since] - place[-1]), toward, (rim > -1e-9)[legs].all(axis=1), count,
        np.hypot(blur, np.sqrt(spread_by_legs(doubt, legs))), owner if (np.diff(owner) < 1).any() else None,
        enough_measured(log.cycle[log.cycle >= first]), names[owner],
    )  # fmt: skip


def rates(found: Lengths, scattered: bool = False) -> Rates:
    """Rates at which the lengths of tracks and explained paths change, by weighted line fits over time to what the
    positions leave of the lengths' change.

    Each path scatters by no more than fits (`crowd`), or, if `scattered`, by what it shows about a smooth way or about
    the positions', where that is more: one that hops to and fro within its cell has next to no rate.
    """
    place, time = found.heard.place, found.heard.step * max(len(found.heard.place) - 1, 1)
    velocity = (place[-1] - place[0]) / time
    (rate,), variance, fine = _slopes(found, found.time, found.left)
    if scattered:
        (long,) = (found.number >= found.enough).nonzero()
        rows = np.isin(found.which, long).nonzero()[0]
        rows = rows[np.lexsort((found.time[rows], found.which[rows]))]
        which = np.searchsorted(long, found.which[rows])
        ways = (
            shown_scatter(which, found.time[rows], way[rows], found.weight[rows]) for way in (found.length, found.left)
        )
        variance[long] *= np.maximum(np.minimum(*ways) / CONSTANTS.crowd, 1.0)
    rate = rate + found.toward @ velocity
    bends = _bends(found, float(velocity @ velocity))
    return _rates(found, fine, (rate, variance, rate), time, np.zeros(3), bends)


def shown_scatter(which: Integers, time: Floats, length: Floats, weight: Floats) -> Floats:
    """Mean square (T,) to expect of the errors of tracks' lengths (N,), in reported deviations, from what they show
    about a quadratic in time, for their rates; what is expected of any return beforehand counts as `memory`
    components."""
    count = np.bincount(which)
    rows = np.stack([np.ones(len(time)), time, time**2], axis=1)
    first = np.searchsorted(which, np.arange(len(count)))
    start, heavy = length - length[first][which], weight[:, None] * rows
    normal = np.add.reduceat(heavy[:, :, None] * rows[:, None], first) + 1e-9 * np.eye(3)
    best = np.linalg.solve(normal, np.add.reduceat(heavy * start[:, None], first)[..., None])[..., 0]
    square = np.bincount(which, weight * (start - np.vecdot(rows, best[which])) ** 2)
    free = count - 3.0
    shown = np.maximum(square / free, 1.0)
    return np.asarray((CONSTANTS.memory * CONSTANTS.crowd + free * shown) / (CONSTANTS.memory + free))


def accelerations(found: Lengths, steps: int) -> Rates:
    """Rates [m/s^2] at which the lengths of tracks and explained paths change with the way of a constant acceleration
    over the last `steps`, by weighted line fits to what the positions leave of the lengths' change: 0 for a path that
    follows the positions as they are."""
    place, step = found.heard.place, found.heard.step
    by = 0.5 * np.maximum(found.time + steps * step, 0.0) ** 2
    (rate, whole), variance, fine = _slopes(found, by, found.left, found.length)
    way = 0.5 * (step * np.maximum(np.arange(steps + 1 - len(place), steps + 1), 0.0)) ** 2
    way -= way.mean()
    believed = way @ place / (way @ way)
    astray = CONSTANTS.rare * (_changed_paths(found, by, rate, variance) + CONSTANTS.rare)
    return _rates(found, fine, (rate, variance, whole), 0.5 * (steps * step) ** 2, believed)._replace(
        astray=astray[fine]
    )


def _changed_paths(found: Lengths, x: Floats, slope: Floats, variance: Floats) -> Floats:
    """Likelihoods (E,) of what lengths leave beside their line fits over `x` (N,), of slopes (E,) within variances, if
    tracks changed paths in between, against if they did not.

    Of a step between two components a line leaves at least so much of what it explains as it does of the step that it
    fits best; each path scatters by no more than fits (`crowd`).
    """
    total, weight = found.total, found.weight
    s = total(weight)
    off = found.left - slope[found.which] * x
    beside = total(weight * (off - (total(weight * off) / s)[found.which]) ** 2)
    explained = CONSTANTS.crowd * slope**2 / variance
    best = np.clip(_best_step(found, x), 1e-9, 1.0)
    return np.exp(-0.5 * np.maximum(explained * (1.0 - best) / best - beside, 0.0) / CONSTANTS.crowd)


def _best_step(found: Lengths, x: Floats) -> Floats:
    """Largest share (E,) of the square of a step of lengths between two components that a line over `x` (N,) explains,
    wherever the step is."""
    order = np.lexsort((found.time, found.which))
    which, weight, x = found.which[order], found.weight[order], x[order]
    s, sx, sxx = (np.bincount(which, weight * x**power, len(found.number)) for power in range(3))
    before, way = np.cumsum(weight), np.cumsum(weight * x)
    start = np.append(0, np.cumsum(found.number)[:-1])[which]
    before, way = (value - np.append(0.0, value)[start] for value in (before, way))
    s, sx, sxx = s[which], sx[which], sxx[which]
    parted, spread = before * (s - before), s * sxx - sx**2
    fine = (parted > 1e-9 * s**2) & (spread > 0.0)
    share = np.where(fine, (way * s - before * sx) ** 2 / np.where(fine, parted * spread, 1.0), 0.0)
    best = np.zeros(len(found.number))
    np.maximum.at(best, which, share)
    return best


def _slopes(found: Lengths, x: Floats, *values: Floats) -> tuple[list[Floats], Floats, Booleans]:
    """Slopes (E,) of weighted line fits over `x` (N,) to each of some values (N,), their variance (E,), and whether
    there are enough components (E,) for a fit, which come from within the unit disc."""
    total, weighted = found.total, found.weight * x
    s, sx, sxx = total(found.weight), total(weighted), total(found.weight * x**2)
    spread = s * sxx - sx**2
    enough = (found.number >= found.enough) & (spread > 1e-9 * s * s * found.heard.step**2)
    enough &= found.inside
    spread = np.where(enough, spread, 1.0)
    slopes = [(s * total(weighted * value) - sx * total(found.weight * value)) / spread for value in values]
    return slopes, CONSTANTS.crowd * s / spread, enough


def _rates(
    found: Lengths, fine: Booleans, fits: tuple[Floats, Floats, Floats], unit: float, believed: Floats,
    bends: tuple[Floats, Floats] | None = None,
) -> Rates:  # fmt: skip
    """Rates of those lengths (E,) that are `fine`, from `fits`: their rates, the variances, and the rates of measured
    lengths, over a `unit` [s or s^2]."""
    toward, heard = found.toward, found.heard
    rate, variance, whole = (each[fine] for each in fits)
    bend, bend_variance = (each[fine] for each in bends) if bends else (None, None)
    turning = float(np.linalg.norm(heard.apart)) * float(np.abs(np.diff(heard.heading)).sum()) / unit
    owner = None if found.owner is None else np.unique(found.owner[fine], return_inverse=True)[1]
    return Rates(
        toward[fine], rate, variance, found.blur[fine], whole, turning, bend, bend_variance, owner, believed,
        name=found.name[fine],
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
