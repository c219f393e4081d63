"""One cycle of localisation and mapping: predict, associate, update, learn who is who, grow and prune the map."""

from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import wrap
from rislam_rt.model import Body, DataSheet, Measurement, RadioConfig, RisCode, SensorModel
from rislam_rt.slam.associate import associate
from rislam_rt.slam.birth import Past, examine
from rislam_rt.slam.book import Book, empty_book, strike
from rislam_rt.slam.config import SlamConfig, StartPrior
from rislam_rt.slam.engine import Told, engine_of
from rislam_rt.slam.expect import Belief, expected_returns, shown_share
from rislam_rt.slam.health import Health, check
from rislam_rt.slam.inputs import check_sides, check_step
from rislam_rt.slam.learn import Hits, learn
from rislam_rt.slam.match import Outlook, candidates, hidden_tracks, look_ahead
from rislam_rt.slam.moments import POSE, Moments, poses_of
from rislam_rt.slam.prune import keepers
from rislam_rt.slam.returns import Poses, compact
from rislam_rt.slam.sift import sift
from rislam_rt.slam.suspect import weigh_tracks
from rislam_rt.slam.tracks import OTHER, PANEL, UNTOLD, Glance, Tracks, advance, begin, extend, has_ended, no_tracks

LOS_MARGIN = 0.1
"""Length [m] beyond the baseline below which a component is the direct path: no landmark can be that near."""
FAR = 1e5
"""Length [m], and standard deviation of anything, that stands for an infinite one."""
SIDED = 3.0
"""Log odds beyond which a component is held for the panel's, or for another's: 19 in 20."""
STRANGERS = np.array([1.3, 2.0, 3.0])
"""Factor on the standard deviations of returns over 0, 1 and 2 walls, for paths in their cell that the map lacks."""
PRUNE_STRIDE = 5
"""Cycles between two looks at what should go, births apart."""
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
    config: SlamConfig
    particles: Any
    """The engine's belief over pose, recent poses and features."""
    book: Book
    tracks: Tracks
    time: Floats
    """(W,) times [s] of the last W cycles."""
    health: Health
    body: Body
    ris: DataSheet | None
    sensor: SensorModel
    """What the agent is told of its receiver."""

    @property
    def radio(self) -> RadioConfig:
        """The radio that the receiver belongs to."""
        return self.sensor.radio


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
    ris: DataSheet | None,
    sensor: SensorModel,
    config: SlamConfig,
    *,
    rng: np.random.Generator,
) -> FilterState:
    """Particles drawn from the start prior, and an empty map."""
    panels = 1 if ris is None else len(ris.panels)
    return FilterState(
        0,
        config,
        engine_of(config).begin(start, config, rng=rng),
        empty_book(panels),
        no_tracks(config.window, panels),
        np.zeros(config.window),
        Health(),
        body,
        ris,
        sensor,
    )


