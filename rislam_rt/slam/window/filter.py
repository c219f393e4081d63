"""One cycle of the window filter: predict, expect, associate, solve, learn, births and deaths."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel
from rislam_rt.slam.config import SlamConfig, StartPrior
from rislam_rt.slam.filter import REMOVED, UNUSED, Outcome, StepInfo, glance_of, is_los, stranger_density
from rislam_rt.slam.inputs import check_sides, check_step
from rislam_rt.slam.returns import TX
from rislam_rt.slam.tracks import Glance
from rislam_rt.slam.window import doubt, gauss, motion, tracks
from rislam_rt.slam.window.births import births
from rislam_rt.slam.window.book import Book, empty_book, idents, image_ident
from rislam_rt.slam.window.context import Context
from rislam_rt.slam.window.expect import Clusters, Expected, Scene, conditioned_share
from rislam_rt.slam.window.gauss import Window
from rislam_rt.slam.window.learn import Sights, learn, no_sights
from rislam_rt.slam.window.levels import LEVELS
from rislam_rt.slam.window.log import Log, Residuals, append, empty_log, renew
from rislam_rt.slam.window.look import Look, echoes, look
from rislam_rt.slam.window.retract import condemned, release
from rislam_rt.slam.window.suspect import weigh_tracks
from rislam_rt.slam.window.tracks import Tracks

REFRESH = 5
"""Cycles between two re-linearisations of the whole window."""


class WindowState(NamedTuple):
    """All that the filter knows."""

    cycle: int
    config: SlamConfig
    window: Window
    book: Book
    log: Log
    tracks: Tracks
    sights: Sights
    gait: Floats
    """(2, L) probabilities of the liveliness of the step before the window's first, across and upwards; (3, L) with
    the rate of turn, where the heading is not known."""
    level: Floats
    """(2, L) or (3, L) of the last step's, filtered."""
    heading: Floats
    """(K,) [rad] that the compass told; where it is not asked, what offsets are against."""
    shift: Floats
    """(3,) [m] standard deviation of the start's position: what no measurement tells."""
    scene: Scene
    doubt: float
    """Log odds that the agent is lost: that the map explains nothing of what is heard (see `doubt`)."""
    asked: bool
    """Whether the first tracks told that the start is another."""
    turned: float
    """[rad] by which the compass was found to be wrong."""
    codes: tuple[RisCode | None, ...]
    """(K,) as the agent believes they were applied."""
    passed: Floats
    """(P, 3) [m] positions that left the window, each with the hindsight of its whole length."""


def init(
    start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: SlamConfig,
    *, rng: np.random.Generator,
) -> WindowState:  # fmt: skip
    """The start prior, and an empty map."""
    free = np.array([1.0, 1.0, float(config.height == "estimated")])
    offset = start.heading_std if config.heading == "estimated" else 0.0
    axes = np.arange(3) if config.heading == "known" else np.append(np.arange(3), gauss.TURN)
    std = np.concatenate([np.full(3, 1e-5), start.velocity_std * free, [offset]])
    window = gauss.begin(start.position, start.velocity, axes, std)
    scene = Scene(body, sensor.radio, sensor, ris, config.max_bounces, config.use_vt)
    # what turns at all does so by ten times what a random walk of the heading tells in a cycle
    lively = (config.sigma_a, 0.0, *((10.0 * config.turn_std,) if gauss.TURN in axes else ()))
    gait = np.stack([motion.first_gait(level) for level in lively])
    return WindowState(
        0, config, window, empty_book(scene.num_panels), empty_log(), tracks.no_tracks(scene.num_panels), no_sights(),
        gait, gait,
        np.array([start.heading]), start.position_std * free, scene, doubt.SURE, False, 0.0,
        (None,), np.zeros((0, 3)),
    )  # fmt: skip


