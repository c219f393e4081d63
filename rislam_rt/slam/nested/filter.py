"""The nested filter, one cycle of it: predict, associate, update, learn who is who, grow and prune the map."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.geometry.angles import wrap
from rislam_rt.model import Body, DataSheet, Measurement, RadioConfig, RisCode, SensorModel
from rislam_rt.slam.associate import associate
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.inputs import check_sides, check_step
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.nested.belief_moments import POSE, Moments
from rislam_rt.slam.nested.birth import Past, examine
from rislam_rt.slam.nested.candidates import PredictedMeasurements, candidates, hidden_tracks, look_ahead
from rislam_rt.slam.nested.divergence_monitor import DivergenceMonitor, check
from rislam_rt.slam.nested.landmark_table import LandmarkTable, empty_table, remove
from rislam_rt.slam.nested.landmark_update import Hits, learn
from rislam_rt.slam.nested.measurement_prediction import MapBelief, detection_share, expected_returns
from rislam_rt.slam.nested.panel_candidate import weigh_tracks
from rislam_rt.slam.nested.particles import operations
from rislam_rt.slam.nested.particles.operations import ParticleUpdate, PointParticles
from rislam_rt.slam.nested.prune import keepers
from rislam_rt.slam.nested.track_classification import classify_tracks
from rislam_rt.slam.nested.tracks import LandmarkTracks, advance, begin, extend, has_ended, no_tracks
from rislam_rt.slam.observations import PANEL, Observations, free_space, is_los, observations_of, stranger_density
from rislam_rt.slam.returns import Poses, compact
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.step_info import REMOVED, UNUSED, StepInfo, StepOutcome

STRANGERS = np.array([1.3, 2.0, 3.0])
"""Factor on the standard deviations of returns over 0, 1 and 2 walls, for paths in their cell that the map lacks."""
PRUNE_STRIDE = 5
"""Cycles between two looks at what should go, births apart."""


class NestedState(NamedTuple):
    """All that the filter knows."""

    cycle: int
    config: SlamConfig
    particles: PointParticles
    """The belief over pose, recent poses and features."""
    table: LandmarkTable
    tracks: LandmarkTracks
    time: Floats
    """(W,) times [s] of the last W cycles."""
    monitor: DivergenceMonitor
    body: Body
    ris: DataSheet | None
    sensor: SensorModel
    """What the agent is told of its receiver."""

    @property
    def radio(self) -> RadioConfig:
        """The radio that the receiver belongs to."""
        return self.sensor.radio


def init(
    start: StartPrior,
    body: Body,
    ris: DataSheet | None,
    sensor: SensorModel,
    config: SlamConfig,
    *,
    rng: np.random.Generator,
) -> NestedState:
    """The nested filter's state at the start: particles drawn from the start prior, and an empty map."""
    panels = 1 if ris is None else len(ris.panels)
    return NestedState(
        0,
        config,
        operations.begin(start, config, rng=rng),
        empty_table(panels),
        no_tracks(config.nested.window, panels),
        np.zeros(config.nested.window),
        DivergenceMonitor(),
        body,
        ris,
        sensor,
    )


def revisit(state: NestedState, start: StartPrior, config: SlamConfig, *, rng: np.random.Generator) -> NestedState:
    """The nested filter of another run, or another agent, on the map of an earlier one: landmarks, walls and who they
    are stay known.

    The map keeps the covariance that it had; its frame is the earlier run's, and so must be the start's.
    """
    fresh, moments = init(start, state.body, state.ris, state.sensor, config, rng=rng), believed(state)
    particles = operations.set_prior_map(fresh.particles, moments.features, moments.covariance[POSE:, POSE:])
    count = len(state.table.ident)
    table = state.table._replace(detection_rate=np.ones((count, 2)), drift=np.zeros((count, 3)))
    return fresh._replace(particles=particles, table=table)


