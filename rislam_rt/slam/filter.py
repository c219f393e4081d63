"""One cycle of localisation and mapping: predict, associate, update, learn who is who, grow and prune the map."""

from enum import StrEnum
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import wrap
from rislam_rt.model import Body, Measurement, RadioConfig, RisCode, RisSpec
from rislam_rt.slam.associate import associate
from rislam_rt.slam.birth import examine, poses_of
from rislam_rt.slam.book import Book, empty_book
from rislam_rt.slam.config import SlamConfig, StartPrior
from rislam_rt.slam.expect import Belief, bounces, expected_returns
from rislam_rt.slam.learn import learn
from rislam_rt.slam.match import Outlook, candidates, hidden_tracks, look_ahead
from rislam_rt.slam.particles import Particles, effective_size, mean_features, propagate, resample
from rislam_rt.slam.prune import prune
from rislam_rt.slam.returns import compact, observe
from rislam_rt.slam.tracks import Glance, Tracks, advance, begin, extend, no_tracks
from rislam_rt.slam.update import Update, update

LOS_MARGIN = 0.1
"""Length [m] beyond the baseline below which a component is the direct path: no landmark can be that near."""
STRANGERS = np.array([1.3, 2.0, 3.0])
"""Factor on the standard deviations of returns over 0, 1 and 2 walls, for paths in their cell that the map lacks."""
STRAIN_RATE = 0.05
"""Share of the latest cycle in the running mean of the NIS."""
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
    glance = glance_of(measurement, state.radio)
    landmark = np.where(is_los(glance, state.body), REMOVED, UNUSED)
    free = np.flatnonzero(landmark == UNUSED)
    glance = Glance._make(field[free] for field in glance)
    belief = mean_belief(state, heading)
    expected = expected_returns(belief, code, config.max_bounces, config.detection_snr, config.use_vt)
    tracks = advance(state.tracks, dt, state.cycle, _bend(state))
    outlook = look_ahead(belief, expected, state.particles, tracks)
    hidden = hidden_tracks(outlook, tracks, config.gate)
    picks = associate(candidates(outlook, tracks, hidden), glance, config.gate, config.clutter_density)

    num_returns = len(expected.log_amplitude)
    hit = np.flatnonzero(picks[:num_returns] >= 0)
    taken = picks[hit]
    updated = _correct(state, outlook, hit, glance, taken, heading)
    book, names = learn(
        belief,
        updated.particles,
        outlook,
        hit,
        updated.surprise,
        glance,
        taken,
        measurement,
        free,
        code,
        rng=rng,
    )
    landmark[free[taken]] = names
    tracks, removed = _follow(state, tracks, glance, picks, num_returns, config)
    landmark[free[removed]] = REMOVED
    hidden = hidden_tracks(outlook, tracks, config.gate)
    row, tracks, particles, book = examine(
        tracks,
        updated.particles,
        book,
        outlook,
        hidden,
        state.heading,
        state.time,
        state.body,
        state.cycle,
        free_space(state.radio),
        config,
    )
    tracks = tracks.keep(np.arange(len(tracks.misses)) != row)
    particles, book = prune(particles, book, outlook, belief, config)

    ess = effective_size(particles.log_weight)
    low = ess < config.resample_below * len(particles.log_weight)
    if low:
        particles = resample(particles, state.time[state.cycle % config.window] - state.time, rng=rng)
    dof = 3 * len(hit)
    strain = state.strain + STRAIN_RATE * (updated.nis / dof - state.strain) if dof else state.strain
    outcome = _outcome(len(measurement), len(book.ident), strain)
    info = StepInfo(landmark, ess, low, updated.nis, dof, updated.log_evidence, len(book.points), outcome)
    return state._replace(particles=particles, book=book, tracks=tracks, strain=strain), info


def mean_belief(state: FilterState, heading: float) -> Belief:
    """The mean of the particles, in which returns are enumerated and linearised."""
    position = state.particles.weight @ state.particles.position
    poses = poses_of(position, np.asarray(heading), state.body)
    return Belief(mean_features(state.particles), state.book, poses, state.body, state.radio, state.ris)


def _correct(
    state: FilterState, outlook: Outlook, hit: Integers, glance: Glance, taken: Integers, heading: float
) -> Update:
    """Weights and maps after the returns `hit` were seen as measurements `taken`."""
    partner = outlook.merger.partner[hit]
    returns = compact(outlook.expected.returns, np.concatenate([hit, np.where(partner >= 0, partner, hit)]))
    poses = poses_of(state.particles.position, np.asarray(heading), state.body)
    predicted = observe(returns, state.particles.features, state.book.anchor, poses).seen
    predicted = 0.5 * (predicted[:, : len(hit)] + predicted[:, len(hit) :])
    strangers = STRANGERS[np.minimum(bounces(outlook.expected.returns)[hit], 2)]
    std = np.hypot(glance.std[taken] * strangers[:, None], outlook.merger.disturbance[hit])
    return update(state.particles, predicted, outlook.by_feature[hit], glance.seen[taken], std)


def _follow(
    state: FilterState, tracks: Tracks, glance: Glance, picks: Integers, num_returns: int, config: SlamConfig
) -> tuple[Tracks, Integers]:
    """Tracks extended, begun and ended; and which measurements were taken for wall returns."""
    bright = glance.ratio > config.specular_ratio
    kept = np.flatnonzero(picks[num_returns:] >= 0)
    used = picks[num_returns:][kept]
    tracks = extend(tracks, kept, glance, used, bright, state.cycle)
    spare = np.setdiff1d(np.arange(len(bright)), picks)
    removed = np.concatenate([used[tracks.specular[kept]], spare[bright[spare]]])
    tracks = begin(tracks, glance, spare, bright, _rates(state), state.cycle)
    return tracks.keep(tracks.misses <= config.max_misses), removed


def glance_of(measurement: Measurement, radio: RadioConfig) -> Glance:
    """A measurement in the filter's units; standard deviations are kept off zero."""
    length = SPEED_OF_LIGHT * measurement.tau
    amplitude = np.maximum(measurement.amplitude, 1e-30)
    free = np.exp(free_space(radio)) / np.maximum(length, 1e-3)
    std = np.concatenate([SPEED_OF_LIGHT * measurement.tau_std[:, None], measurement.cosines_std], axis=1)
    return Glance(
        np.concatenate([length[:, None], measurement.cosines], axis=1),
        np.maximum(std, 1e-5),
        np.log(amplitude),
        np.minimum(measurement.amplitude_std / amplitude, 1.0),
        amplitude / free,
    )


def free_space(radio: RadioConfig) -> float:
    """Log amplitude of a path of 1 m in free space."""
    return float(np.log(radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain) / (4.0 * np.pi)))


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