def step(
    state: WindowState, measurement: Measurement, code: RisCode | None, dt: float, heading: float, config: SlamConfig,
    *, rng: np.random.Generator,
) -> tuple[WindowState, StepInfo]:  # fmt: skip
    """Advance by one cycle: `dt` [s] since the last, `heading` [rad], `code` as the agent believes it was applied."""
    check_step(dt, heading, code, state.scene.ris)
    check_sides(measurement, state.scene.ris)
    if config.heading != "known":
        heading = float(state.heading[-1])
    else:
        heading += state.turned
    turn = heading - float(state.heading[-1])
    state = _move(state, dt, heading)
    state = state._replace(codes=(*state.codes, code)[-state.window.num_poses :])
    scene, book = state.scene, state.book
    glance = glance_of(measurement, scene.radio)
    landmark = np.where(is_los(glance, scene.body), REMOVED, UNUSED)
    order = np.lexsort(glance.seen.T[::-1])
    free = order[landmark[order] == UNUSED]
    free = free[~echoes(glance.take(free), scene.sensor.cell_length)]
    glance = glance.take(free)

    strangers = stranger_density(glance, scene.sensor, config.new_density)
    state, view = _notice(state, heading, code, glance, strangers)
    mean, poses, expected, groups = view.mean, view.poses, view.expected, view.groups
    shows, scatter, row, pick = view.shows, view.scatter, view.row, view.pick
    bend = np.sqrt(float(motion.expected_variance(state.level[0] @ motion.transition(LEVELS.stay))))

    log = append(state.log, glance, state.cycle, state.cycle - state.window.num_poses + 1)
    # wall returns that are thrown away are known for what they are, and move nothing
    used = np.ones(len(row), dtype=np.bool_) if config.use_vt else expected.forms[groups.leader[row], 0] != TX
    log = _explain(log, expected, groups, book, scatter, row[used], pick[used], len(glance.seen))
    state = state._replace(log=log)
    state, left, nis = _solve(state)
    raw = scatter[groups.leader[row]]
    raw[used] = _squares(left, log, len(log.cycle) - len(glance.seen) + pick[used])

    taken = np.zeros(len(glance.seen), dtype=np.bool_)
    taken[pick] = True
    turn += float(np.diff(gauss.poses(state.window)[-2:, 3]).sum())
    followed = _follow(state, mean, glance, (~taken).nonzero()[0], dt, turn, bend)
    state = state._replace(tracks=followed.tracks, log=followed.log)
    jumped = state.doubt == 0.0
    if len(expected.seen) and len(glance.seen):
        state = state._replace(doubt=doubt.advance(state.doubt, view.score, len(glance.seen), followed.fresh))
    if min(book.panels) < 0:  # once all are known, no track needs to be one
        state = state._replace(tracks=weigh_tracks(state.tracks, state.cycle, poses, scene, code))
    sights, book = learn(
        state.sights, book, state.window, expected, groups, shows, row, pick, raw, glance, poses, scene, code
    )
    state = state._replace(sights=sights, book=book)
    landmark[free[pick]] = np.where(used, _names(state.book, expected, groups, row), REMOVED)

    state, wrong = _ask(state)
    context = Context(
        state.window, state.book, state.log, state.tracks, state.heading, scene, state.cycle, state.sights, state.codes
    )  # fmt: skip
    if state.cycle % REFRESH == 0 and len(book.ident):
        gone = condemned(context.book, left, context.log, expected, gauss.now(context.window)[1])
        context, fresh = release(context, ~gone), not gone.any()
    else:
        fresh = True
    if fresh:
        context = births(context, expected, groups)
    state = state._replace(
        window=context.window, book=context.book, log=context.log, tracks=context.tracks, sights=context.sights
    )  # fmt: skip
    outcome = _outcome(len(measurement), len(state.book.ident), wrong or jumped or state.doubt >= 0.0)
    if doubt.is_lost(state.doubt) and len(state.book.ident):
        state = _restart(state)
    info = StepInfo(landmark, 1.0, False, nis, 3 * len(row), 0.0, len(state.book.points), outcome)
    return state._replace(cycle=state.cycle + 1), info


