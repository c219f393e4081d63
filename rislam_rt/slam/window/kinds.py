"""What could a track be? Every hypothesis with at most one new feature, its prior, and its evidence."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.identity import point_amplitude
from rislam_rt.slam.moments import square_root
from rislam_rt.slam.returns import AXES, NONE, TX, reflect
from rislam_rt.slam.window.book import Book
from rislam_rt.slam.window.digest import Digest
from rislam_rt.slam.window.expect import Scene
from rislam_rt.slam.window.gauss import Holds, no_holds
from rislam_rt.slam.window.levels import LEVELS
from rislam_rt.slam.window.trial import Fits, Trials, smooth_paths, try_all

KINDS = (
    "wall", "known, wall", "wall, known", "point", "point over rx wall", "point over tx wall", "point over same",
    "two walls",
)  # fmt: skip
"""Names of the kinds, by their number."""
WALL, KNOWN_WALL, WALL_KNOWN, POINT, OVER_RX, OVER_TX, OVER_SAME, TWO_WALLS = range(len(KINDS))
LOG_KIND = np.log(np.array([0.25, 0.1, 0.1, 0.25, 0.05, 0.05, 0.02, 0.05]))
"""Log prior of each kind; over known walls, of all walls together."""
LOG_LONELY = np.log(0.05)
"""Log probability that what two walls throw is heard, and neither of their single returns: the floor, or hidden."""
LOG_NONE = np.log(0.05)
"""Of a path of no kind here: over walls that the map lacks."""
LOG_VOLUME = float(np.log(4.0 / 3.0 * np.pi * LEVELS.size**3))
BEHIND = -4.0
"""Log probability of a thing behind a wall that stands between it and the agent, or of a wall that stands before known
things: the walls of a room that is not convex end somewhere."""
DEPTH = 0.15
"""Distance [m] beyond a wall from which on a thing is behind it, and not on it."""


class Known(NamedTuple):
    """Features of the map as affine maps and places; walls as images of the agent's present place."""

    place: Floats
    """(F, 3)."""
    root: Floats
    """(F, 3, 3) square roots of their covariances."""
    turn: Floats
    """(F, 3, 3) reflection of each wall; the identity for points."""
    shift: Floats
    """(F, 3)."""


class Hypotheses(NamedTuple):
    """H hypotheses for T tracks."""

    kind: Integers
    """(H,)."""
    known: Integers
    """(H,) row of the known wall, -1 for none."""
    trials: Trials


class Verdict(NamedTuple):
    """What a track is held to be."""

    kind: int
    """-1: of no kind here."""
    probability: float
    known: int
    """Row of the known wall, -1 for none."""
    place: Floats
    """(3,) of the new feature."""
    covariance: Floats
    """(3, 3), the poses held."""
    holds: Holds
    """What may be held of it beforehand; its row is 0."""
    misfit: float
    """Standard deviations by which it costs more than noise makes it."""

    @property
    def form(self) -> tuple[int, int, int, int, int]:
        """Five rows, the new feature being `NEW`."""
        base, *walls = (self.known if part == KNOWN else part for part in _TEMPLATES[self.kind])
        return base, walls[0], walls[1], walls[2], walls[3]

    @property
    def is_wall(self) -> bool:
        """Whether the new feature is one."""
        return self.kind in (WALL, KNOWN_WALL, WALL_KNOWN)


NEW = -5
"""In a form: the feature that is sought."""
KNOWN = -6
"""In a template: the known wall."""
_TEMPLATES = (
    (TX, NONE, NONE, NEW, NONE), (TX, NONE, NONE, KNOWN, NEW), (TX, NONE, NONE, NEW, KNOWN),
    (NEW, NONE, NONE, NONE, NONE), (NEW, NONE, NONE, KNOWN, NONE), (NEW, KNOWN, NONE, NONE, NONE),
    (NEW, KNOWN, NONE, KNOWN, NONE), (TX, NONE, NONE, NONE, NONE),
)  # fmt: skip
"""Form of each kind."""


