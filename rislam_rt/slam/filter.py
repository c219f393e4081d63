"""One cycle of localisation and mapping: predict, associate, update, learn who is who, grow and prune the map."""

from enum import StrEnum
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import wrap
from rislam_rt.model import Body, Measurement, RadioConfig, RisCode, RisSpec
from rislam_rt.slam.associate import Candidates, associate
from rislam_rt.slam.birth import examine, poses_of
from rislam_rt.slam.book import Book, empty_book
from rislam_rt.slam.config import SlamConfig, StartPrior
from rislam_rt.slam.expect import Belief, Expected, expected_returns
from rislam_rt.slam.learn import forget, learn, unite
from rislam_rt.slam.particles import Particles, effective_size, propagate, resample
from rislam_rt.slam.returns import feature_jacobian, observe
from rislam_rt.slam.tracks import AMPLITUDE_WANDER, Glance, Tracks, advance, begin, extend, no_tracks
from rislam_rt.slam.update import update

LOS_MARGIN = 0.1
"""Length [m] beyond the baseline below which a component is the direct path: no landmark can be that near."""
LANDMARK_ODDS, TRACK_ODDS = np.log(0.9), np.log(0.5)
"""Log probability that an expected return, and that a track, shows in a cycle."""
UNUSED, REMOVED = -1, -2
"""In `StepInfo.landmark`: clutter or not yet explained; taken for LOS or a wall return."""


class Outcome(StrEnum):
    """How a cycle went. Values, not exceptions: a filter must survive every one of them."""

    OK = "ok"
    NO_MEASUREMENTS = "no measurements"
    NO_LANDMARKS = "no landmarks"
    DIVERGED = "diverged"


class FilterState(NamedTuple):
    """All that the filter knows."""

    cycle: int
    particles: Particles
    book: Book
    tracks: Tracks
    heading: Floats
    """(W,) headings of the last W cycles [rad], cycle k at row k % W."""
    time: Floats
    """(W,) times [s] of the last W cycles."""
    strain: float
    """Running mean of NIS per degree of freedom: 1 when all is well."""
    body: Body
    ris: RisSpec | None
    radio: RadioConfig


class StepInfo(NamedTuple):
    """Diagnostics of one cycle."""

    landmark: Integers
    """(M,) ident that each measurement went to; -1 clutter or unused, -2 removed as LOS or wall return."""
    ess: float
    """Effective sample size before resampling."""
    resampled: bool
    nis: float
    """Normalised innovation squared of the mean belief."""
    nis_dof: int
    log_evidence: float
    num_landmarks: int
    outcome: Outcome


def init(
    start: StartPrior,
    body: Body,
    ris: RisSpec | None,
    radio: RadioConfig,
    config: SlamConfig,
    *,
    rng: np.random.Generator,
) -> FilterState:
    """Particles drawn from the start prior, and an empty map."""
    shape, axes = (config.num_particles, 3), _axes(config)
    position = start.position + rng.standard_normal(shape) * start.position_std * axes
    velocity = start.velocity + rng.standard_normal(shape) * start.velocity_std * axes
    log_weight = np.full(config.num_particles, -np.log(config.num_particles))
    trail = np.zeros((config.window, *shape))
    particles = Particles(position, velocity, log_weight, np.zeros((shape[0], 0, 3)), np.zeros((0, 0)), trail)
    trail[:] = position
    heading = np.full(config.window, start.heading)
    return FilterState(
        0,
        particles,
        empty_book(),
        no_tracks(config.window),
        heading,
        np.zeros(config.window),
        1.0,
        body,
        ris,
        radio,
    )


def step(
    state: FilterState,
    measurement: Measurement,
    code: RisCode | None,
    dt: float,
    heading: float,
    config: SlamConfig,
    *,
    rng: np.random.Generator,
) -> tuple[FilterState, StepInfo]:
    """Advance by one cycle: `dt` [s] since the last, `heading` [rad], `code` as the agent believes it was applied."""
    state = _move(state, dt, heading, config, rng=rng)
    particles, book, cycle = state.particles, state.book, state.cycle
    glance = glance_of(measurement, state.radio)
    landmark = np.where(is_los(glance, state.body), REMOVED, UNUSED)
    free = np.flatnonzero(landmark == UNUSED)
    open_glance = Glance._make(field[free] for field in glance)

    poses = poses_of(particles.position, np.asarray(heading), state.body)
    mean_poses = poses_of(particles.weight @ particles.position, np.asarray(heading), state.body)
    means = np.einsum("n,nfi->fi", particles.weight, particles.features)
    belief = Belief(means, book, mean_poses, state.body, state.radio, state.ris)
    expected = expected_returns(belief, code, config.max_bounces, config.detection_snr, config.use_vt)
    predicted = observe(expected.returns, particles.features, book.anchor, poses).seen
    jacobian = feature_jacobian(expected.returns, means, book.anchor, mean_poses)
    tracks = advance(state.tracks, dt, cycle, _bend(state))
    candidates = _candidates(expected, predicted, jacobian, particles, tracks)
    picks = associate(candidates, open_glance, config.gate, config.clutter_density)

    num_returns = len(expected.log_amplitude)
    hit = np.flatnonzero(picks[:num_returns] >= 0)
    taken = picks[hit]
    updated = update(particles, predicted[:, hit], jacobian[hit], open_glance.seen[taken], open_glance.std[taken])
    particles = updated.particles
    book, names = learn(belief, particles, expected, hit, open_glance, taken, measurement, free, code, rng=rng)
    landmark[free[taken]] = names

    kept = np.flatnonzero(picks[num_returns:] >= 0)
    tracks = extend(tracks, kept, open_glance, picks[num_returns:][kept], cycle)
    landmark[free[picks[num_returns:][kept]]] = np.where(tracks.specular[kept], REMOVED, UNUSED)
    spare = np.setdiff1d(np.arange(len(free)), picks)
    specular = open_glance.ratio[spare] > config.specular_ratio
    landmark[free[spare[specular]]] = REMOVED
    tracks = begin(tracks, open_glance, spare, specular, _rates(state), cycle)
    tracks = tracks.keep(tracks.misses <= config.max_misses)
    born, tracks, particles, book = examine(tracks, particles, book, state.heading, state.body, cycle, config)
    tracks = tracks.keep(~born)
    particles, book = forget(particles, book, config.prune_misses)
    particles, book = unite(particles, book, config.merge_distance)

    ess = effective_size(particles.log_weight)
    low = ess < config.resample_below * len(particles.log_weight)
    if low:
        particles = resample(particles, state.time[cycle % config.window] - state.time, rng=rng)
    dof = 3 * len(hit)
    strain = state.strain + 0.05 * (updated.nis / dof - state.strain) if dof else state.strain
    outcome = _outcome(len(measurement), len(book.ident), strain)
    info = StepInfo(landmark, ess, low, updated.nis, dof, updated.log_evidence, len(book.points), outcome)
    return state._replace(particles=particles, book=book, tracks=tracks, strain=strain), info


