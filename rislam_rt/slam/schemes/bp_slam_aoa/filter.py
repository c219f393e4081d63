"""Filter of BP-SLAM by delays, angles and amplitudes, for an agent that carries both ends; heading known."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Body, DataSheet, MapEstimate, Measurement, RisCode, SensorModel, SlamEstimate
from rislam_rt.slam.input_checks import check_step
from rislam_rt.slam.observations import free_space, is_los, observations_of, stranger_density
from rislam_rt.slam.schemes.bp_slam_aoa import gaussian_features
from rislam_rt.slam.schemes.bp_slam_aoa.config import BpSlamAoaConfig
from rislam_rt.slam.schemes.bp_slam_aoa.feature_association import View, claims, expect_scan, likelihoods, spread_of
from rislam_rt.slam.schemes.bp_slam_aoa.feature_birth import ComponentScan, born, hypothesise
from rislam_rt.slam.schemes.bp_slam_aoa.feature_update import absorb
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory, advance
from rislam_rt.slam.schemes.shared.gaussian_sums import join, prune
from rislam_rt.slam.schemes.shared.loopy_association import Association
from rislam_rt.slam.schemes.shared.report import ahead_of, outcome_of, position_errors
from rislam_rt.slam.schemes.shared.sum_correction import is_strong
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.step_info import REMOVED, UNUSED, StepInfo

LIVELY_STRIDE = 5
"""Cycles from one past state of the agent that is kept to the next, while steps are not calm."""
LEAST_FALSE = 1e-12
"""Least density of false components."""
FAST = 4.0
"""Acceleration of a fast step over that of a lively one."""
CALM_ENDS = 0.1
"""How often a calm stretch ends, over how often a lively one does."""
CHANGE = 0.05
"""Probability that a step which is not calm is followed by one that is not calm in another way."""
UNSEEN = 0.7
"""Share of the features expected and not yet detected that stay undetected in a cycle."""
RARE = 1e-6
"""Density of new features' components while motion modes are weighed: a surprise, but not an impossible one."""
VERTICAL_STD = 0.003
"""Standard deviation [m/s^2] of the white vertical acceleration of an agent on a level floor."""
STRAIN_RATE = 0.05
"""Weight of the latest cycle in the running mean of the NIS."""


class BpSlamAoaState(NamedTuple):
    """State of BP-SLAM with angles: the agent's trajectory and motion mode, and the features' Gaussian sums."""

    course: AgentTrajectory
    """The agent's trajectory [m], relative to the start."""
    features: gaussian_features.GaussianFeatures
    """Potential features as Gaussian sums."""
    fresh: float
    """Share of the features expected at the start that was never detected."""
    next_ident: int
    """Number of the next new feature."""
    cycle: int
    """Number of cycles so far."""
    motion_mode: Floats
    """Probabilities (4,) that the last step was calm, lively, fast, climbing."""
    heading: float
    """Heading [rad]."""
    strain: float
    """Running mean of the NIS per degree of freedom: 1 when all is well."""
    start: StartPrior
    """The start prior that the agent was told."""
    body: Body
    """Places of Tx and Rx on the agent."""
    sensor: SensorModel
    """What the agent is told of its receiver."""


def init(
    start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: BpSlamAoaConfig, *,
    rng: np.random.Generator,
) -> BpSlamAoaState:  # fmt: skip
    """State of BP-SLAM with angles before the first cycle: start prior, no features. `ris` not used, nothing drawn."""
    std = np.concatenate([np.zeros(3), start.velocity_std * np.array([1.0, 1.0, 0.0])])
    mean = np.concatenate([np.zeros(3), start.velocity])
    course = AgentTrajectory(mean, np.diag(std**2), mean, 3, np.diag(std**2), 0.0)
    motion_mode = np.array([1.0, 0.0, 0.0, 0.0])
    return BpSlamAoaState(
        course, gaussian_features.no_features(6), 1.0, 0, 0, motion_mode, float(start.heading), 1.0, start, body, sensor
    )  # fmt: skip


def predict(state: BpSlamAoaState, dt: float, config: BpSlamAoaConfig) -> SlamEstimate:
    """Estimate of BP-SLAM with angles predicted `dt` [s] ahead at constant velocity without noise."""
    return ahead_of(estimate(state, config), dt)


