"""Egomotion: check of the told velocity and compass against the rates at which the path lengths of the first tracks
change.

Whatever throws it, a wall, a point, or two walls at right angles, a return grows shorter by twice the way that the
agent goes towards it: `rate = -2 u . v`, with `u` the direction of arrival. What goes to and fro between opposite walls
keeps its length, from both sides alike; what comes over a wall on one leg alone does neither. So a velocity is wanted
that many tracks agree on, each of them with a probability of its own of being none of these. The told velocity is one
such, with its own deviation and what manoeuvres since may have made of it; if it was told wrong, any other within
walking speed is as good. Laplace evidences of both decide.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.measurement_log import Log, unique_forms

MEASURED = 6
"""Measurements of a track from which on it has a rate of length: as many as births ask for."""
FEWEST = 3
"""Tracks with a rate of length from which on the motion is checked, and pairs of a return and a component from which on
a jump or a turn is: two agree on any horizontal motion."""


class _PlainRates(NamedTuple):
    """Rates of the path lengths of T tracks or explained paths, E in all."""

    toward: Floats
    """(E, 3) direction of arrival in the room's axes, times -2: the rate is its product with the velocity."""
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
    """(2,) horizontal motion of the agent beside the one that is asked for; None where what is no path of a thing at
    rest may have any rate."""


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
        return value if self.owner is None else np.asarray(value @ (self.owner[:, None] == np.arange(self.number)))

    @cached_property
    def share(self) -> Floats:
        """(E,) probability of each direction beforehand: a half where there are two."""
        return np.ones(len(self.rate)) if self.owner is None else 1.0 / np.bincount(self.owner)[self.owner]

    @cached_property
    def kept(self) -> Floats:
        """(E,) densities of the rates were they of lengths that stay as they are."""
        return np.exp(-0.5 * self.whole**2 / self.variance) / np.sqrt(2.0 * np.pi * self.variance)


class Manoeuvres(NamedTuple):
    """Accelerations since a velocity was told, constant and as likely as motion modes are, of which there are M."""

    share: Floats
    """(M,) probabilities of the modes."""
    std: Floats
    """(M,) [m/s^2] standard deviations of each component of the acceleration."""
    time: float
    """[s] since the velocity was told, over which the rates are means."""


class StartCheck(NamedTuple):
    """Result of checking the told start against tracks: the odds that it is wrong, and the velocity and turn that they
    agree on."""

    log_odds: float
    """Log odds that the start was told wrong."""
    is_compass: bool
    """Whether it is the compass that is wrong, rather than the speed."""
    velocity: Floats
    """(3,) [m/s] velocity that the tracks agree on, in the axes that the compass shows."""
    std: float
    """[m/s] standard deviation of that velocity; where the compass is wrong, with the told one's included."""
    turn: float
    """[rad] by which the compass shows too little, if it is that which is wrong."""


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
    baseline: float
    """[m] from Tx to Rx."""
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
    """(E, 3) direction of arrival in the room's axes, times -2."""
    count: Integers
    """(E,) number of components."""
    blur: Floats
    """(E,) as in `Rates`."""
    owner: Integers
    """(E,) track or path of each direction."""

    def total(self, value: Floats) -> Floats:
        """Sums (E,) over each history of lengths of values (N,)."""
        return np.asarray(np.bincount(self.which, value, len(self.owner)), dtype=np.float64)


def lengths(heard: Heard) -> Lengths:
    """Lengths of tracks and explained paths, with what the positions leave of them, so that a turn or an acceleration
    bends none."""
    log, heading, place, step, baseline, spacing = heard
    last = int(log.cycle.max(initial=0))
    first, known = last - len(heading) + 1, log.explained
    rows = ((known | (log.track >= 0)) & (log.cycle >= first)).nonzero()[0]
    forms = np.where(known[rows, None], log.form[rows, 0], UNKNOWN)
    every = np.concatenate([forms, np.where(known[rows], -1, log.track[rows])[:, None]], axis=1)
    rows, which, flat, spread_of, owner = log.both_ends(rows, unique_forms(every)[1], spacing)
    count = np.bincount(which, minlength=len(owner))

    def total(value: Floats) -> Floats:
        return np.asarray(np.bincount(which, value, len(owner)), dtype=np.float64)

    weight, length, since = 1.0 / log.std[rows, 0] ** 2, log.seen[rows, 0], log.cycle[rows] - first
    angle = heading[since]
    cos, sin = np.cos(angle), np.sin(angle)
    toward = np.stack([total(cos * flat[:, 0] - sin * flat[:, 1]), total(sin * flat[:, 0] + cos * flat[:, 1])], axis=1)
    toward /= count[:, None]
    up = np.sqrt(np.maximum(1.0 - np.sum(toward**2, axis=1), 0.0))
    toward = -2.0 * np.concatenate([toward, up[:, None]], axis=1)
    # seen from the two ends a point, or a wall's normal, lies in directions so much apart
    blur = 2.0 * baseline * total(weight) / np.maximum(total(weight * length), 1e-9)
    doubt = total((spread_of**2).mean(axis=1)) / count**2
    return Lengths(
        heard, which, (log.cycle[rows] - last) * step, weight, length,
        length - np.vecdot(toward[which], place[since] - place[-1]), toward, count,
        np.hypot(blur, 2.0 * np.sqrt(doubt)), owner,
    )  # fmt: skip


