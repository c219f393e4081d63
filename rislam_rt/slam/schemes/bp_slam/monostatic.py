"""BP-SLAM for an agent that carries both ends: ranges `|p_T - a| + |a - p_R|` to static points, heading known.

Same functions, inputs and outputs as the package's own filter, so that a run can lead either. What the agent is told
apart from ranges is what the other filter is told too: its body, its radio, its heading, its start. It uses amplitudes
for one thing only, as the paper does with its classifier: components as strong as a wall return are set aside, because
the image behind a wall moves with the agent and is no static feature. The panel and its code mean nothing to it.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Body, MapEstimate, Measurement, RadioConfig, RisCode, RisSpec, SlamEstimate
from rislam_rt.slam.config import StartPrior
from rislam_rt.slam.filter import REMOVED, UNUSED, Outcome, StepInfo, glance_of, is_los
from rislam_rt.slam.schemes.bp_slam.config import BpSlamConfig
from rislam_rt.slam.schemes.bp_slam.features import Features, Scan, no_features, select
from rislam_rt.slam.schemes.bp_slam.ranges import Bistatic
from rislam_rt.slam.schemes.bp_slam.update import Belief, UpdateInfo, predict_belief, update_belief

NIS_LIMIT = 3.0
"""Running mean of the NIS per degree of freedom above which the filter says that it has diverged."""
STRAIN_RATE = 0.05
"""Share of the latest cycle in that mean."""


class BpSlamState(NamedTuple):
    """All that the filter knows."""

    belief: Belief
    heading: float
    """[rad]."""
    strain: float
    """Running mean of the NIS per degree of freedom: 1 when all is well."""
    body: Body
    radio: RadioConfig


def init(
    start: StartPrior, body: Body, ris: RisSpec | None, radio: RadioConfig, config: BpSlamConfig, *,
    rng: np.random.Generator,
) -> BpSlamState:  # fmt: skip
    """Particles drawn from the start prior, and no features. `ris` is taken for the interface and not used."""
    shape, axes = (config.num_particles, 3), config.axes
    position = start.position + rng.standard_normal(shape) * start.position_std * axes
    velocity = start.velocity + rng.standard_normal(shape) * start.velocity_std * axes
    belief = Belief(
        np.concatenate([position, velocity], axis=1),
        no_features(config.num_particles, 3),
        np.array([config.initial_features]),
        0,
    )
    return BpSlamState(belief, float(start.heading), 1.0, body, radio)


def predict(state: BpSlamState, dt: float, config: BpSlamConfig) -> SlamEstimate:
    """The belief carried over `dt` [s] without noise."""
    position, velocity = np.split(state.belief.state, 2, axis=1)
    moved = np.concatenate([position + dt * velocity, velocity], axis=1)
    return estimate(state._replace(belief=state.belief._replace(state=moved)), config)


def step(
    state: BpSlamState, measurement: Measurement, code: RisCode | None, dt: float, heading: float,
    config: BpSlamConfig, *, rng: np.random.Generator,
) -> tuple[BpSlamState, StepInfo]:  # fmt: skip
    """Advance by one cycle: `dt` [s] since the last, `heading` [rad]. `code` is there for the interface, not used."""
    belief = predict_belief(state.belief, dt, config.sigma_a * config.axes, config, rng=rng)
    scan, kept = usable_ranges(measurement, state.body, state.radio, config)
    body = rotation_z(np.asarray(heading))
    upper = state.radio.array.pattern == "upper"
    model = Bistatic(body @ state.body.tx_offset, body @ state.body.rx_offset, upper)
    belief, info = update_belief(belief, (scan,), model, config, rng=rng)
    landmark = np.full(len(measurement), REMOVED)
    landmark[kept], nis, dof = _claims(info, scan, belief, config)
    strain = state.strain + (STRAIN_RATE * (nis / dof - state.strain) if dof else 0.0)
    detected = int((belief.features.existence > config.detection_threshold).sum())
    outcome = _outcome(len(measurement), detected, strain)
    report = StepInfo(
        landmark, info.effective * config.num_particles, True, nis, dof, info.log_evidence, detected, outcome
    )
    return BpSlamState(belief, float(heading), strain, state.body, state.radio), report


def estimate(state: BpSlamState, config: BpSlamConfig) -> SlamEstimate:
    """Mean and covariance of the pose, samples of it, and the detected features as points of the map."""
    particles = state.belief.state
    mean, covariance = particles.mean(axis=0), np.cov(particles, rowvar=False, bias=True)
    rows = np.linspace(0, len(particles) - 1, min(config.num_samples, len(particles))).astype(np.int64)
    return SlamEstimate(
        mean[:3],
        mean[3:],
        state.heading,
        covariance,
        particles[rows, :3],
        state.body,
        _map(state.belief.features, covariance, config),
    )


def usable_ranges(
    measurement: Measurement, body: Body, radio: RadioConfig, config: BpSlamConfig
) -> tuple[Scan, Integers]:
    """Ranges of the components that may come from static points, and their rows; the rest is LOS or wall returns."""
    glance = glance_of(measurement, radio)
    free: Booleans = ~is_los(glance, body)
    if config.specular_ratio is not None:
        free &= glance.ratio <= config.specular_ratio
    rows = np.flatnonzero(free)
    return Scan(glance.seen[rows, 0], np.maximum(glance.std[rows, 0], config.smallest_std)), rows


def _claims(info: UpdateInfo, scan: Scan, belief: Belief, config: BpSlamConfig) -> tuple[Integers, float, int]:
    """Feature number of each range (`UNUSED` for none), and NIS with its degrees of freedom over those claimed."""
    claimed, idents, predicted = info.claimed[0], info.claimants[0], info.predicted[0]
    numbers = np.full(len(scan.length), UNUSED)
    alive = belief.features.ident[belief.features.existence > config.detection_threshold]
    feature, shown = np.nonzero(claimed[:, :-1] > 0.5)
    keep = np.isin(idents[feature], alive)
    feature, shown = feature[keep], shown[keep]
    numbers[shown] = idents[feature]
    variance = predicted[feature, 1] ** 2 + scan.std[shown] ** 2
    nis = float(np.sum((scan.length[shown] - predicted[feature, 0]) ** 2 / variance))
    return numbers, nis, len(shown)


def _map(features: Features, agent: Floats, config: BpSlamConfig) -> MapEstimate:
    found = select(features, features.existence > config.detection_threshold)
    mean, covariance = found.moments(agent)
    count = len(mean)
    return MapEstimate(
        found.ident, mean, covariance, np.full(count, -1), np.zeros(count), np.zeros(count),
        np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2)),
    )  # fmt: skip


def _outcome(num_measurements: int, num_features: int, strain: float) -> Outcome:
    if num_measurements == 0:
        return Outcome.NO_MEASUREMENTS
    if num_features == 0:
        return Outcome.NO_LANDMARKS
    return Outcome.DIVERGED if strain > NIS_LIMIT else Outcome.OK
