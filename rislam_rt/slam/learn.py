"""What associated measurements teach about the landmarks themselves: strength, identity, existence."""

from collections.abc import Sequence

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.model import Measurement, RisCode
from rislam_rt.slam.birth import poses_of
from rislam_rt.slam.book import Book, image_ident, learn_ratio, strike
from rislam_rt.slam.expect import Belief, Expected, bounces
from rislam_rt.slam.identity import add_evidence, log_panel, log_scatterer, predicted_panel_gain
from rislam_rt.slam.particles import Particles, systematic_ancestors
from rislam_rt.slam.returns import NONE, TX, Poses, Returns, observe, reflect
from rislam_rt.slam.tracks import Glance

BELIEF_SAMPLES = 24
"""Samples of the belief over which the panel's predicted gain is averaged."""
CERTAIN = 30.0
"""Log odds beyond which a point's identity is no longer in question."""
FORGIVENESS = 0.8
"""What is left of the count of misses after a hit."""


def learn(
    belief: Belief,
    particles: Particles,
    expected: Expected,
    hit: Integers,
    glance: Glance,
    taken: Integers,
    measurement: Measurement,
    free: Integers,
    code: RisCode | None,
    *,
    rng: np.random.Generator,
) -> tuple[Book, Integers]:
    """The book after returns `hit` were seen as measurements `taken`; and the ident that each of them went to."""
    book = belief.book
    book, names = _count(book, expected, hit, glance, taken)
    returns = Returns(expected.returns.legs, expected.returns.tx[hit], expected.returns.rx[hit])
    plain = (bounces(returns) == 0) & (returns.point != TX)
    if plain.any():
        direct = Returns(returns.legs, returns.tx[plain], returns.rx[plain])
        raw = free[taken[plain]]
        amplitude, std = measurement.amplitude[raw], np.maximum(measurement.amplitude_std[raw], 1e-30)
        book = _weigh(book, belief, particles, direct, amplitude, std, code, rng=rng)
    return book, names


def _count(book: Book, expected: Expected, hit: Integers, glance: Glance, taken: Integers) -> tuple[Book, Integers]:
    """Hits and misses, names, and what the walls' returns say about their reflection."""
    returns = expected.returns
    number = bounces(returns)
    names = np.full(len(hit), -1)
    seen = np.zeros(len(book.ident), dtype=np.bool_)
    for place, (row, pick) in enumerate(zip(hit, taken, strict=True)):
        legs = returns.legs[[returns.tx[row], returns.rx[row]]]
        walls = np.unique(legs[:, 1:][legs[:, 1:] != NONE])
        point = int(returns.point[row])
        seen[walls] = True
        if point == TX or number[row] == 0:
            name = point if number[row] == 0 else int(walls[0])
            seen[name] = True
            names[place] = book.ident[name]
        else:
            book, names[place] = image_ident(book, point, int(legs[1, 1] if legs[1, 1] != NONE else legs[0, 1]))
        if number[row] == 1:
            surplus = float(glance.log_amplitude[pick] - expected.log_amplitude[row])
            book = learn_ratio(book, int(walls[0]), float(book.ratio[walls[0]]) + surplus)
    missing = np.zeros(len(book.ident), dtype=np.bool_)
    lost = np.setdiff1d(np.flatnonzero((number == 0) & expected.likely), hit)
    missing[returns.point[lost]] = True
    misses = np.where(seen, book.misses * FORGIVENESS, book.misses + missing)
    return book._replace(hits=book.hits + seen, misses=misses), names


def _weigh(
    book: Book,
    belief: Belief,
    particles: Particles,
    direct: Returns,
    amplitude: Floats,
    std: Floats,
    code: RisCode | None,
    *,
    rng: np.random.Generator,
) -> Book:
    """Amplitudes of direct returns weighed for every strength, and for the panel."""
    points = direct.point
    sight = observe(direct, belief.features, book.anchor, belief.poses)
    scatterer = log_scatterer(amplitude, std, sight.tx_length, sight.rx_length, belief.radio)
    panel: Floats = np.full(len(points), -np.inf)
    if belief.ris is not None and code is not None:
        gain = _sampled_gains(belief, particles, points, code, rng=rng)
        panel = log_panel(amplitude, std, gain)
    grid, log_ris = add_evidence(book.log_grid[points], book.log_ris[points], scatterer, panel)
    grids, all_ris = book.log_grid.copy(), book.log_ris.copy()
    grids[points], all_ris[points] = grid, np.clip(log_ris, -CERTAIN, CERTAIN)
    if belief.ris is None:
        all_ris[points] = -np.inf
    return book._replace(log_grid=grids, log_ris=all_ris)


def _sampled_gains(
    belief: Belief, particles: Particles, points: Sequence[int] | Integers, code: RisCode, *, rng: np.random.Generator
) -> Complexes:
    """The panel's gain (P, S) if it were at each of the points, over samples of pose and map together."""
    assert belief.ris is not None
    chosen = systematic_ancestors(particles.log_weight, BELIEF_SAMPLES, rng=rng)
    poses: Poses = poses_of(particles.position[chosen], belief.poses.heading, belief.body)
    centers = np.swapaxes(particles.features[chosen][:, points], 0, 1)
    for place, point in enumerate(points):
        block = particles.covariance[3 * point : 3 * point + 3, 3 * point : 3 * point + 3]
        values, vectors = np.linalg.eigh(block)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        centers[place] += rng.standard_normal((len(chosen), 3)) @ root.T
    return predicted_panel_gain(belief.ris, code, centers, poses.tx[None], poses.rx[None], np.ones(1), belief.radio)


def forget(particles: Particles, book: Book, limit: float) -> tuple[Particles, Book]:
    """Remove features that were expected and failed to show too often."""
    return _drop(particles, book, book.misses < limit)


def unite(particles: Particles, book: Book, distance: float) -> tuple[Particles, Book]:
    """Remove the younger of two features of one kind that the belief cannot tell apart."""
    means = np.einsum("n,nfi->fi", particles.weight, particles.features)
    keep = np.ones(len(book.ident), dtype=np.bool_)
    for kind in (book.points, book.walls):
        for place, young in enumerate(kind[1:], start=1):
            for old in kind[:place]:
                if keep[old] and keep[young] and _apart(particles, means, book, int(old), int(young)) < distance:
                    keep[young] = False
    return _drop(particles, book, keep)


def _apart(particles: Particles, means: Floats, book: Book, old: int, young: int) -> float:
    """Squared Mahalanobis distance between two features; walls are compared as images of the older one's anchor."""
    other = means[young]
    if book.is_wall[young]:
        other = reflect(book.anchor[old], means[young], book.anchor[young])
    gap = means[old] - other
    if gap @ gap > 1.0:
        return np.inf
    blocks = [particles.covariance[3 * row : 3 * row + 3, 3 * row : 3 * row + 3] for row in (old, young)]
    spread = blocks[0] + blocks[1] + 0.02**2 * np.eye(3)
    return float(gap @ np.linalg.solve(spread, gap))


def _drop(particles: Particles, book: Book, keep: Booleans) -> tuple[Particles, Book]:
    """Particles and book without some features."""
    if keep.all():
        return particles, book
    wide = np.repeat(keep, 3)
    covariance = particles.covariance[np.ix_(wide, wide)]
    return particles._replace(features=particles.features[:, keep], covariance=covariance), strike(book, keep)