def rates(found: Lengths) -> Rates:
    """Rates at which the lengths of tracks and explained paths change, by weighted line fits over time to what the
    positions leave of the lengths' change."""
    place, time = found.heard.place, found.heard.step * max(len(found.heard.place) - 1, 1)
    velocity = (place[-1] - place[0]) / time
    (rate,), variance, fine = _slopes(found, found.time, found.left)
    rate = rate + found.toward @ velocity
    bends = _bends(found, float(velocity @ velocity))
    return _rates(found, fine, (rate, variance, found.blur, rate), time, np.zeros(2), bends)


def accelerations(found: Lengths, steps: int) -> Rates:
    """Rates [m/s^2] at which the lengths of tracks and explained paths change with the way of a constant acceleration
    over the last `steps`, by weighted line fits to what the positions leave of the lengths' change: 0 for a path that
    follows the positions as they are."""
    place, step = found.heard.place, found.heard.step
    by = 0.5 * np.maximum(found.time + steps * step, 0.0) ** 2
    (rate, whole), variance, fine = _slopes(found, by, found.left, found.length)
    way = 0.5 * (step * np.maximum(np.arange(steps + 1 - len(place), steps + 1), 0.0)) ** 2
    way -= way.mean()
    believed = way @ place[:, :2] / (way @ way)
    return _rates(found, fine, (rate, variance, found.blur, whole), 0.5 * (steps * step) ** 2, believed)


def _slopes(found: Lengths, x: Floats, *values: Floats) -> tuple[list[Floats], Floats, Booleans]:
    """Slopes (E,) of weighted line fits over `x` (N,) to each of some values (N,), their variance (E,), and whether
    there are enough components (E,) for a fit."""
    total, weighted = found.total, found.weight * x
    s, sx, sxx = total(found.weight), total(weighted), total(found.weight * x**2)
    spread = s * sxx - sx**2
    enough = (found.count >= MEASURED) & (spread > 1e-9 * s * s * found.heard.step**2)
    spread = np.where(enough, spread, 1.0)
    slopes = [(s * total(weighted * value) - sx * total(found.weight * value)) / spread for value in values]
    return slopes, CONSTANTS.crowd * s / spread, enough