def known_features(mean: Floats, covariance: Floats, book: Book, middle: Floats) -> Known:
    """The map's features (F, 3), walls as images of `middle`, with their covariances (3F, 3F) block by block."""
    place, count = mean.copy(), len(mean)
    blocks = covariance.reshape(count, 3, count, 3)[np.arange(count), :, np.arange(count)]
    turn, shift = np.tile(AXES, (count, 1, 1)), np.zeros((count, 3))
    walls = book.walls
    if len(walls):
        wall, anchor = place[walls], book.anchor[walls]
        blocks[walls] = (slope := by_wall(middle, wall, anchor)) @ blocks[walls] @ np.swapaxes(slope, 1, 2)
        place[walls] = reflect(np.broadcast_to(middle, wall.shape), wall, anchor)
        span = place[walls] - middle
        square = np.vecdot(span, span)[:, None]
        turn[walls] = AXES - 2.0 * span[:, :, None] * (span / square)[:, None, :]
        shift[walls] = span * (np.vecdot(span, place[walls] + middle)[:, None] / square)
    roots = np.zeros((count, 3, 3))
    for row in range(count):
        root = square_root(blocks[row])
        roots[row, :, : root.shape[1]] = root
    return Known(place, roots, turn, shift)


def by_wall(point: Floats, wall: Floats, anchor: Floats) -> Floats:
    """Derivatives (..., 3, 3) of the mirror images of points (..., 3) by the walls (..., 3)."""
    span = wall - anchor
    scaled = span / np.vecdot(span, span)[..., None]
    depth = np.vecdot(scaled, point - 0.5 * (wall + anchor))[..., None]
    mirrored = point - 2.0 * depth * span
    return np.asarray(-2.0 * (depth[..., None] * AXES + scaled[..., :, None] * (mirrored - wall)[..., None, :]))


def hypotheses(digest: Digest, known: Known, book: Book) -> Hypotheses:
    """Every kind for every track, with its first guess."""
    count, walls = len(digest.seen), book.walls
    seen, tx, rx, _ = digest.mean
    ray, length = digest.direction, seen[:, 0]
    middle, image = digest.middle, rx + length[:, None] * digest.direction
    kinds, knowns, tracks, starts, turns, shifts, doubts = [], [], [], [], [], [], []
    plain = (AXES, np.zeros(3), np.zeros((3, 3)))
    every = np.arange(count)

    def add(kind: int, wall: int, start: Floats, first: int, second: int, at: tuple[Floats, Floats]) -> None:
        kinds.append(np.full(count, kind))
        knowns.append(np.full(count, wall))
        tracks.append(every)
        starts.append(start)
        parts = []
        for row, spot in ((first, at[0]), (second, at[1])):
            if row < 0:
                parts.append(tuple(np.broadcast_to(part, (count, *part.shape)) for part in plain))
            else:
                slope = by_wall(spot, known.place[row], middle)
                parts.append((
                    np.broadcast_to(known.turn[row], (count, 3, 3)), np.broadcast_to(known.shift[row], (count, 3)),
                    slope @ known.root[row],
                ))  # fmt: skip
        turns.append(np.stack([part[0] for part in parts], axis=1))
        shifts.append(np.stack([part[1] for part in parts], axis=1))
        doubts.append(np.stack([part[2] for part in parts], axis=1))

    anchor = np.broadcast_to(middle, image.shape)
    direct = place_on_ray(ray, length, tx, rx)
    add(WALL, NONE, reflect(anchor, image, tx), NONE, NONE, (tx, tx))
    add(POINT, NONE, direct, NONE, NONE, (tx, tx))
    for wall in walls.tolist():
        turn, shift = known.turn[wall], known.shift[wall]
        tx_image, behind = tx @ turn.T + shift, image @ turn.T + shift
        add(KNOWN_WALL, wall, reflect(anchor, image, tx_image), wall, NONE, (tx, tx))
        add(WALL_KNOWN, wall, reflect(anchor, behind, tx), NONE, wall, (tx, behind))
        apparent = place_on_ray(ray, length, tx_image, rx)
        mirrored, same = apparent @ turn.T + shift, direct @ turn.T + shift
        add(OVER_RX, wall, mirrored, NONE, wall, (tx, mirrored))
        add(OVER_TX, wall, apparent, wall, NONE, (apparent, tx))
        add(OVER_SAME, wall, same, wall, wall, (same, same))
    for pair in _pairs(ray):
        turned = (pair @ tx[..., None])[..., 0]
        add(TWO_WALLS, NONE, image - turned, NONE, NONE, (tx, tx))
        turns[-1] = np.stack([pair, np.broadcast_to(AXES, (count, 3, 3))], axis=1)
    kind = np.concatenate(kinds)
    trials = Trials(
        np.concatenate(tracks), kind <= WALL_KNOWN, kind == TWO_WALLS, np.concatenate(starts), np.concatenate(turns),
        np.concatenate(shifts), np.concatenate(doubts),
    )  # fmt: skip
    return Hypotheses(kind, np.concatenate(knowns), trials)


