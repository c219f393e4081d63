"""Filter of BP-SLAM by delays alone; the agent carries both ends: ranges `|p_T - a| + |a - p_R|`, heading known.

Same functions, inputs and outputs as the package's own filter, so that a run can lead either. The panel and its code
mean nothing to it, and angles of arrival are not used.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel, SlamEstimate
from rislam_rt.slam.input_checks import check_step
from rislam_rt.slam.schemes.bp_slam.config import BpSlamConfig
from rislam_rt.slam.schemes.shared import gaussian_sums
from rislam_rt.slam.schemes.shared.delay_agent import DelayAgent, begin_agent, hear_ranges, move_agent, reported
from rislam_rt.slam.schemes.shared.loopy_association import Association
from rislam_rt.slam.schemes.shared.ranges import Odds, Scan, birth_ratio
from rislam_rt.slam.schemes.shared.report import ahead_of, known_points, outcome_of
from rislam_rt.slam.schemes.shared.sum_correction import absorb, claims, newborn
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.step_info import REMOVED, UNUSED, StepInfo

FEWEST_FALSE = 1e-3
"""Least mean number of false ranges in a scan, so that no range is ever held for certain."""
FIRST_DETECTION = 0.95
"""Probability that a feature which comes into view for the first time is measured, as published."""
STRAIN_RATE = 0.05
"""Weight of the latest cycle in the running mean of the NIS."""


class BpSlamState(NamedTuple):
    """State of BP-SLAM by delays: the agent, and the features' Gaussian sums."""

    agent: DelayAgent
    """The agent: trajectory, height, heading, body and receiver."""
    sums: gaussian_sums.Sums
    """Potential features as Gaussian sums."""
    undetected: float
    """Expected number of features that exist and were never detected."""
    next_ident: int
    """Number of the next new feature."""


def init(
    start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: BpSlamConfig, *,
    rng: np.random.Generator,
) -> BpSlamState:  # fmt: skip
    """State of BP-SLAM before the first cycle: the start prior, no features. `ris` is not used; nothing is drawn."""
    agent = begin_agent(start, int(config.axes.sum()), body, sensor)
    return BpSlamState(agent, gaussian_sums.no_sums(len(agent.course.mean)), config.initial_features, 0)


def assumed_odds(config: BpSlamConfig, sensor: SensorModel) -> Odds:
    """Detection probability and clutter density that BP-SLAM assumes, as the agent is told of its receiver."""
    rate = max(sensor.false_alarms, FEWEST_FALSE)
    return Odds(config.detection_probability, rate, SPEED_OF_LIGHT * sensor.window[1])


def predict(state: BpSlamState, dt: float, config: BpSlamConfig) -> SlamEstimate:
    """Estimate of BP-SLAM predicted `dt` [s] ahead at constant velocity without noise."""
    return ahead_of(estimate(state, config), dt)


def _move(state: BpSlamState, dt: float, config: BpSlamConfig) -> BpSlamState:
    """Predict BP-SLAM's agent and features over `dt` [s]; the past state of every `course_stride` cycles is kept."""
    if dt == 0.0:
        return state
    agent, step = move_agent(state.agent, dt, config.sigma_a, config.course_stride)
    sums = gaussian_sums.carry(state.sums, step, config.wander)
    sums = sums._replace(existence=config.survival_probability * sums.existence)
    unseen = config.survival_probability * (1.0 - config.detection_probability) * state.undetected
    return state._replace(agent=agent, sums=sums, undetected=unseen + config.birth_mean)


def step(
    state: BpSlamState, measurement: Measurement, code: RisCode | None, dt: float, heading: float,
    config: BpSlamConfig, *, rng: np.random.Generator,
) -> tuple[BpSlamState, StepInfo]:  # fmt: skip
    """Advance BP-SLAM by one cycle: `dt` [s] since the last, `heading` [rad]. `code` and `rng` are not used.

    Raises
    ------
    ConfigError
        Time step or heading is no number.
    """
    check_step(dt, heading)
    odds = assumed_odds(config, state.agent.sensor)
    state = _move(state, dt, config)
    agent = state.agent._replace(heading=float(heading))
    rows, scan, strong, model = hear_ranges(agent, measurement, config)
    fresh = 1.0 + birth_ratio(scan.length, state.undetected, odds._replace(detection_probability=FIRST_DETECTION))
    sight = gaussian_sums.predict_ranges(state.sums, agent.course, agent.pose[0], model)
    found = claims(state.sums, sight, agent.course, scan, fresh, odds)
    landmark = np.full(len(measurement), REMOVED)
    landmark[rows], nis = _claimed(state, sight, scan, found, config)
    dof = int((landmark >= 0).sum())
    sums, course = absorb(state.sums, sight, agent.course, scan, found, odds)
    agent = agent._replace(course=course).strained(nis, dof, STRAIN_RATE)
    state = _give_birth(state._replace(sums=sums, agent=agent), scan, strong, found, fresh, config)
    count = int((state.sums.existence > config.detection_threshold).sum())
    report = StepInfo(landmark, 1.0, False, nis, dof, 0.0, count, outcome_of(len(measurement), count, agent.strain))
    return state, report


def _give_birth(
    state: BpSlamState, scan: Scan, strong: Booleans, found: Association, fresh: Floats, config: BpSlamConfig
) -> BpSlamState:
    """BP-SLAM's state with new features for ranges that none claims, and without improbable ones."""
    rows, existence = newborn(found, fresh, config.birth_threshold)
    sums = state.sums
    if len(rows):
        kinds = gaussian_sums.kinds_of(strong[rows], config.wanderers)
        new = gaussian_sums.born(
            scan.length[rows], scan.std[rows], kinds, existence, state.agent.course, state.agent.pose[0],
            config.birth_turns, state.next_ident,
        )  # fmt: skip
        sums = gaussian_sums.join(sums, new)
    sums = gaussian_sums.prune(sums, config.pruning_threshold, config.share_threshold, config.max_features)
    return state._replace(sums=sums, next_ident=state.next_ident + len(rows))


def estimate(state: BpSlamState, config: BpSlamConfig) -> SlamEstimate:
    """Estimate of BP-SLAM: mean, covariance and samples of the pose, and its detected features as points of the map."""
    found = known_points(state.sums, config.detection_threshold)
    return reported(state.agent, found, config.num_samples)


def _claimed(
    state: BpSlamState, sight: gaussian_sums.PredictedRanges, scan: Scan, found: Association, config: BpSlamConfig
) -> tuple[Integers, float]:
    """BP-SLAM's feature number (M,) of each range, `UNUSED` for none, and the NIS over the ranges so claimed."""
    sums, numbers = state.sums, np.full(len(scan.length), UNUSED)
    feature, shown = np.nonzero((found.feature[:, :-1] > 0.5) & (sums.existence > config.detection_threshold)[:, None])
    numbers[shown] = sums.ident[feature]
    mean, variance = gaussian_sums.range_moments(sums, sight, state.agent.course)
    nis = np.sum((scan.length[shown] - mean[feature]) ** 2 / (variance[feature] + scan.std[shown] ** 2))
    return numbers, float(nis)