def _ask(state: WindowState) -> tuple[WindowState, bool]:
    """Whether the picture moves as the agent is told; before anything is born, the start as the tracks would have it."""
    if len(state.level) > 2 or len(state.heading) != state.window.num_poses:
        return state, False
    if len(state.book.ident):
        if state.cycle % doubt.PAST == 0:
            lively = float(np.sqrt(motion.expected_variance(state.level[0])))
            odds = doubt.ask_picture(state.window, state.log, state.heading, lively)
            state = state._replace(doubt=float(np.clip(state.doubt + odds, doubt.SURE, -doubt.SURE)))
        return state, False
    told = None if state.asked else doubt.ask_tracks(state.window, state.log, state.heading)
    if told is None or told.log_odds <= 0.0:
        return state, False
    state = state._replace(asked=True)
    if not told.is_compass:
        return state._replace(window=doubt.with_velocity(state.window, told.velocity, told.std)), True
    window = doubt.with_free_compass(state.window, told.std / np.linalg.norm(told.velocity))
    turned = state.turned + told.turn
    return state._replace(window=window, heading=state.heading + told.turn, turned=turned), True


def _restart(state: WindowState) -> WindowState:
    """The pose that is kept, with what it may be off by beside it, and nothing else."""
    window = state.window
    mean, covariance = gauss.now(window)
    lively = np.sqrt(motion.expected_variance(state.level))[[0, 0, 1]]
    std = np.sqrt(np.concatenate([np.full(3, 1e-10), np.diag(covariance)[3:6] + lively**2, [covariance[6, 6]]]))
    away = doubt.JUMP * np.array([1.0, 1.0, float(state.config.height == "estimated")])
    fresh = gauss.begin(mean[:3], mean[3:6], window.axes, std)
    if gauss.TURN in window.axes:
        fresh = fresh._replace(head=mean[:gauss.HEAD])
    return state._replace(
        window=fresh, book=empty_book(state.scene.num_panels)._replace(next_ident=state.book.next_ident),
        log=empty_log(), tracks=tracks.no_tracks(state.scene.num_panels), sights=no_sights(), gait=state.level,
        heading=state.heading[-1:], shift=np.hypot(state.shift, away), doubt=0.0, asked=False,
        codes=state.codes[-1:], passed=np.concatenate([state.passed, gauss.poses(window)[:-1, :3]]),
    )  # fmt: skip


def _move(state: WindowState, dt: float, heading: float) -> WindowState:
    """The window with a new pose, without its oldest one when it is full."""
    if dt <= 0.0 and state.cycle == 0:
        return state._replace(heading=np.array([heading]))
    window, gait, headings, passed = state.window, state.gait, state.heading, state.passed
    while window.num_poses >= LEVELS.window:
        gait = np.stack([smoothed[1][0] for smoothed in _liveliness(window, gait)])
        passed = np.concatenate([passed, window.head[None, :3]])
        window, headings = gauss.slide(window), headings[1:]
    level = state.level @ motion.transition(LEVELS.stay)
    columns = COLUMNS[: len(window.axes)]
    window = gauss.extend(window, dt, np.array([motion.prior_precision(level[group], group == 2) for group in columns]))
    return state._replace(window=window, gait=gait, heading=np.append(headings, heading), passed=passed)


def smoothed(state: WindowState) -> Floats:
    """(K, 3) [m] positions of all cycles with hindsight: of the window's length, less for the last ones."""
    return np.concatenate([state.passed, gauss.poses(state.window)[:, :3]])


START = ((3, 0.5), (10, 1.0))
"""Steps that may have been livelier than thought, and standard deviation [m/s^2] of their accelerations then."""
LOG_START = np.log(0.01)
"""Log probability of a manoeuvre that nothing announced."""
MISSED, STRAINED = 1.5, 1.5
"""Standard deviations by which fewer returns show than should, and mean square of their innovations, from which on a
manoeuvre is looked for."""


