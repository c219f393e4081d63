"""Filter of Channel-SLAM by delays alone: a tracker labels the ranges, and each label has a virtual transmitter.

Source: Gentner et al., "Multipath assisted positioning with simultaneous localization and mapping", IEEE TWC 2016. As
there, labels are taken as known, there is no model of detection, and a path that ends takes its virtual transmitter
with it. Unlike there, no transmitter stands in the room: both ends move with the agent, so that a virtual transmitter
is a point `a` at range `|p_T - a| + |a - p_R|`. Gaussian sums stand in for the particles of a virtual transmitter
(Ulmschneider, Gentner, Jost and Dammann, 2018), and a Gaussian over the trajectory for those of the agent: a hundred
particles, resampled, keep one trajectory and forget what delays never told (see `shared.gauge`).
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, take_rows
from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel, SlamEstimate
from rislam_rt.slam.input_checks import check_step
from rislam_rt.slam.schemes.channel_slam import tracker
from rislam_rt.slam.schemes.channel_slam.config import ChannelSlamConfig
from rislam_rt.slam.schemes.channel_slam.tracker import RangeTracks, assign, follow, no_tracks
from rislam_rt.slam.schemes.shared import gaussian_sums
from rislam_rt.slam.schemes.shared.delay_agent import DelayAgent, begin_agent, hear_ranges, move_agent, reported
from rislam_rt.slam.schemes.shared.loopy_association import Association
from rislam_rt.slam.schemes.shared.ranges import Bistatic, Scan
from rislam_rt.slam.schemes.shared.report import ahead_of, known_points, outcome_of
from rislam_rt.slam.schemes.shared.sum_correction import absorb
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.step_info import REMOVED, UNUSED, StepInfo

STRAIN_RATE = 0.1
"""Weight of the latest cycle in the running means of squared innovations."""


class ChannelSlamState(NamedTuple):
    """State of Channel-SLAM: the agent, the tracks of ranges, and the virtual transmitters."""

    agent: DelayAgent
    """The agent: trajectory, height, heading, body and receiver."""
    sums: gaussian_sums.Sums
    """Gaussian sums of the virtual transmitters; `ident` is the label of the path."""
    tracks: RangeTracks
    """Tracks of ranges by label."""
    strains: dict[int, float]
    """Running mean of the squared normalised innovation of every virtual transmitter, by label."""
    next_label: int
    """Label of the next new track."""


def init(
    start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: ChannelSlamConfig, *,
    rng: np.random.Generator,
) -> ChannelSlamState:  # fmt: skip
    """State of Channel-SLAM before the first cycle: the start prior, no paths. `ris` is not used; nothing is drawn."""
    agent = begin_agent(start, int(config.axes.sum()), body, sensor)
    return ChannelSlamState(agent, gaussian_sums.no_sums(len(agent.course.mean)), no_tracks(), {}, 0)


def predict(state: ChannelSlamState, dt: float, config: ChannelSlamConfig) -> SlamEstimate:
    """Estimate of Channel-SLAM predicted `dt` [s] ahead at constant velocity without noise."""
    return ahead_of(estimate(state, config), dt)


def step(
    state: ChannelSlamState, measurement: Measurement, code: RisCode | None, dt: float, heading: float,
    config: ChannelSlamConfig, *, rng: np.random.Generator,
) -> tuple[ChannelSlamState, StepInfo]:  # fmt: skip
    """Advance Channel-SLAM by one cycle: `dt` [s] since the last, `heading` [rad]. `code` and `rng` are not used.

    Raises
    ------
    ConfigError
        Time step or heading is no number.
    """
    check_step(dt, heading)
    state = _move(state, dt, config)
    state = state._replace(agent=state.agent._replace(heading=float(heading)))
    rows, scan, strong, model = hear_ranges(state.agent, measurement, config)
    state, label = _label(state, scan, dt, config)
    state, squares = _correct(state, label, scan, model, config)
    state = _give_birth(state, label, scan, strong, config)
    nis, dof = float(squares.sum()), len(squares)
    agent = state.agent.strained(nis, dof, 0.5 * STRAIN_RATE)
    landmark = np.full(len(measurement), REMOVED)
    landmark[rows] = np.where(np.isin(label, state.sums.ident), label, UNUSED)
    shown = len(state.sums.ident)
    report = StepInfo(landmark, 1.0, False, nis, dof, 0.0, shown, outcome_of(len(measurement), shown, agent.strain))
    return state._replace(agent=agent), report


def estimate(state: ChannelSlamState, config: ChannelSlamConfig) -> SlamEstimate:
    """Estimate of Channel-SLAM: moments and samples of the pose, and virtual transmitters whose place is known."""
    found = known_points(state.sums, 0.5)
    clear = np.trace(found.covariance, axis1=1, axis2=2) < config.shown_std**2
    return reported(state.agent, take_rows(found, clear), config.num_samples)


def _move(state: ChannelSlamState, dt: float, config: ChannelSlamConfig) -> ChannelSlamState:
    """Predict Channel-SLAM's agent and virtual transmitters over `dt` [s]; every `course_stride`-th state is kept."""
    if dt == 0.0:
        return state
    agent, step = move_agent(state.agent, dt, config.sigma_a, config.course_stride)
    return state._replace(agent=agent, sums=gaussian_sums.carry(state.sums, step, config.wander))