def _pairs(ray: Floats) -> list[Floats]:
    """What two walls do to the Tx: opposite ones, two upright ones, an upright and a level one: (T, 3, 3) each."""
    count = len(ray)
    corner = np.broadcast_to(np.diag([-1.0, -1.0, 1.0]), (count, 3, 3))
    edge = np.stack([-ray[:, 1], ray[:, 0], np.zeros(count)], axis=1)
    edge = edge / np.maximum(np.linalg.norm(edge, axis=1), 1e-6)[:, None]
    return [np.broadcast_to(AXES, (count, 3, 3)), corner, 2.0 * edge[:, :, None] * edge[:, None, :] - AXES]


def place_on_ray(ray: Floats, length: Floats, tx: Floats, rx: Floats) -> Floats:
    """Points (..., 3) on rays (..., 3) from Rx whose way from (mirrored) Tx positions (..., 3) has that length."""
    base = tx - rx
    reach = (length**2 - np.vecdot(base, base)) / np.maximum(2.0 * (length - np.vecdot(base, ray)), 1e-3)
    return np.asarray(rx + np.maximum(reach, 0.05)[..., None] * ray)


def judge(
    digest: Digest, known: Known, book: Book, scene: Scene, explained: list[tuple[int, float]], first: Booleans
) -> tuple[list[Verdict], Floats]:
    """Verdicts of T tracks, and the posterior (E,) of each of the explanations (track, log evidence) by the map.

    `first` (T,): nothing shorter and brighter is there.
    """
    table = hypotheses(digest, known, book)
    fits = try_all(table.trials, digest)
    track = table.trials.track
    rivals = np.where(table.known >= 0, np.log(max(len(book.walls), 1)), 0.0)
    evidence = fits.log_evidence - LOG_VOLUME - np.where(table.trials.is_wall | table.trials.is_pair, np.log(8.0), 0.0)
    evidence += LOG_KIND[table.kind] - rivals + np.where(table.trials.is_pair & first[track], LOG_LONELY, 0.0)
    evidence += _amplitudes(table, fits, digest, book, scene) + _opacity(table, fits, digest, known, book)
    gain = _upright(table, fits, digest, known, book)
    evidence = np.where(np.isfinite(fits.cost), evidence + gain, -np.inf)
    smooth, _ = smooth_paths(digest)
    seen = digest.mean[0]
    up = np.sqrt(np.maximum(1.0 - seen[:, 1] ** 2 - seen[:, 2] ** 2, 0.01))
    none = smooth + np.log(seen[:, 0] ** 2 / (8.0 * up)) - LOG_VOLUME + LOG_NONE
    verdicts, shares = [], np.zeros(len(explained))
    for row in range(len(digest.seen)):
        own = (track == row).nonzero()[0]
        told = [i for i, (which, _) in enumerate(explained) if which == row]
        weight = np.concatenate([[none[row]], evidence[own], [explained[i][1] for i in told]])
        total = np.logaddexp.reduce(weight)
        shares[told] = np.exp(weight[1 + len(own) :] - total)
        best = int(np.argmax(weight[: 1 + len(own)]))
        probability = float(np.exp(weight[best] - total))
        if best == 0:
            verdicts.append(Verdict(-1, probability, -1, np.zeros(3), AXES, no_holds(), 0.0))
            continue
        at = own[best - 1]
        count = int((digest.weight[row, :, 0] > 0.0).sum())
        misfit = (fits.cost[at] - COST_MEAN * (count - 1.0)) / (COST_STD * np.sqrt(count))
        verdicts.append(
            Verdict(
                int(table.kind[at]), probability, int(table.known[at]), fits.place[at], fits.held[at],
                beliefs(fits.place[at], digest, known, book) if table.trials.is_wall[at] else no_holds(),
                float(misfit),
            )
        )  # fmt: skip
    return verdicts, shares