def _notice(
    state: WindowState, heading: float, code: RisCode | None, glance: Glance, strangers: Floats
) -> tuple[WindowState, Look]:
    """What is seen, and the belief that explains it best: as it was, with a manoeuvre in the last steps, or a jump.

    A jump has to explain the cycle better than being lost does, which explains nothing.
    """

    def view_of(window: Window) -> Look:
        return look(window, state.book, state.sights, heading, state.scene, code, glance, strangers)

    best, window = view_of(state.window), state.window
    if (best.surprise > MISSED or best.strain > STRAINED) and len(state.window.step):
        for steps, liveliness in START:
            precision = state.window.precision.copy()
            lively = COLUMNS[: precision.shape[1]] != 1
            precision[-steps:, lively] = np.minimum(precision[-steps:, lively], liveliness**-2.0)
            trial = gauss.solve(state.window._replace(precision=precision))
            view = view_of(trial)
            if view.score + LOG_START > best.score:
                best, window = view, trial
    if best.surprise > MISSED and (state.window.step[-2:] > 0.0).sum() == 2:
        by = doubt.jump(best, glance)
        view = view_of(doubt.shifted(state.window, by)) if by.any() else best
        if view.score + doubt.LOG_JUMP > max(best.score, doubt.SURE):
            return _landed(state, by), view
    return state._replace(window=window), best


def _landed(state: WindowState, by: Floats) -> WindowState:
    """After a jump: the last pose alone, with the map; held for lost until the next cycle agrees."""
    passed = np.concatenate([state.passed, gauss.poses(state.window)[:-1, :3]])
    return state._replace(
        window=doubt.landed(state.window, by), gait=state.level, heading=state.heading[-1:], codes=state.codes[-1:],
        passed=passed, doubt=0.0,
    )  # fmt: skip


GROUPS = (np.array([0, 1]), np.array([2]), np.array([gauss.TURN]))
"""Axes that are as lively as each other: an agent that turns does not climb."""
COLUMNS = np.array([0, 0, 1, 2])
"""Group of each axis."""


def _liveliness(window: Window, gait: Floats) -> list[tuple[Floats, Floats]]:
    """Posterior and filtered probabilities (K - 1, L) of each group's levels."""
    size, free = len(window.head), len(window.axes)
    count = len(window.accel)
    block = window.covariance[size:, size:].reshape(count, free, count, free)[np.arange(count), :, np.arange(count)]
    found = []
    for group, before in zip(GROUPS[: len(gait)], gait, strict=True):
        inside = block[:, group[:, None], group]
        like = motion.log_likelihood(window.accel[:, group], inside, window.precision[:, group[0]])
        found.append(motion.smooth(before, like, LEVELS.stay))
    return found


def _explain(
    log: Log,
    expected: Expected,
    groups: Clusters,
    book: Book,
    scatter: Floats,
    row: Integers,
    pick: Integers,
    count: int,
) -> Log:
    """The log's last `count` components with what they were taken for."""
    if not len(row):
        return log
    at = len(log.cycle) - count + pick
    lead, mate = groups.leader[row], groups.partner[row]
    share, variance = conditioned_share(groups, expected, row, log.log_amplitude[at], log.log_amplitude_std[at])
    form, shares, extra = log.form.copy(), log.share.copy(), log.extra.copy()
    form[at, 0] = idents(book, expected.forms[lead])
    both = mate >= 0
    form[at[both], 1] = idents(book, expected.forms[mate[both]])
    gap = np.where(both[:, None], expected.seen[mate] - expected.seen[lead], 0.0)
    shares[at], extra[at] = np.where(both, share, 0.0), groups.disturbance[row] + variance[:, None] * gap**2
    extra[at] += LEVELS.memory * (np.maximum(scatter[lead], 1.0) - 1.0)[:, None] * log.std[at] ** 2
    return log._replace(form=form, share=shares, extra=extra)


def _squares(left: Residuals, log: Log, rows: Integers) -> Floats:
    """Mean squares (A,) of the residuals of some explained rows of the log, in reported deviations."""
    if not len(rows):
        return np.zeros(0)
    at = np.searchsorted(left.row, rows)
    return np.asarray(np.mean(left.left[at] ** 2 * (1.0 + log.extra[rows] / log.std[rows] ** 2), axis=1))