def revisit(state: FilterState, start: StartPrior, config: SlamConfig, *, rng: np.random.Generator) -> FilterState:
    """Another run, or another agent, on the map of an earlier one: landmarks, walls and who they are stay known.

    The map keeps the covariance that it had; its frame is the earlier run's, and so must be the start's.
    """
    fresh, moments = init(start, state.body, state.ris, state.sensor, config, rng=rng), believed(state)
    particles = engine_of(config).furnish(fresh.particles, moments.features, moments.covariance[POSE:, POSE:])
    count = len(state.book.ident)
    book = state.book._replace(shown=np.ones((count, 2)), drift=np.zeros((count, 3)))
    return fresh._replace(particles=particles, book=book)


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
    """Advance by one cycle: `dt` [s] since the last, `heading` [rad], `code` as the agent believes it was applied.

    Raises
    ------
    ConfigError
        One of them is no number, or not of the panel; or a component's panel is not named.
    """
    check_step(dt, heading, code, state.ris)
    check_sides(measurement, state.ris)
    state = _move(state, dt, heading, config, rng=rng)
    glance = glance_of(measurement, state.radio)
    landmark = np.where(is_los(glance, state.body), REMOVED, UNUSED)
    # by delay and direction, so that nothing (whose turn it is, ties) hangs on the order of the report
    order = np.lexsort(glance.seen.T[::-1])
    free = order[landmark[order] == UNUSED]
    glance = glance.take(free)
    moments = believed(state)
    belief = Belief(moments.features, state.book, _poses(state, moments), state.body, state.sensor, state.ris)
    expected = expected_returns(belief, code, config.max_bounces, config.use_vt)
    tracks = advance(state.tracks, dt, state.cycle, _bend(moments))
    outlook = look_ahead(belief, expected, moments, tracks, glance.side is not None)
    hidden = hidden_tracks(outlook, tracks, config.gate)
    strangers = stranger_density(glance, state.sensor, config.new_density)
    picks = associate(candidates(outlook, tracks, hidden), glance, config.gate, strangers)

    num_returns = len(expected.log_amplitude)
    hit = (picks[:num_returns] >= 0).nonzero()[0]
    taken = picks[hit]
    used = outlook.measures[hit]
    updated = _correct(state, outlook, hit[used], glance, taken[used], rng=rng)
    state = state._replace(particles=updated.particles)
    white = np.zeros((len(hit), 3))
    white[used] = updated.white
    book, names = learn(belief, believed(state), outlook, Hits(hit, taken, white), glance, code, rng=rng)
    landmark[free[taken]] = names
    tracks, removed = _follow(state, _rates(moments), tracks, glance, picks, num_returns, config)
    landmark[free[removed]] = REMOVED
    if min(book.holders) < 0:  # once it is known, no track needs to be it
        tracks = weigh_tracks(tracks, belief, code)
    state = _tidy(state._replace(tracks=tracks, book=book), outlook, belief, config, rng=rng)

    engine = engine_of(config)
    ess = engine.effective_size(state.particles)
    particles, resampled = engine.thin(state.particles, config, rng=rng)
    dof = 3 * int(used.sum())
    certain = expected.likely & expected.founding & ~outlook.merger.outshone
    weight = certain * shown_share(belief.book, expected)
    health = check(state.health, updated.nis, dof, float(weight[hit].sum()), float(weight.sum()))
    outcome = _outcome(len(measurement), len(state.book.ident), health)
    count = len(state.book.points)
    info = StepInfo(landmark, ess, resampled, updated.nis, dof, updated.log_evidence, count, outcome)
    return state._replace(particles=particles, health=health), info


def believed(state: FilterState) -> Moments:
    """Mean and covariance of pose and map."""
    return engine_of(state.config).moments(state.particles)


def _poses(state: FilterState, moments: Moments) -> Poses:
    return poses_of(moments.position, np.asarray(moments.heading), state.body)


def _correct(
    state: FilterState,
    outlook: Outlook,
    hit: Integers,
    glance: Glance,
    taken: Integers,
    *,
    rng: np.random.Generator,
) -> Told:
    """The belief after the returns `hit` were seen as measurements `taken`."""
    partner = outlook.merger.partner[hit]
    returns = compact(outlook.expected.returns, hit)
    paired = (partner >= 0).any()
    twin = compact(outlook.expected.returns, np.where(partner >= 0, partner, hit)) if paired else returns
    strangers = STRANGERS[np.minimum(outlook.expected.bounces[hit], 2)]
    std = np.hypot(glance.std[taken] * strangers[:, None], outlook.merger.disturbance[hit])
    anchor, seen = state.book.anchor, glance.seen[taken]
    engine = engine_of(state.config)
    return engine.update(state.particles, returns, twin, anchor, state.body, seen, std, rng=rng)


def _tidy(
    state: FilterState, outlook: Outlook, belief: Belief, config: SlamConfig, *, rng: np.random.Generator
) -> FilterState:
    """Births and deaths: at most one track becomes a feature; features that should not be there go."""
    moments, book, particles, engine = believed(state), state.book, state.particles, engine_of(config)
    past = Past(*engine.trail(particles, np.arange(config.window)), state.time, state.body, state.cycle)
    row, tracks, birth = examine(
        state.tracks, moments, book, outlook, past, free_space(state.radio), state.sensor.threshold, config
    )
    if birth is not None:
        particles = engine.settle(particles, birth, state.body, rng=rng)
        book = birth.enter(book)
    tracks = tracks.keep(np.arange(len(tracks.misses)) != row)
    if birth is None and state.cycle % PRUNE_STRIDE:
        return state._replace(particles=particles, book=book, tracks=tracks)
    keep = keepers(engine.moments(particles), book, outlook, belief, config)
    if not keep.all():
        particles, book = engine.drop(particles, keep), strike(book, keep)
    return state._replace(particles=particles, book=book, tracks=tracks)