COST_MEAN, COST_STD = 3.56, 2.17
"""Mean and standard deviation of `(4 + 3) log(1 + chi^2 / 4)` for chi^2 with 3 degrees of freedom."""


def _amplitudes(table: Hypotheses, fits: Fits, digest: Digest, book: Book, scene: Scene) -> Floats:
    """(H,) log density of the tracks' mean amplitudes, given what walls leave and how points scatter."""
    radio, track = scene.radio, table.trials.track
    level, seen, rx = digest.log_amplitude[track], digest.mean[0][track], digest.mean[2][track]
    free = np.log(radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain) / (4.0 * np.pi * seen[:, 0]))
    has = table.known >= 0
    ratio = np.where(has, book.ratio[table.known], 0.0) if len(book.ident) else np.zeros(len(track))
    variance = np.where(has, book.ratio_variance[table.known], 0.0) if len(book.ident) else np.zeros(len(track))
    mirror = free + ratio + LEVELS.wall_ratio
    spread = variance + LEVELS.wall_ratio_std**2 + LEVELS.fading**2
    surplus = np.maximum(level - free - 0.2, 0.0)  # a mirror does not amplify
    wall = -0.5 * (level - mirror) ** 2 / spread - 0.5 * np.log(spread) - 20.0 * surplus**2
    reach = np.linalg.norm(fits.place - rx, axis=1)
    far = np.where(np.isin(table.kind, (POINT, OVER_TX)), reach, 0.5 * seen[:, 0])
    far = np.clip(far, 0.05, np.maximum(seen[:, 0] - 0.05, 0.06))
    unit = np.log(point_amplitude(np.ones(len(far)), np.maximum(seen[:, 0] - far, 0.05), far, radio))
    bounces = np.where(table.kind == OVER_SAME, 2.0, 1.0)
    mean = unit + np.log(LEVELS.strength) + ratio * bounces
    spread = LEVELS.strength_std**2 + variance * bounces**2 + LEVELS.fading**2
    point = -0.5 * (level - mean) ** 2 / spread - 0.5 * np.log(spread)
    double, wide = free + 2.0 * LEVELS.wall_ratio, 2.0 * LEVELS.wall_ratio_std**2 + LEVELS.fading**2
    pair = -0.5 * (level - double) ** 2 / wide - 0.5 * np.log(wide) - 20.0 * surplus**2
    return np.where(table.trials.is_wall, wall, np.where(table.trials.is_pair, pair, point))


def _opacity(table: Hypotheses, fits: Fits, digest: Digest, known: Known, book: Book) -> Floats:
    """(H,) log prior by what stands between the agent and the new feature, or the new wall and what is known."""
    middle, walls, wall = digest.middle, book.walls, table.trials.is_wall
    pair = table.trials.is_pair
    foot = np.where(wall[:, None], 0.5 * (fits.place + middle), fits.place)
    slack = DEPTH + 2.0 * np.sqrt(np.trace(fits.held, axis1=1, axis2=2))
    total = np.zeros(len(foot))
    span = fits.place - middle
    normal = span / np.maximum(np.linalg.norm(span, axis=1), 1e-6)[:, None]
    if len(walls):
        out = known.place[walls] - middle
        reach = np.linalg.norm(out, axis=1)
        feet = 0.5 * (known.place[walls] + middle)
        depth = foot @ (out / reach[:, None]).T - np.vecdot(feet, out) / reach
        total += BEHIND * (depth > np.minimum(slack, 1.0)[:, None]).sum(axis=1)
        before = normal @ feet.T - np.vecdot(foot, normal)[:, None]
        total += np.where(wall, BEHIND, 0.0) * (before > np.minimum(slack, 1.0)[:, None]).sum(axis=1)
    if len(book.points):
        depth = normal @ known.place[book.points].T - np.vecdot(foot, normal)[:, None]
        total += np.where(wall, BEHIND, 0.0) * (depth > np.minimum(slack, 1.0)[:, None]).sum(axis=1)
    return np.where(pair, 0.0, total)