def step(
    state: NestedState,
    measurement: Measurement,
    code: RisCode | None,
    dt: float,
    heading: float,
    config: SlamConfig,
    *,
    rng: np.random.Generator,
) -> tuple[NestedState, StepInfo]:
    """Advance the nested filter by one cycle: `dt` [s] since the last, `heading` [rad], `code` believed applied.

    Raises
    ------
    ConfigError
        One of them is no number, or not of the panel; or a component's panel is not named.
    """
    check_step(dt, heading, code, state.ris)
    check_sides(measurement, state.ris)
    state = _move(state, dt, heading, config, rng=rng)
    observations = observations_of(measurement, state.radio)
    landmark = np.where(is_los(observations, state.body), REMOVED, UNUSED)
    # by delay and direction, so that nothing (whose turn it is, ties) hangs on the order of the report
    order = np.lexsort(observations.seen.T[::-1])
    free = order[landmark[order] == UNUSED]
    observations = observations.take(free)
    moments = believed(state)
    belief = MapBelief(moments.features, state.table, _poses(state, moments), state.body, state.sensor, state.ris)
    expected = expected_returns(belief, code, config.max_bounces, config.use_vt)
    tracks = advance(state.tracks, dt, state.cycle, _bend(moments))
    predicted = look_ahead(belief, expected, moments, tracks, observations.side is not None)
    hidden = hidden_tracks(predicted, tracks, config.nested.gate)
    strangers = stranger_density(observations, state.sensor, config.new_density)
    picks = associate(candidates(predicted, tracks, hidden), observations, config.nested.gate, strangers)

    num_returns = len(expected.log_amplitude)
    hit = (picks[:num_returns] >= 0).nonzero()[0]
    taken = picks[hit]
    used = predicted.measures[hit]
    updated = _correct(state, predicted, hit[used], observations, taken[used], rng=rng)
    state = state._replace(particles=updated.particles)
    white = np.zeros((len(hit), 3))
    white[used] = updated.white
    table, names = learn(belief, believed(state), predicted, Hits(hit, taken, white), observations, code, rng=rng)
    landmark[free[taken]] = names
    tracks, removed = _follow(state, _rates(moments), tracks, observations, picks, num_returns, config)
    landmark[free[removed]] = REMOVED
    if min(table.holders) < 0:  # once it is known, no track needs to be it
        tracks = weigh_tracks(tracks, belief, code)
    state = _tidy(state._replace(tracks=tracks, table=table), predicted, belief, config, rng=rng)

    ess = operations.effective_size(state.particles)
    particles, resampled = operations.resample(state.particles, config, rng=rng)
    dof = 3 * int(used.sum())
    certain = expected.likely & expected.by_parent & ~predicted.groups.outshone
    weight = certain * detection_share(belief.table, expected)
    monitor = check(state.monitor, updated.nis, dof, float(weight[hit].sum()), float(weight.sum()))
    outcome = _outcome(len(measurement), len(state.table.ident), monitor)
    count = len(state.table.points)
    info = StepInfo(landmark, ess, resampled, updated.nis, dof, updated.log_evidence, count, outcome)
    return state._replace(particles=particles, monitor=monitor), info


def believed(state: NestedState) -> Moments:
    """Mean and covariance of pose and map that the nested filter believes in."""
    return operations.moments(state.particles)


def _poses(state: NestedState, moments: Moments) -> Poses:
    return poses_of(moments.position, np.asarray(moments.heading), state.body)


def _correct(
    state: NestedState,
    predicted: PredictedMeasurements,
    hit: Integers,
    observations: Observations,
    taken: Integers,
    *,
    rng: np.random.Generator,
) -> ParticleUpdate:
    """The nested filter's belief after the returns `hit` were seen as measurements `taken`."""
    partner = predicted.groups.partner[hit]
    returns = compact(predicted.expected.returns, hit)
    paired = (partner >= 0).any()
    twin = compact(predicted.expected.returns, np.where(partner >= 0, partner, hit)) if paired else returns
    strangers = STRANGERS[np.minimum(predicted.expected.bounces[hit], 2)]
    std = np.hypot(observations.std[taken] * strangers[:, None], predicted.groups.disturbance[hit])
    anchor, seen = state.table.anchor, observations.seen[taken]
    return operations.update(state.particles, returns, twin, anchor, state.body, seen, std, rng=rng)


