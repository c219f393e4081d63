"""What associated measurements teach about the landmarks themselves: strength, identity, whether they exist."""

from collections.abc import Sequence

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.model import Measurement, RisCode
from rislam_rt.slam.birth import poses_of
from rislam_rt.slam.book import Book, image_ident, learn_ratio
from rislam_rt.slam.expect import Belief, bounces
from rislam_rt.slam.identity import add_evidence, log_panel, log_scatterer, predicted_panel_gain
from rislam_rt.slam.match import Outlook
from rislam_rt.slam.particles import Particles, systematic_ancestors
from rislam_rt.slam.returns import NONE, TX, Poses, Returns, compact, observe
from rislam_rt.slam.tracks import Glance

BELIEF_SAMPLES = 24
"""Samples of the belief over which the panel's predicted gain is averaged."""
CERTAIN = 30.0
"""Log odds beyond which a point's identity is no longer in question."""
SURPRISE_RATE = 0.03
"""Share of the latest innovation in the running mean."""
SHOWN_RATE = 0.06
"""Share of the latest cycle in the running share of cycles in which a feature showed."""


def learn(
    belief: Belief,
    particles: Particles,
    outlook: Outlook,
    hit: Integers,
    surprise: Floats,
    glance: Glance,
    taken: Integers,
    measurement: Measurement,
    free: Integers,
    code: RisCode | None,
    *,
    rng: np.random.Generator,
) -> tuple[Book, Integers]:
    """The book after returns `hit` were seen as measurements `taken`, and the ident that each of them went to.

    `surprise` (A,) is each hit's squared innovation per degree of freedom.
    """
    book = belief.book
    book, names = _count(book, outlook, hit, surprise, glance, taken)
    returns = compact(outlook.expected.returns, hit)
    # beside something of its strength an amplitude tells of the sum, not of the landmark
    plain = (bounces(returns) == 0) & (returns.point != TX) & ~outlook.merger.outshone[hit]
    if plain.any():
        direct = compact(returns, np.flatnonzero(plain))
        raw = free[taken[plain]]
        amplitude, std = measurement.amplitude[raw], np.maximum(measurement.amplitude_std[raw], 1e-30)
        book = _weigh(book, belief, particles, direct, amplitude, std, code, rng=rng)
    return book, names


def _count(
    book: Book,
    outlook: Outlook,
    hit: Integers,
    surprise: Floats,
    glance: Glance,
    taken: Integers,
) -> tuple[Book, Integers]:
    """Hits and misses, names, and what the walls' returns say about their reflection."""
    expected = outlook.expected
    returns = expected.returns
    number = bounces(returns)
    names = np.full(len(hit), -1)
    seen = np.zeros(len(book.ident), dtype=np.bool_)
    shocks = book.surprise.copy()
    for place, (row, pick) in enumerate(zip(hit, taken, strict=True)):
        legs = returns.legs[[returns.tx[row], returns.rx[row]]]
        walls = np.unique(legs[:, 1:][legs[:, 1:] != NONE])
        point = int(returns.point[row])
        seen[walls] = True
        blamed = walls if len(walls) else np.array([point])
        shocks[blamed] += SURPRISE_RATE * (surprise[place] - shocks[blamed])
        if point == TX or number[row] == 0:
            name = point if number[row] == 0 else int(walls[0])
            seen[name] = True
            names[place] = book.ident[name]
        else:
            book, names[place] = image_ident(book, point, int(legs[1, 1] if legs[1, 1] != NONE else legs[0, 1]))
        if number[row] == 1 and outlook.merger.partner[row] < 0 and not outlook.merger.outshone[row]:
            surplus = float(glance.log_amplitude[pick] - expected.log_amplitude[row])
            book = learn_ratio(book, int(walls[0]), float(book.ratio[walls[0]]) + surplus)
    return book._replace(hits=book.hits + seen, surprise=shocks, shown=_shown(book, outlook, hit)), names


def _shown(book: Book, outlook: Outlook, hit: Integers) -> Floats:
    """Who showed, of those that should have: strong enough, and not beside something stronger.

    A wall is judged by the images of the point that it was found by: those of others may never have been there.
    """
    expected, returns = outlook.expected, outlook.expected.returns
    number = bounces(returns)
    on_tx = returns.legs[returns.tx, 1] != NONE
    here = np.zeros(len(number), dtype=np.bool_)
    here[hit] = True
    shown = book.shown.copy()
    for row in np.flatnonzero(expected.likely & ~outlook.merger.outshone & (number <= 1) & (returns.point != TX)):
        legs = returns.legs[[returns.tx[row], returns.rx[row]]]
        point, feature = int(legs[0, 0]), int(legs[:, 1].max()) if number[row] else int(legs[0, 0])
        if number[row] and book.ident[point] != book.founder[feature]:
            continue
        column = int(on_tx[row])
        shown[feature, column] += SHOWN_RATE * (here[row] - shown[feature, column])
    return shown


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
