"""BP-SLAM for an agent that carries both ends: ranges `|p_T - a| + |a - p_R|`, heading known.

Same functions, inputs and outputs as the package's own filter, so that a run can lead either. The panel and its code
mean nothing to it, and angles of arrival are not used.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel, SlamEstimate
from rislam_rt.slam.inputs import check_step
from rislam_rt.slam.observations import is_los, observations_of
from rislam_rt.slam.schemes.bp_slam.config import BpSlamConfig
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory, advance, begin
from rislam_rt.slam.schemes.shared.association import Association
from rislam_rt.slam.schemes.shared.correct import absorb, claims, is_strong, newborn
from rislam_rt.slam.schemes.shared.ranges import Bistatic
from rislam_rt.slam.schemes.shared.report import ahead_of, known_points, lift, outcome_of, reported
from rislam_rt.slam.schemes.shared.scan import Odds, Scan, birth_ratio
from rislam_rt.slam.schemes.shared.sums import (
    PredictedRanges,
    Sums,
    born,
    carry,
    join,
    kinds_of,
    look,
    no_sums,
    prune,
    range_moments,
)
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.step_info import REMOVED, UNUSED, StepInfo

FEWEST_FALSE = 1e-3
"""Mean number of false ranges a scan that is reckoned with at least, so that no range is ever held for certain."""
FIRST_DETECTION = 0.95
"""That a feature which stands in view for the first time is measured, as published."""
STRAIN_RATE = 0.05
"""Share of the latest cycle in that mean."""


class BpSlamState(NamedTuple):
    """All that the filter knows."""

    course: AgentTrajectory
    sums: Sums
    undetected: float
    """Features that exist and were never seen, expected."""
    next_ident: int
    cycle: int
    height: Floats
    """(2,) height [m] and vertical velocity [m/s], where they are known."""
    heading: float
    """[rad]."""
    strain: float
    """Running mean of the NIS per degree of freedom: 1 when all is well."""
    body: Body
    sensor: SensorModel
    """What the agent is told of its receiver."""

    @property
    def pose(self) -> Floats:
        """(2, 3) position [m] and velocity [m/s] that the filter works at."""
        return lift(self.course.mean[: self.course.width], self.height)


def init(
    start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: BpSlamConfig, *,
    rng: np.random.Generator,
) -> BpSlamState:  # fmt: skip
    """The start prior, and no features. `ris` is taken for the interface and not used; nothing is drawn."""
    axes = int(config.axes.sum())
    course = begin(start.position[:axes], start.velocity[:axes], start.position_std, start.velocity_std)
    height = np.array([start.position[2], start.velocity[2]])
    sums = no_sums(len(course.mean))
    return BpSlamState(course, sums, config.initial_features, 0, 0, height, float(start.heading), 1.0, body, sensor)


def assumed_odds(config: BpSlamConfig, sensor: SensorModel) -> Odds:
    """What a range is weighed against, with the false ranges that the agent is told of its receiver."""
    rate = max(sensor.false_alarms, FEWEST_FALSE)
    return Odds(config.detection_probability, rate, SPEED_OF_LIGHT * sensor.window[1])


def predict(state: BpSlamState, dt: float, config: BpSlamConfig) -> SlamEstimate:
    """The belief carried over `dt` [s] without noise."""
    return ahead_of(estimate(state, config), dt)


def _move(state: BpSlamState, dt: float, accelerate: Floats, config: BpSlamConfig) -> BpSlamState:
    """Agent and features after `dt` [s]; the past state of every `course_stride` cycles is kept."""
    if dt == 0.0:
        return state
    keep = len(state.course.mean) == state.course.width or state.cycle % config.course_stride == 0
    course, step = advance(state.course, dt, accelerate, keep)
    wander = np.array([config.drift_length_std, config.drift_angle_std, 0.0])
    sums = carry(state.sums, step, wander)
    sums = sums._replace(existence=config.survival_probability * sums.existence)
    height = state.height + np.array([dt * state.height[1], 0.0])
    unseen = config.survival_probability * (1.0 - config.detection_probability) * state.undetected
    return state._replace(
        course=course, sums=sums, height=height, undetected=unseen + config.birth_mean, cycle=state.cycle + 1
    )


def step(
    state: BpSlamState, measurement: Measurement, code: RisCode | None, dt: float, heading: float,
    config: BpSlamConfig, *, rng: np.random.Generator,
) -> tuple[BpSlamState, StepInfo]:  # fmt: skip
    """Advance by one cycle: `dt` [s] since the last, `heading` [rad]. `code` and `rng` are there for the interface.

    Raises
    ------
    ConfigError
        Time step or heading is no number.
    """
    check_step(dt, heading)
    odds = assumed_odds(config, state.sensor)
    state = _move(state, dt, np.full(state.course.axes, config.sigma_a), config)._replace(heading=float(heading))
    observed = observations_of(measurement, state.sensor.radio)
    free = ~is_los(observed, state.body)
    if not config.planes:
        free &= ~is_strong(observed.ratio, config.specular_ratio)
    rows = np.flatnonzero(free)
    scan = Scan(observed.seen[rows, 0], np.maximum(observed.std[rows, 0], config.smallest_std))
    turn = rotation_z(np.asarray(heading))
    model = Bistatic(
        turn @ state.body.tx_offset, turn @ state.body.rx_offset, state.sensor.radio.array.pattern == "upper"
    )
    fresh = 1.0 + birth_ratio(scan, state.undetected, model, 3, odds._replace(detection_probability=FIRST_DETECTION))
    sight = look(state.sums, state.course, state.pose[0], model)
    found = claims(state.sums, sight, state.course, scan, fresh, odds)
    landmark = np.full(len(measurement), REMOVED)
    landmark[rows], nis = _claimed(state, sight, scan, found, config)
    dof = int((landmark >= 0).sum())
    sums, course = absorb(state.sums, sight, state.course, scan, found, odds)
    state = state._replace(sums=sums, course=course)
    state = _give_birth(state, scan, is_strong(observed.ratio[rows], config.specular_ratio), found, fresh, config)
    strain = state.strain + (STRAIN_RATE * (nis / dof - state.strain) if dof else 0.0)
    count = int((state.sums.existence > config.detection_threshold).sum())
    report = StepInfo(landmark, 1.0, False, nis, dof, 0.0, count, outcome_of(len(measurement), count, strain))
    return state._replace(strain=strain), report


def _give_birth(
    state: BpSlamState, scan: Scan, strong: Booleans, found: Association, fresh: Floats, config: BpSlamConfig
) -> BpSlamState:
    rows, existence = newborn(found, fresh, config.birth_threshold)
    sums = state.sums
    if len(rows):
        kinds = kinds_of(strong[rows], config.wanderers)
        new = born(
            scan.length[rows], scan.std[rows], kinds, existence, state.course, state.pose[0],
            config.birth_turns, state.next_ident,
        )  # fmt: skip
        sums = join(sums, new)
    sums = prune(sums, config.pruning_threshold, config.share_threshold, config.max_features)
    return state._replace(sums=sums, next_ident=state.next_ident + len(rows))


def estimate(state: BpSlamState, config: BpSlamConfig) -> SlamEstimate:
    """Mean and covariance of the pose, samples of it, and the detected features as points of the map."""
    found = known_points(state.sums, config.detection_threshold)
    return reported(state.course, state.height, state.heading, state.body, found, config.num_samples)


def _claimed(
    state: BpSlamState, sight: PredictedRanges, scan: Scan, found: Association, config: BpSlamConfig
) -> tuple[Integers, float]:
    """Feature number of each range (`UNUSED` for none), and the NIS over those claimed, of the features' mixtures."""
    sums, numbers = state.sums, np.full(len(scan.length), UNUSED)
    feature, shown = np.nonzero((found.feature[:, :-1] > 0.5) & (sums.existence > config.detection_threshold)[:, None])
    numbers[shown] = sums.ident[feature]
    mean, variance = range_moments(sums, sight, state.course)
    nis = np.sum((scan.length[shown] - mean[feature]) ** 2 / (variance[feature] + scan.std[shown] ** 2))
    return numbers, float(nis)