def _rates(
    found: Lengths, fine: Booleans, values: tuple[Floats, Floats, Floats, Floats], unit: float, believed: Floats,
    bends: tuple[Floats, ...] = (),
) -> Rates:  # fmt: skip
    """Rates of those lengths (E,) that are `fine`, from their rates, variances, blurs and rates of the measured lengths
    over a `unit` [s or s^2]."""
    toward, heard = found.toward, found.heard
    fine = fine & (np.vecdot(toward[:, :2], toward[:, :2]) <= 4.0 + 1e-9)  # at the rim, but for rounding
    turning = heard.baseline * float(np.abs(np.diff(heard.heading)).sum()) / unit
    every, owner = np.unique(found.owner[fine], return_inverse=True)
    alone = np.array_equal(owner, np.arange(len(every)))
    return Rates(
        toward[fine], *(value[fine] for value in values), turning, *([bend[fine] for bend in bends] or (None, None)),
        None if alone else owner, believed,
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


def weigh(found: Rates, told: Floats, std: Floats, manoeuvres: Manoeuvres | None = None) -> StartCheck:
    """Log evidence of the told velocity (3,) [m/s] within `std` (3,), from the rates of path lengths, against any other
    velocity and against the told one turned by a wrong compass; `manoeuvres` may have changed it since, which bends
    the lengths over time."""
    near, anywhere = np.diag(std[:2] ** 2), np.diag(std[:2] ** 2 + CONSTANTS.walk**2)
    # the told velocity has a maximum of its own near it, which others, if louder, would draw to themselves
    starts = _starts(found, told)
    right = (
        _log_manoeuvred(found, starts, told, near, manoeuvres)
        if manoeuvres
        else float(_find_modes(found, starts, told, near).evidence.max())
    )
    every = _find_modes(found, starts, told, anywhere)
    speed, spread = every.evidence, every.covariance + near
    length, aim = np.linalg.norm(every.velocity, axis=1), float(np.linalg.norm(told[:2]))
    # the speed agrees, and all directions are alike
    along = np.maximum(np.trace(spread, axis1=1, axis2=2) / 2.0, 1e-12)
    ring = -0.5 * (length - aim) ** 2 / along - 0.5 * np.log(2.0 * np.pi * along)
    ring -= np.log(2.0 * np.pi * np.hypot(length, np.sqrt(along)))
    compass = every.evidence - _log_normal(every.velocity - told[:2], anywhere) + ring
    is_compass = bool(compass.max() > speed.max())
    best = int(np.argmax(compass if is_compass else speed))
    velocity = np.append(every.velocity[best], told[2])
    turn = float(np.arctan2(told[1], told[0]) - np.arctan2(velocity[1], velocity[0]))
    variance = spread[best] if is_compass else every.covariance[best]
    return StartCheck(
        max(float(speed.max()), float(compass.max())) - right + CONSTANTS.log_rare, is_compass, velocity,
        float(np.sqrt(np.trace(variance) / 2.0)), float((turn + np.pi) % (2.0 * np.pi) - np.pi),
    )  # fmt: skip


def _log_manoeuvred(found: Rates, starts: Floats, told: Floats, near: Floats, manoeuvres: Manoeuvres) -> float:
    """Log evidence that the told velocity was right and what manoeuvres made of it since, by the rates of path lengths,
    which are those of the mean velocity, and by their bends: over those of constant velocities, which bend no length.
    """
    assert found.bend is not None
    half, total = 0.5 * manoeuvres.time, -np.inf
    for share, std in zip(manoeuvres.share, manoeuvres.std, strict=True):
        if share > 0.0:
            spread = near + (half * std) ** 2 * np.eye(2)
            every = _find_modes(found, starts, told, spread)
            best = int(np.argmax(every.evidence))
            likely, agreeing, _ = _likelihoods(found, every.velocity[best : best + 1], told[2])
            agrees = agreeing.sum(axis=0)[0] / found.each(likely[0])
            # what is not the told velocity's own error
            accel = half * std**2 * np.linalg.solve(spread, every.velocity[best] - told[:2])
            wanted = found.toward[:, :2] @ accel
            ratio = (found.bend - 0.5 * wanted) * wanted / found.bend_variance
            gain = found.mixed(agrees * np.expm1(np.minimum(ratio, 700.0)))
            bent = np.log1p(np.maximum(gain, -1.0 + 1e-15)).sum()
            total = float(np.logaddexp(total, np.log(share) + every.evidence[best] + bent))
    return total


def log_evidence(found: Rates, told: Floats, std: Floats) -> float:
    """Log evidence of the rates of path lengths under a velocity `told` (3,) [m/s] within `std` (3,)."""
    return float(_find_modes(found, _starts(found, told), told, np.diag(std[:2] ** 2)).evidence.max())


def weigh_change(found: Rates, calm: Floats, ways: list[Floats], log_prior: float) -> tuple[float, Floats]:
    """Posterior log odds that rates of path lengths change by a horizontal velocity or acceleration of one of the
    covariances `ways` (2, 2), all alike, rather than `calm` (2, 2), and the likeliest such change (2,); `log_prior` are
    the odds beforehand."""
    starts, nothing = _starts(found, np.zeros(3)), np.zeros(3)
    level = np.log(_likelihoods(found, starts, 0.0)[0]).sum(axis=1)
    if level.max() - level[0] + log_prior <= 0.0:  # no prior makes a change likelier than that
        return -np.inf, nothing[:2]
    modes = [_find_modes(found, starts, nothing, spread) for spread in ways]
    best = max(modes, key=lambda each: each.evidence.max())
    at = int(np.argmax(best.evidence))
    log_ratio = best.evidence[at] - np.log(len(ways)) - _find_modes(found, starts[:1], nothing, calm).evidence[0]
    return float(log_ratio) + log_prior, best.velocity[at]


def agreed_velocity(found: Rates) -> Floats:
    """Horizontal velocity (3,), or displacement, on which most rates of path length agree; near zero if it may be."""
    every = _find_modes(found, _starts(found, np.zeros(3)), np.zeros(3), CONSTANTS.walk**2 * np.eye(2))
    return np.append(every.velocity[int(np.argmax(every.evidence))], 0.0)


def _log_normal(off: Floats, spread: Floats) -> Floats:
    """Log densities (S,) of offsets (S, 2) under a centred Gaussian of covariance (2, 2)."""
    inside = np.vecdot(off, np.linalg.solve(spread, off.T).T)
    return -0.5 * inside - 0.5 * np.linalg.slogdet(spread)[1] - np.log(2.0 * np.pi)


class _Modes(NamedTuple):
    """Maxima of a velocity's posterior: S horizontal velocities (S, 2), covariances (S, 2, 2) and Laplace log evidences
    (S,)."""

    velocity: Floats
    covariance: Floats
    evidence: Floats


def _starts(found: Rates, told: Floats) -> Floats:
    """Initial horizontal velocities (S, 2) of the search for agreement: the told one, and those on which two tracks
    agree."""
    first, second = np.triu_indices(len(found.rate), 1)
    pair = np.stack([found.toward[first], found.toward[second]], axis=1)
    aim = np.stack([found.rate[first], found.rate[second]], axis=1) - pair[..., 2] * told[2]
    det = pair[:, 0, 0] * pair[:, 1, 1] - pair[:, 0, 1] * pair[:, 1, 0]
    fine = np.abs(det) > 0.5
    x = (aim[:, 0] * pair[:, 1, 1] - aim[:, 1] * pair[:, 0, 1])[fine] / det[fine]
    y = (aim[:, 1] * pair[:, 0, 0] - aim[:, 0] * pair[:, 1, 0])[fine] / det[fine]
    every = np.stack([x, y], axis=1)[np.hypot(x, y) < 3.0 * CONSTANTS.walk]
    level, cell = np.log(_likelihoods(found, every, told[2])[0]).sum(axis=1), np.round(every / NEAR) @ [1.0, 1e6]
    order = np.argsort(-level, kind="stable")
    _, first = np.unique(cell[order], return_index=True)
    return np.concatenate([told[None, :2], every[order[np.sort(first)[:MOST]]]])


NEAR, MOST = 0.01, 8
"""Difference [m/s] up to which initial velocities are one, and how many of them are refined."""


def _likelihoods(found: Rates, velocity: Floats, climb: float) -> tuple[Floats, Floats, Floats]:
    """Likelihoods (S, T) of the tracks' rates of length under horizontal velocities (S, 2), and those (2, S, E) of the
    two ways to agree, from each direction, with their variances (2, S, E)."""
    left = found.rate - found.toward[:, 2] * climb - velocity @ found.toward[:, :2].T
    # a direction errs in all of the motion, what the positions have taken out of the lengths included
    speed = velocity if found.believed is None else velocity + found.believed
    variance = found.variance + found.blur**2 * np.vecdot(speed, speed)[:, None]
    # half of the paths shorten as the agent nears where they come from; of the others a quarter keep their length
    # every other one of them over more than one wall, where a turn of the body changes the length as well
    either_way = variance + np.array([0.0, found.turning**2])[:, None, None]
    likely = 0.25 * found.share * np.exp(-0.5 * left**2 / either_way) / np.sqrt(2.0 * np.pi * either_way)
    close = found.mixed(likely.sum(axis=0))
    other: Floats | float = 1.0 / (4.0 * CONSTANTS.walk)
    if found.believed is not None:
        # a length changes by up to twice the agent's speed, evenly, if all is at rest but for rare events
        wide = either_way[1] + 4.0 / 3.0 * (np.vecdot(speed, speed) + climb**2)[:, None]
        still = np.exp(-0.5 * found.whole**2 / wide) / np.sqrt(2.0 * np.pi * wide)
        other = CONSTANTS.rare * other + (1.0 - CONSTANTS.rare) * still
    return close + 0.5 / 4.0 * found.mixed(found.share * (found.kept + 3.0 * other)), likely, either_way


def _find_modes(found: Rates, start: Floats, told: Floats, spread: Floats) -> _Modes:
    """Nearest maxima of the velocity's posterior from initial velocities (S, 2), under a prior about `told` (3,) of
    covariance `spread` (2, 2), with Laplace's evidence there."""
    flat, rate = found.toward[:, :2], found.rate - found.toward[:, 2] * told[2]
    v, prior, squares = start, np.linalg.inv(spread), (flat[:, :, None] * flat[:, None, :]).reshape(-1, 4)
    for last in (False,) * 6 + (True,):
        either, likely, variance = _likelihoods(found, v, told[2])
        weight = (likely / variance).sum(axis=0) / found.each(either)  # with which the tracks agree
        one, both, _, two = (weight @ squares + prior.ravel()).T  # the normal matrix's numbers
        det = one * two - both**2
        if last:
            break
        x, y = ((weight * rate) @ flat + prior @ told[:2]).T
        v = np.stack([two * x - both * y, one * y - both * x], axis=1) / det[:, None]
    evidence = np.log(either).sum(axis=1) + np.log(2.0 * np.pi) - 0.5 * np.log(det)
    covariance = np.stack([two, -both, -both, one], axis=1).reshape(-1, 2, 2) / det[:, None, None]
    return _Modes(v, covariance, evidence + _log_normal(v - told[:2], spread))