def glance_of(measurement: Measurement, radio: RadioConfig) -> Glance:
    """A measurement in the filter's units; standard deviations are kept off zero."""
    length = SPEED_OF_LIGHT * measurement.tau
    amplitude = np.maximum(measurement.amplitude, 1e-30)
    free = radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain) / (4.0 * np.pi * np.maximum(length, 1e-3))
    std = np.concatenate([SPEED_OF_LIGHT * measurement.tau_std[:, None], measurement.cosines_std], axis=1)
    return Glance(
        np.concatenate([length[:, None], measurement.cosines], axis=1),
        np.maximum(std, 1e-5),
        np.log(amplitude),
        np.minimum(measurement.amplitude_std / amplitude, 1.0),
        amplitude / free,
    )


def is_los(glance: Glance, body: Body) -> Booleans:
    """(M,) whether a component is no longer than the direct path, which the body's drawing tells."""
    baseline = float(np.linalg.norm(body.tx_offset - body.rx_offset))
    return glance.seen[:, 0] < baseline + LOS_MARGIN + 3.0 * np.minimum(glance.std[:, 0], LOS_MARGIN)


def _move(
    state: FilterState, dt: float, heading: float, config: SlamConfig, *, rng: np.random.Generator
) -> FilterState:
    """The belief carried to the next cycle, whose poses join the trail."""
    cycle = state.cycle + 1
    slot, last = cycle % config.window, state.cycle % config.window
    particles = propagate(state.particles, dt, config.sigma_a * _axes(config), rng=rng)
    trail, headings, time = particles.trail.copy(), state.heading.copy(), state.time.copy()
    trail[slot], headings[slot], time[slot] = particles.position, wrap(np.asarray(heading)), state.time[last] + dt
    return state._replace(cycle=cycle, particles=particles._replace(trail=trail), heading=headings, time=time)


def _candidates(
    expected: Expected, predicted: Floats, jacobian: Floats, particles: Particles, tracks: Tracks
) -> Candidates:
    """Expected returns first, tracks behind them."""
    weight = particles.weight
    mean = np.einsum("n,nri->ri", weight, predicted)
    centred = predicted - mean
    spread = np.einsum("n,nri,nrj->rij", weight, centred, centred)
    flat = jacobian.reshape(len(mean), 3, particles.covariance.shape[0])
    spread += flat @ particles.covariance @ np.swapaxes(flat, 1, 2)
    follow = np.zeros((len(tracks.misses), 3, 3))
    follow[:, [0, 1, 2], [0, 1, 2]] = tracks.covariance[..., 0, 0]
    wander = np.where(tracks.specular, 0.15, AMPLITUDE_WANDER)
    odds = np.concatenate([np.full(len(mean), LANDMARK_ODDS), np.full(len(follow), TRACK_ODDS)])
    return Candidates(
        np.concatenate([mean, tracks.mean[..., 0]]),
        np.concatenate([spread, follow]),
        np.concatenate([expected.log_amplitude, tracks.log_amplitude]),
        np.concatenate([expected.log_amplitude_std, wander]),
        odds,
    )


def _speed(state: FilterState) -> float:
    velocity = state.particles.weight @ state.particles.velocity
    return float(np.linalg.norm(velocity)) + 0.02


def _rates(state: FilterState) -> Floats:
    """Spread (3,) of a new track's rates: both legs may shorten by the speed; half a metre is near for a landmark."""
    speed = _speed(state)
    return np.array([2.0 * speed, speed / 0.5, speed / 0.5])


def _bend(state: FilterState) -> Floats:
    """Standard deviation (3,) of the drift of a track's rates [1/s^2] at the speed of the agent."""
    speed = _speed(state)
    return np.array([0.02 + speed**2, 0.02 + speed**2, 0.02 + speed**2])


def _axes(config: SlamConfig) -> Floats:
    """(3,) ones for the axes that are filtered."""
    return np.array([1.0, 1.0, 1.0 if config.height == "estimated" else 0.0])


def _outcome(num_measurements: int, num_features: int, strain: float) -> Outcome:
    if num_measurements == 0:
        return Outcome.NO_MEASUREMENTS
    if num_features == 0:
        return Outcome.NO_LANDMARKS
    return Outcome.DIVERGED if strain > 3.0 else Outcome.OK
