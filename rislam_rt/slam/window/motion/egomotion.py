"""Egomotion: check of the told velocity and compass against the rates at which the path lengths of the first tracks
change.

Whatever throws it, a return grows shorter by the ways that the agent goes towards where it arrives from and where it
leaves to: `rate = -(u + w) . v`. Over a wall, a point, or two walls at right angles that is `-2 u . v`; over two other
things it leaves to where its reciprocal path arrives from. What goes to and fro between opposite walls keeps its
length, from both sides alike; what comes over a wall on one leg alone, and whose reciprocal is not heard, does neither.
So a velocity is wanted that many tracks agree on, each of them with a probability of its own of being none of these.
The told velocity is one such, with its own deviation and what manoeuvres since may have made of it; if it was told
wrong, any other within walking speed is as good. Laplace evidences of both decide.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, distinct_rows
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.motion.length_rates import Kinds, Rates

FEWEST = 3
"""Tracks with a rate of length from which on the motion is checked, and pairs of a return and a component from which on
a jump or a turn is: two agree on any horizontal motion."""


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


def possible_changes(found: Rates, log_prior: float) -> Floats | None:
    """Initial values (S, 2) for `weigh_change`; None where the rates of path lengths tell of no change by more than
    its prior log odds `log_prior` ask for, which how large it may be only adds to."""
    every, level = _agreed_by_two(found, np.zeros(3))
    return _likeliest(every, level) if level.max() - level[0] + log_prior > 0.0 else None


def weigh_change(
    found: Rates, starts: Floats, calm: Floats, ways: list[Floats], log_prior: float
) -> tuple[float, Floats]:  # fmt: skip
    """Egomotion across: posterior log odds that rates of path lengths change by a horizontal velocity or acceleration
    of one of the covariances `ways` (2, 2), all alike, rather than `calm` (2, 2), and the likeliest such change (2,),
    from initial values `starts` (S, 2); `log_prior` are the odds beforehand."""
    many = len(starts)
    spread = np.concatenate([np.repeat(ways, many, axis=0), calm[None]])
    every = _find_modes(found, np.concatenate([np.tile(starts, (len(ways), 1)), starts[:1]]), np.zeros(3), spread)
    at = int(np.argmax(every.evidence[:-1]))
    log_ratio = every.evidence[at] - np.log(len(ways)) - every.evidence[-1]
    return float(log_ratio) + log_prior, every.velocity[at]


def weigh_climb(found: Rates, calm: float, log_prior: float) -> tuple[float, float]:
    """Egomotion by a climb: posterior log odds that rates of path lengths change by a vertical acceleration of the
    liveliest mode rather than of variance `calm`, and the likeliest one; `log_prior` are the odds beforehand."""
    up, nowhere = found.toward[:, 2], np.zeros((1, 2))
    starts = np.append(0.0, found.rate[up != 0.0] / up[up != 0.0])[:, None]
    level = np.log(_likelihoods(found, nowhere, starts)[0]).sum(axis=1)
    if level.max() - level[0] + log_prior <= 0.0:
        return -np.inf, 0.0
    likeliest = starts[np.argsort(-level, kind="stable")[:MOST]]
    change, evidence = _find_climb(found, likeliest, CONSTANTS.liveliest**2)
    at, nothing = int(np.argmax(evidence)), _find_climb(found, starts[:1], calm)[1][0]
    return float(evidence[at] - nothing) + log_prior, float(change[at, 0])


def _find_climb(found: Rates, climb: Floats, variance: float) -> tuple[Floats, Floats]:
    """Nearest maxima (S, 1) of a vertical motion's posterior from initial values (S, 1), under a centred prior of a
    variance, with Laplace's log evidences (S,) there."""
    nowhere, up = np.zeros((1, 2)), found.toward[:, 2]
    for last in (False,) * 6 + (True,):
        either, likely, precision = _likelihoods(found, nowhere, climb)
        weight = (likely * precision).sum(axis=0) / found.each(either)
        normal = (weight @ up**2 + 1.0 / variance)[:, None]
        if last:
            break
        climb = (weight @ (up * found.rate))[:, None] / normal
    log_normal = -0.5 * climb**2 / variance - 0.5 * np.log(variance)
    return climb, np.log(either).sum(axis=1) + (log_normal - 0.5 * np.log(normal))[:, 0]


