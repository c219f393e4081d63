"""Births: tracks whose history only one hypothesis explains become features of the map."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.geometry.angles import unit
from rislam_rt.model import Body
from rislam_rt.slam.associate import squared_distance
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.moments import poses_of, square_root
from rislam_rt.slam.nested.belief_moments import Moments
from rislam_rt.slam.nested.birth_scheduling import PARALLEL, due_tracks
from rislam_rt.slam.nested.candidates import PredictedMeasurements, explained
from rislam_rt.slam.nested.hypotheses import (
    IMAGE,
    MOVING,
    POINT,
    RECIPROCAL,
    TWIN,
    Fit,
    History,
    fit_doubles,
    fit_feature,
    fit_floor,
    fit_reciprocal,
    initial_value,
    plausible,
    slack_of_height,
)
from rislam_rt.slam.nested.landmark_table import LandmarkTable, enter
from rislam_rt.slam.nested.mirrors import is_behind_mirror, mirror_images
from rislam_rt.slam.nested.tracks import LandmarkTracks, overstatement, panel_surplus
from rislam_rt.slam.observations import PANEL, UNTOLD, same_side
from rislam_rt.slam.returns import TX, Poses, Returns, compact, leg_images, observe

MAX_POINT_STD = 0.2
"""Largest standard deviation [m] of a new point along its worst axis."""
MAX_WALL_STD = 0.3
"""The same for the image of the anchor in a new wall (the floor's tilt is known beforehand and does not count)."""
BROAD = 10.0
"""Standard deviation [m] of a feature before its measurements."""
MAX_FLOOR_DEPTH = 1.5
"""Largest height [m] of the agent above the floor that it moves on."""
MOVING_RATIO, MOVING_SPREAD = np.log(0.6), 0.7
"""Log amplitude, over that of free space, expected of wall returns, and its standard deviation."""
WALL_CYCLES = 20
"""Cycles of history that a wall needs: two legs leave more room for error than one."""
PARENT_HITS = 10
"""Measurements of a point before walls are found by it."""
MIRROR_MARGIN = 0.1
"""Distance [m], beside twice the point's own error, by which it must lie nearer to an image of the agent."""


class BirthDecision(NamedTuple):
    """What a track is taken for."""

    kind: Returns
    parent: int
    """Feature row of the point, -1 without one."""
    fit: Fit
    upright: bool = False  # of a wall, as its returns do not tell


class BirthContext(NamedTuple):
    """What a judgement is based on, at the mean of the belief."""

    features: Floats
    """(F, 3)."""
    table: LandmarkTable
    anchor: Floats
    """(3,) where the agent is: the anchor of a wall born now."""
    predicted: PredictedMeasurements
    mirrored: Floats
    """(V, 3) [m] the agent's own images in walls, as its wall returns show them now."""
    config: SlamConfig


class Past(NamedTuple):
    """The last W poses at the mean of the belief; cycle k at row k % W."""

    position: Floats
    """(W, 3) [m]."""
    heading: Floats
    """(W,) [rad]."""
    time: Floats
    """(W,) [s]."""
    body: Body
    cycle: int
    """The present one."""


class Birth(NamedTuple):
    """A track that becomes a feature."""

    verdict: BirthDecision
    anchor: Floats
    """(3,) of the feature, if it is a wall."""
    slots: Integers
    """(K,) rows of the past that its measurements come from."""
    seen: Floats
    """(K, 3)."""
    std: Floats
    """(K, 3)."""
    log_grid: Floats | None = None
    """(G,) what its amplitudes told of its strength; None if they were not weighed."""
    log_ris: Floats | float = 0.0
    """(Q,) log odds of its being each of the panels."""

    @property
    def prior(self) -> Floats:
        """(3, 3) [m^2] what is known of it without its measurements: a floor is level, the rest is anywhere."""
        if self.verdict.kind is MOVING and self.verdict.upright:
            return np.diag([BROAD**2, BROAD**2, slack_of_height(self.verdict.fit.feature, self.anchor) ** 2])
        if self.verdict.kind is not RECIPROCAL:
            return BROAD**2 * np.eye(3)
        tilt = np.diag(self.verdict.fit.covariance)[:2]
        return np.diag([*tilt, BROAD**2])

    def enter(self, table: LandmarkTable) -> LandmarkTable:
        """The landmark table with the feature born in its last row."""
        parent = self.verdict.parent
        parent = int(table.ident[parent]) if parent >= 0 else -1
        table = enter(table, self.verdict.kind is not POINT, self.anchor, parent)
        if self.verdict.kind is not POINT or self.log_grid is None:
            return table
        log_grid, log_ris, most = table.log_grid.copy(), table.log_ris.copy(), CONSTANTS.max_log_ratio
        log_grid[-1], log_ris[-1] = self.log_grid, np.clip(self.log_ris, -most, most)
        return table._replace(log_grid=log_grid, log_ris=log_ris)


def examine(
    tracks: LandmarkTracks,
    moments: Moments,
    table: LandmarkTable,
    predicted: PredictedMeasurements,
    past: Past,
    free_space: float,
    threshold: float,
    config: SlamConfig,
) -> tuple[int, LandmarkTracks, Birth | None]:
    """Look at the tracks whose turn it is; at most one becomes a feature, as it may explain the others.

    Returns its row (-1 without one), the tracks (some now known for moving images), and the birth. `threshold`: SNR.
    """
    due = due_tracks(tracks, predicted, past.cycle, config)
    if not len(due):
        return -1, tracks, None
    scene = BirthContext(
        moments.features, table, moments.position, predicted, mirror_images(tracks, moments, table, past.body), config
    )
    moving = tracks.moving.copy()
    uncertainty = square_root(moments.covariance[:6, :6])
    for row in due:
        history, slots = track_history(tracks, row, past, uncertainty, free_space, threshold)
        if is_explained(tracks, row, history, scene):
            continue
        unknown = [panel for panel, holder in enumerate(table.holders) if holder < 0]
        if unknown:
            history = history._replace(panel=panel_surplus(float(tracks.log_ris[row, unknown].max())))
        verdict = None if tracks.specular[row] else judge(history, scene)
        if verdict is not None and verdict.kind is MOVING:
            moving[row] = True
        if moving[row] or tracks.specular[row]:
            verdict = judge_wall(history, scene) if config.use_vt else None
        if verdict is None or (verdict.kind is MOVING and not _sharp(verdict)):
            continue
        birth = Birth(
            verdict, scene.anchor, slots, history.seen, history.std, tracks.log_grid[row], tracks.log_ris[row]
        )
        return int(row), tracks._replace(moving=moving), birth
    return -1, tracks._replace(moving=moving), None


def track_history(
    tracks: LandmarkTracks, row: int, past: Past, uncertainty: Floats, free_space: float, threshold: float
) -> tuple[History, Integers]:
    """A track's measurements with the mean believed poses, and the rows of the past that they belong to.

    `pose_uncertainty` (6, D) is the square root of the pose's covariance, `free_space` the log amplitude after 1 m.
    """
    rows = (tracks.cycle[row] >= 0).nonzero()[0]
    poses = poses_of(past.position[rows], past.heading[rows], past.body)
    lag = past.time[past.cycle % len(past.time)] - past.time[rows]
    ratio = float(tracks.log_amplitude[row] - free_space + np.log(tracks.mean[row, 0, 0]))
    faint = overstatement(tracks, past.cycle, threshold)[row]
    seen, std = tracks.seen[row, rows], tracks.std[row, rows] * faint
    return History(seen, std, poses, lag, ratio, uncertainty, side=int(tracks.side[row])), rows


def is_explained(tracks: LandmarkTracks, row: int, history: History, scene: BirthContext) -> bool:
    """Whether a track needs no birth: a return of the map runs along its whole history."""
    covariance = np.diag(tracks.covariance[row, :, 0, 0] + np.mean(history.std**2, axis=0))
    near = explained(scene.predicted, tracks.mean[row, :, 0], covariance, scene.config.nested.gate, history.side)
    if not len(near):
        return False
    returns = compact(scene.predicted.expected.returns, near)
    seen = observe(returns, scene.features, scene.table.anchor, history.poses).seen
    spread = scene.predicted.covariance[near][None] + _diagonal(history.std**2)[:, None]
    gap = history.seen[:, None] - seen
    return bool(squared_distance(gap, spread)[0].mean(axis=0).min() < 6.0)


def judge(history: History, scene: BirthContext) -> BirthDecision | None:
    """The hypothesis that explains the history, if one does and no other comes near."""
    margin, verdicts = scene.config.nested.birth_margin, _points(history, scene)
    if len(history.seen) < WALL_CYCLES and not (verdicts and _promising(verdicts, history, scene)):
        return None
    verdicts += _images(history, scene)
    if not verdicts:
        return None
    best, clear = _best(verdicts, history, margin)
    if not clear and not _floor_wanted(history, scene):
        return None
    rival = _reciprocal_cost(history, scene)
    if rival < best.fit.cost + margin:
        return _floor(history, scene, min(rival, float(best.fit.cost)))
    if not clear:
        return None
    if best.kind is MOVING:
        return best
    if best.kind is POINT:
        return best if _is_fit_point(best, scene) else None
    ready = len(history.seen) >= WALL_CYCLES and best.parent in _established(scene.table, history.side)
    return best if _sharp(best) and ready else None


def _best(verdicts: list[BirthDecision], history: History, margin: float) -> tuple[BirthDecision, bool]:
    """The best hypothesis for a birth, the cheapest; whether it explains the history and no other comes near."""
    best, *others = sorted(verdicts, key=lambda v: float(v.fit.cost))
    clear = min((float(v.fit.cost - best.fit.cost) for v in others), default=np.inf) > margin
    return best, clear and plausible(best.fit, len(history.seen), 3)


def _promising(verdicts: list[BirthDecision], history: History, scene: BirthContext) -> bool:
    """Whether a history too short for walls may come to anything: images would only be rivals to the other kinds."""
    best, clear = _best(verdicts, history, scene.config.nested.birth_margin)
    return clear and (best.kind is MOVING or _is_fit_point(best, scene))


def _is_fit_point(verdict: BirthDecision, scene: BirthContext) -> bool:
    """Whether a point may enter the map: well known, and in the room as far as its walls are known."""
    margin = MIRROR_MARGIN + 2.0 * _worst_std(verdict)
    return _sharp(verdict) and not is_behind_mirror(verdict.fit.feature, scene.anchor, scene.mirrored, margin)


def judge_wall(history: History, scene: BirthContext) -> BirthDecision | None:
    """The wall that throws a wall return; upright, if that explains it as well as any lean would.

    It has to win over the images that two walls make together: until the agent has moved enough, they look alike.
    """
    start = initial_value(MOVING, None, scene.anchor, history)
    if start is None:
        return None
    free = fit_feature(MOVING, start, None, scene.anchor, history, 6)
    level = start * np.array([1.0, 1.0, 0.0]) + scene.anchor * np.array([0.0, 0.0, 1.0])
    if np.linalg.norm(level - scene.anchor) > 0.1:
        held = fit_feature(MOVING, level, None, scene.anchor, history, 6, slack_of_height(level, scene.anchor))
        if held.cost < free.cost + scene.config.nested.birth_margin and plausible(held, len(history.seen), 2):
            return BirthDecision(MOVING, -1, held, upright=True) if _is_single(held, history, scene) else None
    single = plausible(free, len(history.seen), 3) and _is_single(free, history, scene)
    return BirthDecision(MOVING, -1, free) if single else None


def _is_single(wall: Fit, history: History, scene: BirthContext) -> bool:
    """Whether the image is one wall's: behind no other mirror, as all images in two walls are, or no two explain it."""
    reach = np.linalg.norm(wall.feature - scene.anchor)
    nearer = np.linalg.norm(scene.mirrored - scene.anchor, axis=1) < reach - 2.0 * MIRROR_MARGIN
    if not is_behind_mirror(wall.feature, scene.anchor, scene.mirrored[nearer], 0.0):
        return True
    rivals = fit_doubles(wall.feature, scene.anchor, history)
    return min(float(rival.cost) for rival in rivals) > float(wall.cost) + scene.config.nested.birth_margin


def _sharp(verdict: BirthDecision) -> bool:
    """Whether a feature is known well enough for its birth along its worst axis."""
    limit = MAX_POINT_STD if verdict.kind is POINT else MAX_WALL_STD
    return _worst_std(verdict) < limit


def _worst_std(verdict: BirthDecision) -> float:
    """Standard deviation [m] of a feature to be born along its worst axis."""
    return float(np.sqrt(np.linalg.eigvalsh(verdict.fit.covariance)[-1]))


def _points(history: History, scene: BirthContext) -> list[BirthDecision]:
    """A static point, and a moving image; over the panel there are no moving images, and it is one point alone."""
    verdicts = []
    if history.side < PANEL or scene.table.holders[history.side - PANEL] < 0:
        start = initial_value(POINT, None, scene.anchor, history)
        if start is not None:
            fit = fit_feature(POINT, start, None, scene.anchor, history, 6)
            verdicts.append(BirthDecision(POINT, -1, fit._replace(cost=fit.cost - history.panel)))
    start = initial_value(MOVING, None, scene.anchor, history) if history.side < PANEL else None
    if start is not None:
        single = fit_feature(MOVING, start, None, scene.anchor, history, 6)
        fits = [single._replace(cost=single.cost + _dimness(history, 1))]
        fits += [f._replace(cost=f.cost + _dimness(history, 2)) for f in fit_doubles(start, scene.anchor, history)]
        verdicts.append(BirthDecision(MOVING, -1, min(fits, key=lambda fit: float(fit.cost))))
    return verdicts


def _dimness(history: History, walls: int) -> float:
    """What the strength tells against a moving image over so many walls, as chi^2."""
    return (history.ratio - walls * MOVING_RATIO) ** 2 / (walls * MOVING_SPREAD**2)


def _images(history: History, scene: BirthContext) -> list[BirthDecision]:
    """Images of known points in a new wall on the Rx leg that is to be born."""
    verdicts = []
    for kind in (IMAGE, TWIN):
        sources = _sources(scene.table, history.side)
        starts = {int(p): initial_value(kind, scene.features[p], scene.anchor, history) for p in sources}
        good = {p: start for p, start in starts.items() if start is not None}
        if kind is TWIN:  # a wall far from throwing both into one cell is not worth a fit
            good = {p: start for p, start in good.items() if _one_cell(start, scene.features[p], scene, history, 2.0)}
        if not good:
            continue
        parents, start = np.array(list(good)), np.array(list(good.values()))
        fits = fit_feature(kind, start, scene.features[parents], scene.anchor, history, 6)
        for parent, fit in zip(parents, map(Fit._make, zip(*fits, strict=True)), strict=True):
            if kind is IMAGE or _one_cell(fit.feature, scene.features[parent], scene, history, 1.1):
                verdicts.append(BirthDecision(kind, int(parent), fit))
    return verdicts


def _sources(table: LandmarkTable, side: int) -> Integers:
    """Points whose paths are on one side: those that may be the panel, or may be none."""
    points, held = table.points, table.holders
    if side == UNTOLD:
        return points
    return points[points == held[side - PANEL]] if side >= PANEL else points[~np.isin(points, held)]


def _one_cell(wall: Floats, parent: Floats, scene: BirthContext, history: History, cells: float) -> bool:
    """Whether a wall to be born would throw both its returns within so many cells, halfway through the history."""
    middle = len(history.seen) // 2
    poses = Poses(history.poses.tx[middle], history.poses.rx[middle], history.poses.heading[middle])
    seen = observe(TWIN, np.stack([wall, parent]), np.stack([scene.anchor, scene.anchor]), poses).seen
    return bool(np.all(np.abs(seen[0] - seen[1]) < cells * scene.predicted.cell))


def _established(table: LandmarkTable, side: int) -> Integers:
    """Points of a side that are known well enough for births of their images."""
    points = _sources(table, side)
    return points[table.hits[points] >= PARENT_HITS]


def _reciprocal_cost(history: History, scene: BirthContext) -> float:
    """How well an unknown Tx leg to a known image fits, if the track comes from that image's direction.

    What arrives from where something is already known to be, only later, is most likely the same thing over a wall.
    """
    returns = scene.predicted.expected.returns
    known = (returns.point != TX) & same_side(np.array([history.side]), scene.predicted.side)[0]
    rows = np.unique(returns.rx[known]) if len(returns.tx) else np.zeros(0, dtype=np.int64)
    if not len(rows):
        return np.inf
    poses = history.poses
    images = leg_images(returns, scene.features, scene.table.anchor, poses.tx.mean(axis=0))[rows]
    fixed = Returns(np.stack([np.arange(len(rows)), np.full(len(rows), -1), np.full(len(rows), -1)], axis=1),
                    np.arange(len(rows)), np.arange(len(rows)))  # fmt: skip
    seen = observe(fixed, images, images, poses).seen[..., 1:].mean(axis=0)
    weight = 1.0 / history.std[:, 1:] ** 2
    mean = np.sum(weight * history.seen[:, 1:], axis=0) / weight.sum(axis=0)
    spread = np.hypot(1.0 / np.sqrt(weight.sum(axis=0)), 0.02)
    along = np.all(np.abs(seen - mean) < PARALLEL * spread, axis=1)
    fits = [fit_reciprocal(image, scene.anchor, history) for image in images[along]]
    return min((float(fit.cost) for fit in fits if fit is not None), default=np.inf)


def _floor_wanted(history: History, scene: BirthContext) -> bool:
    """Whether the map has no floor yet and the history is long enough to give one."""
    level = np.abs(unit(scene.features - scene.table.anchor)[:, 2]) > 0.9
    below = level & (scene.features[:, 2] < scene.anchor[2]) & scene.table.is_wall
    return len(history.seen) >= WALL_CYCLES and not below.any()


def _floor(history: History, scene: BirthContext, rival: float) -> BirthDecision | None:
    """The floor under a known point, if it fits as well as any wall that one could choose freely."""
    if not _floor_wanted(history, scene):
        return None
    fits = [
        (int(p), fit_floor(scene.features[p], scene.anchor, history)) for p in _established(scene.table, history.side)
    ]
    verdicts = [BirthDecision(RECIPROCAL, parent, fit) for parent, fit in fits if fit is not None]
    if not verdicts:
        return None
    best = min(verdicts, key=lambda v: float(v.fit.cost))
    as_good = best.fit.cost < rival + scene.config.nested.birth_margin
    depth = 0.5 * float(scene.anchor[2] - best.fit.feature[2])
    sharp = best.fit.covariance[2, 2] < MAX_WALL_STD**2 and depth < MAX_FLOOR_DEPTH
    return best if as_good and sharp and plausible(best.fit, len(history.seen), 1) else None


def _diagonal(variance: Floats) -> Floats:
    """(K, 3, 3) diagonal matrices."""
    return variance[..., None] * np.eye(3)