def _label(
    state: ChannelSlamState, scan: Scan, dt: float, config: ChannelSlamConfig
) -> tuple[ChannelSlamState, Integers]:
    """Channel-SLAM's state with tracks after a scan, without transmitters of ended ones, and ranges' labels (M,)."""
    tracks = tracker.advance(state.tracks, dt, config.range_acceleration)
    found = assign(tracks, scan.length, scan.std, config.gate)
    speed = float(np.linalg.norm(state.agent.pose[1]))
    tracks, label = follow(tracks, found, scan.length, scan.std, 2.0 * speed + 0.02, state.next_label)
    patience = np.where(tracks.hits >= config.confirm_hits, config.max_misses, 1)
    tracks = take_rows(tracks, tracks.misses <= patience)
    first = max(state.next_label, int(label.max(initial=-1)) + 1)
    state = state._replace(tracks=tracks, next_label=first)
    return _keep(state, np.isin(state.sums.ident, tracks.label), config), label


def _keep(state: ChannelSlamState, rows: Booleans, config: ChannelSlamConfig) -> ChannelSlamState:
    """Channel-SLAM's state with some of its virtual transmitters, and without Gaussians of small share."""
    sums = state.sums._replace(existence=np.where(rows, 1.0, 0.0))
    sums = gaussian_sums.prune(sums, 0.5, config.share_threshold, config.max_paths)
    present = set(sums.ident.tolist())
    strains = {name: value for name, value in state.strains.items() if name in present}
    return state._replace(sums=sums, strains=strains)


def _correct(
    state: ChannelSlamState, label: Integers, scan: Scan, model: Bistatic, config: ChannelSlamConfig
) -> tuple[ChannelSlamState, Floats]:
    """Channel-SLAM's state and squared innovations after a scan's ranges; transmitters that long misfit are dropped."""
    agent = state.agent
    sight = gaussian_sums.predict_ranges(state.sums, agent.course, agent.pose[0], model)
    own = (state.sums.ident[:, None] == label).astype(float)
    hit, shown = np.nonzero(own)
    mean, variance = gaussian_sums.range_moments(state.sums, sight, agent.course)
    squares = (scan.length[shown] - mean[hit]) ** 2 / (variance[hit] + scan.std[shown] ** 2)
    missed = 1.0 - own.sum(axis=1, keepdims=True)
    found = Association(own, np.concatenate([own, missed], axis=1), 1.0 - own.sum(axis=0))
    sums, course = absorb(state.sums, sight, agent.course, scan, found, config.odds)
    strains = dict(state.strains)
    for name, square in zip(sums.ident[hit].tolist(), squares.tolist(), strict=True):
        strains[name] = strains.get(name, 1.0) + STRAIN_RATE * (square - strains.get(name, 1.0))
    fit = np.array([strains.get(name, 1.0) <= config.strain_limit for name in sums.ident.tolist()], dtype=bool)
    return _keep(state._replace(sums=sums, agent=agent._replace(course=course), strains=strains), fit, config), squares


def _give_birth(
    state: ChannelSlamState, label: Integers, scan: Scan, strong: Booleans, config: ChannelSlamConfig
) -> ChannelSlamState:
    """Channel-SLAM's state with new virtual transmitters for confirmed tracks seen now, at most `max_paths` in all."""
    ready = state.tracks.label[(state.tracks.hits >= config.confirm_hits) & (state.tracks.misses == 0)]
    rows = np.flatnonzero(np.isin(label, ready) & ~np.isin(label, state.sums.ident))
    rows = rows[np.argsort(label[rows])][: config.max_paths - len(state.sums.ident)]
    sums = state.sums
    for row in rows:
        one = slice(row, row + 1)
        new = gaussian_sums.born(
            scan.length[one], scan.std[one], gaussian_sums.kinds_of(strong[one], config.wanderers), np.ones(1),
            state.agent.course, state.agent.pose[0], config.birth_turns, int(label[row]),
        )  # fmt: skip
        sums = gaussian_sums.join(sums, new)
    return state._replace(sums=sums)