def _follow(
    state: FilterState,
    rates: Floats,
    tracks: Tracks,
    glance: Glance,
    picks: Integers,
    num_returns: int,
    config: SlamConfig,
) -> tuple[Tracks, Integers]:
    """Tracks extended, begun and ended; and which measurements were taken for wall returns."""
    bright = (glance.ratio > config.specular_ratio) & (glance.sides < PANEL)
    kept = (picks[num_returns:] >= 0).nonzero()[0]
    used = picks[num_returns:][kept]
    tracks = extend(tracks, kept, glance, used, bright, state.cycle)
    free = np.ones(len(bright), dtype=np.bool_)
    free[picks[picks >= 0]] = False
    spare, count = free.nonzero()[0], len(tracks.misses)
    tracks = begin(tracks, glance, spare, bright, rates, state.cycle)
    if config.classifier != "amplitude":
        position, heading = engine_of(config).trail(state.particles, np.arange(config.window))
        tracks = sift(tracks, position, heading, state.cycle, state.body, state.radio, config.classifier)
    rows = np.concatenate([kept, count + np.arange(len(spare))])
    removed = np.concatenate([used, spare])[tracks.specular[rows]]
    return tracks.keep(~has_ended(tracks, state.cycle, config.max_misses)), removed


def glance_of(measurement: Measurement, radio: RadioConfig) -> Glance:
    """A measurement in the filter's units; nothing stays infinite, no standard deviation zero."""
    length = np.clip(SPEED_OF_LIGHT * measurement.tau, 0.0, FAR)
    amplitude = np.clip(measurement.amplitude, 1e-30, 1e30)
    free = np.exp(free_space(radio)) / np.maximum(length, 1e-3)
    std = np.concatenate([SPEED_OF_LIGHT * measurement.tau_std[:, None], measurement.cosines_std], axis=1)
    return Glance(
        np.concatenate([length[:, None], np.clip(measurement.cosines, -FAR, FAR)], axis=1),
        np.clip(std, 1e-5, FAR),
        np.log(amplitude),
        np.minimum(measurement.amplitude_std / amplitude, 1.0),
        np.clip(measurement.amplitude_std, 1e-30, 1e30),
        amplitude / free,
        *side_of(measurement.from_panel, measurement.panel),
        measurement.panel,
    )


def stranger_density(glance: Glance, sensor: SensorModel, new_density: float) -> Floats:
    """(M,) expected new or false components per metre, unit of each cosine and e-fold of amplitude, where each lies.

    False ones are as strong as noise that passes the threshold, hence rare where a component is strong.
    """
    snr = sensor.radio.integrated_snr(np.exp(glance.log_amplitude))
    false = sensor.false_alarm_density(glance.seen[:, 0] / SPEED_OF_LIGHT, glance.seen[:, 1:]) / SPEED_OF_LIGHT
    return new_density + false * 2.0 * snr * sensor.false_alarm_snr_density(snr)


def side_of(probability: Floats | None, panel: Integers | None = None) -> tuple[Integers | None, Floats | None]:
    """Side (M,) of components that ran over a panel with a probability (M,), and its log odds; None without them.

    What may be either is left open. `panel` (M,): which of several panels that is.
    """
    if probability is None:
        return None, None
    odds = np.log(probability / (1.0 - probability))
    return np.where(odds > SIDED, PANEL + (0 if panel is None else panel), np.where(odds < -SIDED, OTHER, UNTOLD)), odds


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
    """The belief carried to the next cycle, whose pose joins the trail."""
    cycle = state.cycle + 1
    slot, last = cycle % config.window, state.cycle % config.window
    accelerate = state.health.haste * config.sigma_a * config.axes
    course, engine = float(wrap(np.asarray(heading))), engine_of(config)
    particles = engine.propagate(state.particles, dt, accelerate, course, slot, config, rng=rng)
    time = state.time.copy()
    time[slot] = state.time[last] + dt
    return state._replace(cycle=cycle, particles=particles, time=time)


def _speed(moments: Moments) -> float:
    return float(np.linalg.norm(moments.velocity)) + 0.02


def _rates(moments: Moments) -> Floats:
    """Spread (3,) of a new track's rates: both legs may shorten by the speed; half a metre is near for a landmark."""
    speed = _speed(moments)
    return np.array([2.0 * speed, speed / 0.5, speed / 0.5])


def _bend(moments: Moments) -> Floats:
    """Standard deviation (3,) of the drift of a track's rates [1/s^2] at the speed of the agent."""
    speed = _speed(moments)
    return np.array([0.02 + speed**2, 0.02 + speed**2, 0.02 + speed**2])


def _outcome(num_measurements: int, num_features: int, health: Health) -> Outcome:
    if num_measurements == 0:
        return Outcome.NO_MEASUREMENTS
    if num_features == 0:
        return Outcome.NO_LANDMARKS
    return Outcome.DIVERGED if health.diverged else Outcome.OK