def beliefs(place: Floats, digest: Digest, known: Known, book: Book) -> Holds:
    """What may be held beforehand of a wall at `place` (3,): upright, at right angles to another; or level."""
    span = place - digest.middle
    reach = max(float(np.linalg.norm(span)), 0.1)
    rise, std = abs(span[2]) / reach, LEVELS.lean * reach
    axes: list[Floats] = []
    log_odds: list[float] = []
    even = np.log(LEVELS.upright / (1.0 - LEVELS.upright))
    if rise > 0.9:
        axes += [AXES[0], AXES[1]]
        log_odds += 2 * [even + np.log(reach)]
    elif rise < 0.35:
        axes.append(AXES[2])
        log_odds.append(even + np.log(reach))
        others = known.place[book.walls] - digest.middle
        if len(others):
            flat = np.linalg.norm(others[:, :2], axis=1) > 0.95 * np.linalg.norm(others, axis=1)
            off = np.arctan2(others[flat, 1], others[flat, 0]) - np.arctan2(span[1], span[0])
            off = (off + np.pi / 4.0) % (np.pi / 2.0) - np.pi / 4.0
            if len(off) and np.min(np.abs(off)) < 0.15:
                aim = np.arctan2(span[1], span[0]) + off[np.argmin(np.abs(off))]
                axes.append(np.array([-np.sin(aim), np.cos(aim), 0.0]))
                log_odds.append(np.log(LEVELS.square / (1.0 - LEVELS.square)) + np.log(np.pi / 2.0 * reach))
    count = len(axes)
    axis = np.array(axes).reshape(count, 3)
    return Holds(
        np.zeros(count, dtype=np.int64), axis, axis @ digest.middle, np.full(count, std), np.array(log_odds),
        np.full(count, 0.5),
    )  # fmt: skip


def _upright(table: Hypotheses, fits: Fits, digest: Digest, known: Known, book: Book) -> Floats:
    """Gain (H,) in log evidence by what walls are beforehand: each direction held, or anywhere in its width."""
    gain = np.zeros(len(fits.cost))
    trials, tx = table.trials, digest.mean[1]
    for row in ((trials.is_wall | trials.is_pair) & np.isfinite(fits.cost)).nonzero()[0]:
        place, turn = fits.place[row], trials.turn[row, 0]
        if trials.is_pair[row]:  # what two walls do together goes across them both
            if turn[2, 2] < 0.0:
                continue  # an edge under the ceiling: any elevation
            at = tx[trials.track[row]]
            place = digest.middle + turn @ at + place - at
        holds = beliefs(place, digest, known, book)
        span = place - digest.middle
        variance = np.vecdot(holds.axis, holds.axis @ fits.covariance[row]) + holds.std**2
        log_right = -0.5 * (holds.axis @ span) ** 2 / variance - 0.5 * np.log(2.0 * np.pi * variance)
        # odds hold the width: right against a density of one over it
        each = np.logaddexp(0.0, holds.log_odds + log_right) - np.log1p(EVEN)
        gain[row] = (each[:1] if trials.is_pair[row] and turn[0, 0] < 0.0 else each).sum()
    return gain


EVEN = LEVELS.upright / (1.0 - LEVELS.upright)
"""Odds that a direction is as it is held to be."""


def wanted(verdict: Verdict, length: float) -> bool:
    """Whether a verdict is clear enough to enter the map: likely, a fit, and known well enough to be linear in."""
    if verdict.kind < 0 or verdict.kind == TWO_WALLS:
        return False
    holds = verdict.holds
    information = np.linalg.inv(verdict.covariance) + (holds.axis.T / holds.std**2) @ holds.axis
    worst = np.sqrt(1.0 / np.linalg.eigvalsh(information)[0])
    return bool(verdict.probability > LEVELS.born and verdict.misfit < LEVELS.fit and worst < 0.1 * length)