def step(
    state: BpSlamAoaState, measurement: Measurement, code: RisCode | None, dt: float, heading: float,
    config: BpSlamAoaConfig, *, rng: np.random.Generator,
) -> tuple[BpSlamAoaState, StepInfo]:  # fmt: skip
    """Advance BP-SLAM with angles by one cycle: `dt` [s] since the last, `heading` [rad]. `code`, `rng` are not used.

    Raises
    ------
    ConfigError
        Time step or heading is no number.
    """
    check_step(dt, heading)
    scan, rows = _scan(state, measurement, config)
    landmark = np.full(len(measurement), REMOVED)
    state, view, ends = _predict(state._replace(heading=float(heading)), dt, scan, config)
    free = free_space(state.sensor.radio)
    window = SPEED_OF_LIGHT * state.sensor.window[1]
    hypotheses = [hypothesise(scan, row, ends.rotation, free, window, config) for row in range(len(rows))]
    births = state.fresh * np.array([each.density.sum() for each in hypotheses])
    fresh = scan.false + births
    density = likelihoods(view, spread_of(view.predicted, state.course), scan)
    found, _ = claims(state.features, view, density, fresh)
    landmark[rows], nis = _claimed(state, view, scan, found, config)
    dof = 3 * int((landmark >= 0).sum())
    features, course = absorb(state.features, view, state.course, scan, found, fresh)
    alive = found.unclaimed * births / fresh
    new = np.flatnonzero(alive >= config.birth_threshold)
    if len(new):
        features = join(
            features, born([hypotheses[row] for row in new], alive[new], course, ends, state.next_ident, config)
        )
    features = prune(features, config.pruning_threshold, config.share_threshold, config.max_features)
    strain = state.strain + (STRAIN_RATE * (nis / dof - state.strain) if dof else 0.0)
    count = int((features.existence > config.detection_threshold).sum())
    report = StepInfo(landmark, 1.0, False, nis, dof, 0.0, count, outcome_of(len(measurement), count, strain))
    return state._replace(
        course=course, features=features, next_ident=state.next_ident + len(new), strain=strain, cycle=state.cycle + 1
    ), report


def estimate(state: BpSlamAoaState, config: BpSlamAoaConfig) -> SlamEstimate:
    """Estimate of BP-SLAM with angles: moments and samples of the pose, and points and walls of the map."""
    position, velocity, covariance, samples = pose_moments(state.course, state.start, config.num_samples)
    known = known_map(state.features, state.course, state.start, config.detection_threshold)
    return SlamEstimate(position, velocity, state.heading, covariance, samples, state.body, known)


def _scan(state: BpSlamAoaState, measurement: Measurement, config: BpSlamAoaConfig) -> tuple[ComponentScan, Integers]:
    """Components that BP-SLAM with angles uses (no direct path, no wall returns set aside), and their rows (M,)."""
    sensor = state.sensor
    observed = observations_of(measurement, sensor.radio, state.body)
    aside = is_los(observed, state.body) | is_strong(observed.ratio, None if config.use_vt else config.specular_ratio)
    rows = np.flatnonzero(~aside)
    observed = observed.take(rows)
    false = np.maximum(stranger_density(observed, sensor, 0.0), LEAST_FALSE)
    return ComponentScan(observed.seen, observed.std, observed.log_amplitude, observed.log_amplitude_std, false), rows


def _levels(config: BpSlamAoaConfig) -> Floats:
    """Acceleration deviations (4, 3) [m/s^2] of motion modes in BP-SLAM with angles: calm, lively, fast, climbing."""
    calm, lively, fast = config.sigma_a, config.lively_std, FAST * config.lively_std
    up = min(VERTICAL_STD, calm)
    return np.array([[calm, calm, up], [lively, lively, up], [fast, fast, up], [calm, calm, lively]])


def _mode_changes(config: BpSlamAoaConfig) -> Floats:
    """Transition probabilities (4, 4) from a step's motion mode to the next one's in BP-SLAM with angles."""
    calm = config.calm_again
    move = np.full((4, 4), CHANGE * (1.0 - calm))
    move[0], move[:, 0] = CALM_ENDS * calm / 3.0, calm
    np.fill_diagonal(move, 0.0)
    np.fill_diagonal(move, 1.0 - move.sum(axis=1))
    return move