def agreed_velocity(found: Rates) -> Floats:
    """Horizontal velocity (3,), or displacement, on which most rates of path length agree; near zero if it may be."""
    every = _find_modes(found, _starts(found, np.zeros(3)), np.zeros(3), CONSTANTS.walk**2 * np.eye(2))
    return np.append(every.velocity[int(np.argmax(every.evidence))], 0.0)


def _log_normal(off: Floats, spread: Floats) -> Floats:
    """Log densities (S,) of offsets (S, 2) under centred Gaussians of covariances (2, 2) or (S, 2, 2)."""
    inside = np.vecdot(off, np.linalg.solve(spread, off[..., None])[..., 0])
    return -0.5 * inside - 0.5 * np.linalg.slogdet(spread)[1] - np.log(2.0 * np.pi)


class _Modes(NamedTuple):
    """Maxima of a velocity's posterior: S horizontal velocities (S, 2), covariances (S, 2, 2) and Laplace log evidences
    (S,)."""

    velocity: Floats
    covariance: Floats
    evidence: Floats


def _starts(found: Rates, told: Floats) -> Floats:
    """Initial horizontal velocities (S, 2) of the search for agreement: the told one, and the likeliest of those on
    which two tracks agree."""
    return _likeliest(*_agreed_by_two(found, told))


def _agreed_by_two(found: Rates, told: Floats) -> tuple[Floats, Floats]:
    """Horizontal velocities (S, 2), the told one and all those on which two tracks agree, and their log likelihoods
    (S,)."""
    first, second = _pairs(len(found.rate))
    if found.owner is not None:  # of a reciprocal pair both have the same sum of directions
        one = distinct_rows(found.toward)[0]
        first, second = one[_pairs(len(one))[0]], one[_pairs(len(one))[1]]
    (along, across, _), aim = found.toward.T, found.rate - found.toward[:, 2] * told[2]
    det = along[first] * across[second] - across[first] * along[second]
    fine = np.abs(det) > 0.5
    first, second, det = first[fine], second[fine], det[fine]
    x = (aim[first] * across[second] - aim[second] * across[first]) / det
    y = (aim[second] * along[first] - aim[first] * along[second]) / det
    slow = np.hypot(x, y) < 3.0 * CONSTANTS.walk
    every = np.concatenate([told[None, :2], np.array([x[slow], y[slow]]).T])
    return every, np.log(_likelihoods(found, every, told[2])[0]).sum(axis=1)


@lru_cache(maxsize=64)
def _pairs(count: int) -> tuple[Integers, Integers]:
    """All pairs (P,), (P,) among so many tracks that may agree."""
    return np.triu_indices(count, 1)


def _likeliest(velocity: Floats, level: Floats) -> Floats:
    """The first of some horizontal velocities (S, 2), and the likeliest of the others, `MOST` of them, no two of which
    are `NEAR`, by their log likelihoods (S,)."""
    every, cell = velocity[1:], np.round(velocity[1:] / NEAR) @ [1.0, 1e6]
    order = np.argsort(-level[1:], kind="stable")
    _, first = np.unique(cell[order], return_index=True)
    return np.concatenate([velocity[:1], every[order[np.sort(first)[:MOST]]]])


NEAR, MOST = 0.01, 8
"""Difference [m/s] up to which initial velocities are one, and how many of them are refined."""