def _tidy(
    state: NestedState,
    predicted: PredictedMeasurements,
    belief: MapBelief,
    config: SlamConfig,
    *,
    rng: np.random.Generator,
) -> NestedState:
    """Births and deaths in the nested filter: at most one track becomes a feature; features that should not be go."""
    moments, table, particles = believed(state), state.table, state.particles
    past = Past(*operations.trail(particles, np.arange(config.nested.window)), state.time, state.body, state.cycle)
    row, tracks, birth = examine(
        state.tracks, moments, table, predicted, past, free_space(state.radio), state.sensor.threshold, config
    )
    if birth is not None:
        particles = operations.initialise_landmark(particles, birth, state.body, rng=rng)
        table = birth.enter(table)
    tracks = tracks.keep(np.arange(len(tracks.misses)) != row)
    if birth is None and state.cycle % PRUNE_STRIDE:
        return state._replace(particles=particles, table=table, tracks=tracks)
    keep = keepers(operations.moments(particles), table, predicted, belief, config)
    if not keep.all():
        particles, table = operations.drop(particles, keep), remove(table, keep)
    return state._replace(particles=particles, table=table, tracks=tracks)


def _follow(
    state: NestedState,
    rates: Floats,
    tracks: LandmarkTracks,
    observations: Observations,
    picks: Integers,
    num_returns: int,
    config: SlamConfig,
) -> tuple[LandmarkTracks, Integers]:
    """The nested filter's tracks extended, begun and ended; and which measurements were taken for wall returns."""
    bright = (observations.ratio > config.nested.specular_ratio) & (observations.sides < PANEL)
    kept = (picks[num_returns:] >= 0).nonzero()[0]
    used = picks[num_returns:][kept]
    tracks = extend(tracks, kept, observations, used, bright, state.cycle)
    free = np.ones(len(bright), dtype=np.bool_)
    free[picks[picks >= 0]] = False
    spare, count = free.nonzero()[0], len(tracks.misses)
    tracks = begin(tracks, observations, spare, bright, rates, state.cycle)
    if config.nested.classifier != "amplitude":
        position, heading = operations.trail(state.particles, np.arange(config.nested.window))
        tracks = classify_tracks(
            tracks, position, heading, state.cycle, state.body, state.radio, config.nested.classifier
        )
    rows = np.concatenate([kept, count + np.arange(len(spare))])
    removed = np.concatenate([used, spare])[tracks.specular[rows]]
    return tracks.keep(~has_ended(tracks, state.cycle, config.nested.max_misses)), removed


def _move(
    state: NestedState, dt: float, heading: float, config: SlamConfig, *, rng: np.random.Generator
) -> NestedState:
    """The nested filter's belief carried to the next cycle, whose pose joins the trail."""
    cycle = state.cycle + 1
    slot, last = cycle % config.nested.window, state.cycle % config.nested.window
    accelerate = state.monitor.haste * config.sigma_a * config.axes
    course = float(wrap(np.asarray(heading)))
    particles = operations.propagate(state.particles, dt, accelerate, course, slot, config, rng=rng)
    time = state.time.copy()
    time[slot] = state.time[last] + dt
    return state._replace(cycle=cycle, particles=particles, time=time)


def _speed(moments: Moments) -> float:
    return float(np.linalg.norm(moments.velocity)) + 0.02


def _rates(moments: Moments) -> Floats:
    """(3,) deviations of a new track's rates: both legs may shorten by the speed; half a metre is near for a
    landmark."""
    speed = _speed(moments)
    return np.array([2.0 * speed, speed / 0.5, speed / 0.5])


def _bend(moments: Moments) -> Floats:
    """Standard deviation (3,) of the drift of a track's rates [1/s^2] at the speed of the agent."""
    speed = _speed(moments)
    return np.array([0.02 + speed**2, 0.02 + speed**2, 0.02 + speed**2])


def _outcome(num_measurements: int, num_features: int, monitor: DivergenceMonitor) -> StepOutcome:
    if num_measurements == 0:
        return StepOutcome.NO_MEASUREMENTS
    if num_features == 0:
        return StepOutcome.NO_LANDMARKS
    return StepOutcome.DIVERGED if monitor.diverged else StepOutcome.OK