def _predict(
    state: BpSlamAoaState, dt: float, scan: ComponentScan, config: BpSlamAoaConfig
) -> tuple[BpSlamAoaState, View, gaussian_features.Ends]:  # fmt: skip
    """Predict agent and features of BP-SLAM with angles to this cycle, by the motion mode that explains it best."""
    turn = rotation_z(np.asarray(state.heading))
    upper = state.sensor.radio.array.pattern == "upper"
    ends = gaussian_features.Ends(turn @ state.body.tx_offset, turn @ state.body.rx_offset, turn, upper)
    levels, free, prior = _levels(config), free_space(state.sensor.radio), state.motion_mode @ _mode_changes(config)

    def ahead(level: int) -> tuple[BpSlamAoaState, View]:
        if dt == 0.0:
            moved = state
        else:
            keep = (
                len(state.course.mean) == 6
                or state.cycle % config.course_stride == 0
                or (level > 0 and state.cycle % LIVELY_STRIDE == 0)
            )
            course, carried = advance(state.course, dt, levels[level], keep)
            features = gaussian_features.carry(state.features, carried, config.drift_std)
            features = features._replace(existence=config.survival_probability * features.existence)
            moved = state._replace(course=course, features=features)
        predicted = gaussian_features.predict_returns(moved.features, moved.course, ends, free)
        return moved, expect_scan(moved.features, predicted, scan, state.sensor, config)

    moved, view = ahead(0)
    rare = scan.false + RARE
    scores = np.log(np.maximum(prior, 1e-30))
    if dt > 0.0 and len(moved.features.ident):
        spread = spread_of(view.predicted, moved.course)
        for level in range(4):
            more = np.diag((0.5 * dt**2 * levels[level]) ** 2 - (0.5 * dt**2 * levels[0]) ** 2)
            scores[level] += claims(moved.features, view, likelihoods(view, spread, scan, more), rare)[1]
    motion_mode = np.exp(scores - scores.max())
    best = int(np.argmax(motion_mode))
    if best:
        moved, view = ahead(best)
    unseen = config.birth_mean + (1.0 - config.birth_mean) * UNSEEN * state.fresh if dt > 0.0 else state.fresh
    return moved._replace(motion_mode=motion_mode / motion_mode.sum(), fresh=unseen), view, ends


def _claimed(
    state: BpSlamAoaState, view: View, scan: ComponentScan, found: Association, config: BpSlamAoaConfig
) -> tuple[Integers, float]:
    """BP-SLAM with angles: feature (M,) of each component, `UNUSED` for none, and the NIS over those so claimed."""
    features, numbers, nis = state.features, np.full(len(scan.seen), UNUSED), 0.0
    sure = (features.existence > config.detection_threshold)[:, None]
    for row, shown in zip(*np.nonzero((found.feature[:, :-1] > 0.5) & sure), strict=True):
        own = np.flatnonzero(features.owner == row)
        best = own[np.argmax(features.share[own])]
        numbers[shown] = features.ident[row]
        by_course = view.predicted.by_course[best]
        spread = view.predicted.own[best] + view.disturbance[best] + by_course @ state.course.covariance @ by_course.T
        spread = spread + np.diag(np.exp(features.log_scatter[best]) * scan.std[shown] ** 2)
        miss = scan.seen[shown] - view.predicted.seen[best]
        nis += float(miss @ np.linalg.solve(spread, miss))
    return numbers, nis


def start_variance(start: StartPrior) -> Floats:
    """Covariance (3, 3) [m^2] of the start told to BP-SLAM with angles, which a report adds to the pose; its height is
    exact."""
    return start.position_std**2 * np.diag([1.0, 1.0, 0.0])


def pose_moments(course: AgentTrajectory, start: StartPrior, count: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Pose reported by BP-SLAM with angles: position (3,), velocity (3,), their covariance (6, 6), and `count` equally
    likely positions."""
    covariance = course.covariance[:6, :6].copy()
    covariance[:3, :3] += start_variance(start)
    covariance = 0.5 * (covariance + covariance.T)
    position, velocity = start.position + course.mean[:3], course.mean[3:6]
    return position, velocity, covariance, position + position_errors(covariance, count)


def known_map(
    features: gaussian_features.GaussianFeatures, course: AgentTrajectory, start: StartPrior, threshold: float
) -> MapEstimate:
    """Reported map of BP-SLAM with angles: the features that exist, each by its likeliest Gaussian, as points and
    walls; no wanderers."""
    total = features.covariance + gaussian_features.spread_over(features.slope, course)
    best = np.zeros(len(features.ident))
    np.maximum.at(best, features.owner, features.share)
    shown = (features.existence[features.owner] > threshold) & (features.share > 0.5)
    shown &= features.share >= best[features.owner]
    points, walls = (
        np.flatnonzero(shown & (features.kind == kind)) for kind in (gaussian_features.POINT, gaussian_features.WALL)
    )
    image, spread = features.mean[walls], total[walls]
    size = np.linalg.norm(image, axis=1)
    normal = image / np.maximum(size, 1e-9)[:, None]
    along = np.einsum("wi,wij,wj->w", normal, spread, normal)
    across = np.maximum(np.einsum("wii->w", spread) - along, 0.0)
    std = np.stack([np.sqrt(0.5 * across) / np.maximum(size, 1e-9), 0.5 * np.sqrt(along)], axis=1)
    count = len(points)
    return MapEstimate(
        features.ident[features.owner[points]], start.position + features.mean[points],
        total[points] + start_variance(start), np.full(count, -1), np.zeros(count),
        np.exp(np.clip(features.strength[points], -30.0, 30.0)), normal, 0.5 * size + normal @ start.position, std,
    )  # fmt: skip