def _likelihoods(found: Rates, velocity: Floats, climb: Floats | float) -> tuple[Floats, Floats, Floats]:
    """Likelihoods (S, T) of the tracks' rates of length under horizontal velocities (S, 2) and vertical ones (S, 1) or
    one for all, and those (2, S, E) of the two ways to agree, from each direction, with one over their variances (2, S,
    E)."""
    left = found.rate - found.toward[:, 2] * climb - velocity @ found.toward[:, :2].T
    # a direction errs in all of the motion, what the positions have taken out of the lengths included
    speed, rise = velocity, np.asarray(climb)
    if found.believed is not None:
        speed, rise = velocity + found.believed[:2], climb + found.believed[2]
    square, rise = np.vecdot(speed, speed)[:, None], rise**2
    variance = found.variance + found.blur**2 * square + found.lean**2 * rise
    # every other path that follows does so over more than one wall, where a turn of the body changes the length as well
    precision = 1.0 / (variance + np.array([0.0, found.turning**2])[:, None, None])
    likely = np.exp(-0.5 * left**2 * precision) * np.sqrt(precision)
    likely *= 0.5 / np.sqrt(2.0 * np.pi) * found.kinds.follows
    close = found.mixed(likely.sum(axis=0))
    other: Floats | float = 1.0 / (4.0 * CONSTANTS.walk)
    if found.believed is not None:
        # a length changes by up to twice the agent's speed, evenly, if all is at rest and its track keeps to its path
        narrow = 1.0 / (variance + (found.turning**2 + 4.0 / 3.0 * (square + rise)))
        still = np.exp(-0.5 * found.whole**2 * narrow) * np.sqrt(narrow / (2.0 * np.pi))
        other = found.astray * other + (1.0 - found.astray) * still
    other = found.mixed(found.share * other)
    return close + found.kinds.keeps * found.mixed_kept + found.kinds.other * other, likely, precision


def with_history(found: Rates, before: Rates, motion: Floats) -> Rates:
    """Rates of path lengths that hold each path for what it was `before`, by its rate under the motion (3,) [m/s] of
    that time, unless it has gone `astray` since."""
    assert found.name is not None
    assert before.name is not None
    close, likely, _ = (every[..., 0, :] for every in _likelihoods(before, motion[None, :2], motion[2]))
    followed = likely.sum(axis=0) / before.each(close)
    kept = before.each(before.kinds.keeps * before.mixed_kept / close)
    neither = 1.0 - before.each(before.mixed(followed)) - kept
    same = (found.name[:, None] == before.name).all(axis=2)
    # of several directions each is the one that is nearest to what it was; what has none is new
    apart = np.where(same, np.linalg.norm(found.toward[:, None] - before.toward, axis=2), np.inf)
    nearest = apart.argmin(axis=1)
    is_old = same.any(axis=1) & (apart.argmin(axis=0)[nearest] == np.arange(len(nearest)))
    old = np.where(is_old, followed[nearest], 0.0)
    owner = np.arange(found.number) if found.owner is None else found.owner
    first = np.unique(owner, return_index=True)[1]
    keeps, other = kept[nearest][first], neither[nearest][first]
    # what followed from a direction that it no longer has is not known
    known = same.any(axis=1)[first] * (1.0 - found.mixed(found.share * found.astray))
    known *= np.minimum(found.mixed(old) + keeps + other, 1.0)
    follows = np.where(is_old, old, found.kinds.follows)
    sure, new = known / (found.mixed(follows) + keeps + other), 1.0 - known
    return found._replace(known=Kinds(
        found.each(sure) * follows + found.each(new) * found.kinds.follows, sure * keeps + new * found.kinds.keeps,
        sure * other + new * found.kinds.other,
    ))  # fmt: skip


def _find_modes(found: Rates, start: Floats, told: Floats, spread: Floats) -> _Modes:
    """Nearest maxima of the velocity's posterior from initial velocities (S, 2), under a prior about `told` (3,) of
    covariance `spread` (2, 2) or (S, 2, 2), with Laplace's evidence there."""
    flat, rate = found.toward[:, :2], found.rate - found.toward[:, 2] * told[2]
    v, prior, squares = start, np.linalg.inv(spread), (flat[:, :, None] * flat[:, None, :]).reshape(-1, 4)
    held, pull = prior.reshape(-1, 4), prior @ told[:2]
    for last in (False,) * 6 + (True,):
        either, likely, precision = _likelihoods(found, v, told[2])
        weight = (likely * precision).sum(axis=0) / found.each(either)  # with which the tracks agree
        one, both, _, two = (weight @ squares + held).T  # the normal matrix's numbers
        det = one * two - both**2
        if last:
            break
        x, y = ((weight * rate) @ flat + pull).T
        v = (np.array([two * x - both * y, one * y - both * x]) / det).T
    evidence = np.log(either).sum(axis=1) + np.log(2.0 * np.pi) - 0.5 * np.log(det)
    covariance = np.stack([two, -both, -both, one], axis=1).reshape(-1, 2, 2) / det[:, None, None]
    return _Modes(v, covariance, evidence + _log_normal(v - told[:2], spread))