def _solve(state: WindowState) -> tuple[WindowState, Residuals, float]:
    """The window after this cycle's components: two Gauss-Newton steps; the whole of it again now and then."""
    window, log, book, body = state.window, state.log, state.book, state.scene.body
    last = np.array([window.num_poses - 1])
    window, found = renew(window, log, book, body, state.heading, last, even=True)
    nis = float(np.sum(found.left**2))
    window = gauss.solve(window)
    slots = np.arange(window.num_poses) if state.cycle % REFRESH == 0 else last
    window, left = renew(window, log, book, body, state.heading, slots)
    window = gauss.weigh_holds(gauss.solve(window))
    return liven(state._replace(window=window)), left, nis


def liven(state: WindowState) -> WindowState:
    """The prior of every step's acceleration, by what the measurements say of its liveliness."""
    window = state.window
    if not len(window.accel):
        return state
    found = _liveliness(window, state.gait)
    columns = COLUMNS[: len(window.axes)]
    fresh = np.stack([motion.prior_precision(found[group][0], group == 2) for group in columns], axis=1)
    # all steps at once, each as if the others were settled: damped, or they would take turns
    precision = np.exp((1.0 - DAMPING) * np.log(window.precision) + DAMPING * np.log(fresh))
    level = np.stack([filtered[-1] for _, filtered in found])
    return state._replace(window=window._replace(precision=precision), level=level)


DAMPING = 0.3
"""Share of the new in each step's log precision."""


class _Followed(NamedTuple):
    tracks: Tracks
    log: Log
    fresh: int
    """Components that continue nothing."""


def _follow(
    state: WindowState, mean: Floats, glance: Glance, free: Integers, dt: float, turn: float, bend: float
) -> _Followed:
    """Tracks extended, begun and ended by the components that nothing explains."""
    speed = float(np.linalg.norm(mean[3:6]))
    length = np.maximum(state.tracks.mean[:, 0, 0], 0.5) if len(state.tracks.ident) else np.ones(1)
    drift = np.array([2.0 * bend + speed**2, 0.1, 0.1]) if len(length) else np.zeros(3)
    found = tracks.advance(state.tracks, dt, turn, drift)
    rows, picks = tracks.match(found, glance, free, state.cycle)
    found = tracks.extend(found, rows, glance, picks, state.cycle)
    spare = np.setdiff1d(free, picks)
    reach = np.maximum(glance.seen[spare, 0], 0.5)
    rate = np.stack([np.full(len(spare), 2.0), 2.0 / reach, 2.0 / reach], axis=1) * (speed + 0.05)
    if len(state.level) > 2:  # what turns without a compass turns all that it sees
        rate[:, 1:] += np.sqrt(motion.expected_variance(state.level[2]))
    found, fresh = tracks.start(found, glance, spare, rate, state.cycle)
    base = len(state.log.cycle) - len(glance.seen)
    track = state.log.track.copy()
    track[base + picks], track[base + spare] = found.ident[rows], fresh
    return _Followed(found.keep(tracks.alive(found, state.cycle)), state.log._replace(track=track), len(spare))


def _names(book: Book, expected: Expected, groups: Clusters, row: Integers) -> Integers:
    """Ident of what each of the clusters `row` (A,) came over first: a point, its image in a wall, a wall."""
    if not len(row):
        return np.zeros(0, dtype=np.int64)
    forms = expected.forms[groups.leader[row]]
    wall = np.where(forms[:, 3] >= 0, forms[:, 3], forms[:, 1])
    own = book.ident[np.where(forms[:, 0] >= 0, forms[:, 0], wall)]
    image = (forms[:, 0] >= 0) & (wall >= 0)
    return np.where(image, image_ident(own, book.ident[wall]), own)


def _outcome(heard: int, features: int, lost: bool) -> Outcome:
    if not heard:
        return Outcome.NO_MEASUREMENTS
    if lost:
        return Outcome.DIVERGED
    return Outcome.OK if features else Outcome.NO_LANDMARKS
