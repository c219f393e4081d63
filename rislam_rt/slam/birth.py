"""Births: tracks whose history only one hypothesis explains become features of the map."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Body
from rislam_rt.slam.book import Book, enter
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.hypotheses import IMAGE, MOVING, POINT, Fit, History, first_guess, fit_feature
from rislam_rt.slam.particles import Particles
from rislam_rt.slam.returns import Poses, Returns, feature_jacobian
from rislam_rt.slam.tracks import Tracks

STRIDE = 4
"""Tracks are examined every so many cycles, each at its own turn."""
MAX_POINT_STD = 0.5
"""Largest standard deviation [m] of a new point along its worst axis."""
MAX_WALL_STD = 0.5
"""The same for the image of the anchor in a new wall."""


class Verdict(NamedTuple):
    """What a track is taken for."""

    kind: Returns
    parent: int
    """Feature row of the point, -1 without one."""
    fit: Fit


def examine(
    tracks: Tracks, particles: Particles, book: Book, headings: Floats, body: Body, cycle: int, config: SlamConfig
) -> tuple[Booleans, Tracks, Particles, Book]:
    """Look at the tracks whose turn it is.

    Returns which tracks became features (T,), the tracks (some now known for wall returns), particles and book.
    """
    born = np.zeros(len(tracks.misses), dtype=np.bool_)
    for row in due_tracks(tracks, cycle, config):
        history, rows = track_history(tracks, row, particles, headings, body)
        mean_pose = particles.weight @ particles.position
        verdict = judge(history, mean_pose, particles, book, config, full=len(rows) >= config.window - 1)
        if verdict is None:
            continue
        if verdict.kind is MOVING:
            tracks.specular[row] = True
            continue
        particles, book = settle(verdict, rows, history, mean_pose, particles, book, headings, body)
        born[row] = True
    return born, tracks, particles, book


def due_tracks(tracks: Tracks, cycle: int, config: SlamConfig) -> Integers:
    """Tracks to examine now, the shortest first: an image always lies behind its point."""
    ready = ~tracks.specular & (tracks.length >= config.birth_cycles) & (tracks.misses == 0)
    turn = (tracks.length % STRIDE == 0) | (cycle % STRIDE == 0)
    rows = np.flatnonzero(ready & turn)
    return rows[np.argsort(tracks.mean[rows, 0, 0])]


def track_history(
    tracks: Tracks, row: int, particles: Particles, headings: Floats, body: Body
) -> tuple[History, Integers]:
    """A track's measurements with the mean believed poses, and the trail rows they belong to."""
    rows = np.flatnonzero(tracks.cycle[row] >= 0)
    position = np.einsum("n,kni->ki", particles.weight, particles.trail[rows])
    poses = poses_of(position, headings[rows], body)
    return History(tracks.seen[row, rows], tracks.std[row, rows], poses), rows


def poses_of(position: Floats, heading: Floats, body: Body) -> Poses:
    """Ends of agents at positions (..., 3) with headings that broadcast against the leading axes."""
    rotation = rotation_z(heading)
    return Poses(position + rotation @ body.tx_offset, position + rotation @ body.rx_offset, np.asarray(heading))


def judge(
    history: History, anchor: Floats, particles: Particles, book: Book, config: SlamConfig, *, full: bool
) -> Verdict | None:
    """The hypothesis that explains the history, if one does and no other comes near."""
    means = np.einsum("n,nfi->fi", particles.weight, particles.features)
    trials = [(POINT, -1), (MOVING, -1), *((IMAGE, int(p)) for p in book.points)]
    verdicts = []
    for kind, parent in trials:
        known = means[parent] if parent >= 0 else None
        start = first_guess(kind, known, anchor, history)
        if start is not None:
            verdicts.append(Verdict(kind, parent, fit_feature(kind, start, known, anchor, history, 6)))
    verdicts.sort(key=lambda v: float(v.fit.chi2))
    best, rest = verdicts[0], verdicts[1:]
    dof = 3.0 * len(history.seen) - 3.0
    fits = best.fit.chi2 < dof + 4.0 * np.sqrt(2.0 * dof)
    margin = rest[0].fit.chi2 - best.fit.chi2 if rest else np.inf
    limit = MAX_POINT_STD if best.kind is POINT else MAX_WALL_STD
    sharp = np.sqrt(np.linalg.eigvalsh(best.fit.covariance)[-1]) < limit
    clear = margin > config.birth_margin
    return best if fits and sharp and clear else None


def settle(
    verdict: Verdict,
    rows: Integers,
    history: History,
    anchor: Floats,
    particles: Particles,
    book: Book,
    headings: Floats,
    body: Body,
) -> tuple[Particles, Book]:
    """Enter a feature: every particle fits it along its own trail."""
    trail = np.swapaxes(particles.trail[rows], 0, 1)
    own = history._replace(poses=poses_of(trail, headings[rows], body))
    parent = particles.features[:, verdict.parent] if verdict.parent >= 0 else None
    start = np.broadcast_to(verdict.fit.feature, particles.position.shape)
    fit = fit_feature(verdict.kind, start, parent, anchor, own, 2)
    size = particles.covariance.shape[0]
    covariance = np.zeros((size + 3, size + 3))
    covariance[:size, :size] = particles.covariance
    covariance[size:, size:] = verdict.fit.covariance
    if verdict.parent >= 0:
        means = np.einsum("n,nfi->fi", particles.weight, particles.features)
        lean = _parent_sensitivity(verdict, means[verdict.parent], anchor, history)
        block = slice(3 * verdict.parent, 3 * verdict.parent + 3)
        covariance[size:, :size] = lean @ particles.covariance[block]
        covariance[:size, size:] = covariance[size:, :size].T
        covariance[size:, size:] += lean @ particles.covariance[block, block] @ lean.T
    features = np.concatenate([particles.features, fit.feature[:, None]], axis=1)
    particles = particles._replace(features=features, covariance=covariance)
    return particles, enter(book, verdict.kind is not POINT, anchor, verdict.kind is POINT)


def _parent_sensitivity(verdict: Verdict, parent: Floats, anchor: Floats, history: History) -> Floats:
    """How the fitted wall (3,) moves with its parent (3,): the implicit derivative of the normal equations."""
    known = np.stack([verdict.fit.feature, parent])[None]
    jacobian = feature_jacobian(verdict.kind, known, np.stack([anchor, anchor]), history.poses)[..., 0, :, :, :]
    weight = 1.0 / history.std**2
    pull = np.einsum("kia,ki,kib->ab", jacobian[..., 0, :], weight, jacobian[..., 1, :])
    return -verdict.fit.covariance @ pull
