"""Channel-SLAM, delay only: agent particles, a tracker's labels, a virtual transmitter a path in every particle.

Source: Gentner et al., "Multipath assisted positioning with simultaneous localization and mapping", IEEE TWC 2016. As
there, labels are taken as known, there is no model of detection, and a path that ends takes its virtual transmitter
with it. Unlike there, no transmitter stands in the room: both ends move with the agent, so that a virtual transmitter
is a point `a` at range `|p_T - a| + |a - p_R|`.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Body, MapEstimate, Measurement, RadioConfig, RisCode, RisSpec, SlamEstimate
from rislam_rt.slam.config import StartPrior
from rislam_rt.slam.filter import REMOVED, UNUSED, Outcome, StepInfo
from rislam_rt.slam.moments import normalised, systematic_ancestors
from rislam_rt.slam.schemes.bp_slam.ranges import Bistatic
from rislam_rt.slam.schemes.channel_slam.config import ChannelSlamConfig
from rislam_rt.slam.schemes.channel_slam.tracker import Tracks, advance, assign, follow, no_tracks
from rislam_rt.slam.schemes.channel_slam.transmitters import (
    Transmitters,
    born,
    join,
    moments,
    no_transmitters,
    prune,
    update,
)
from rislam_rt.slam.schemes.delays import point_ranges
from rislam_rt.slam.schemes.resampling import effective_fraction

STRAIN_RATE = 0.1
"""Share of the latest cycle in the running means of squared innovations."""
NIS_LIMIT = 3.0
"""Running mean of the NIS per degree of freedom above which the filter says that it has diverged."""


class ChannelSlamState(NamedTuple):
    """All that the filter knows."""

    agent: Floats
    """(N, 6) position [m] and velocity [m/s]."""
    log_weight: Floats
    """(N,), normalised."""
    transmitters: Transmitters
    tracks: Tracks
    strains: dict[int, float]
    """Running mean of the squared innovation of every virtual transmitter, by label."""
    next_label: int
    heading: float
    """[rad]."""
    strain: float
    """Running mean of the NIS per degree of freedom: 1 when all is well."""
    body: Body
    radio: RadioConfig


def init(
    start: StartPrior, body: Body, ris: RisSpec | None, radio: RadioConfig, config: ChannelSlamConfig, *,
    rng: np.random.Generator,
) -> ChannelSlamState:  # fmt: skip
    """Particles drawn from the start prior, and no paths. `ris` is taken for the interface and not used."""
    count, axes = config.num_particles, config.axes
    position = start.position + rng.standard_normal((count, 3)) * start.position_std * axes
    velocity = start.velocity + rng.standard_normal((count, 3)) * start.velocity_std * axes
    return ChannelSlamState(
        np.concatenate([position, velocity], axis=1),
        np.full(count, -np.log(count)),
        no_transmitters(count),
        no_tracks(),
        {},
        0,
        float(start.heading),
        1.0,
        body,
        radio,
    )


def predict(state: ChannelSlamState, dt: float, config: ChannelSlamConfig) -> SlamEstimate:
    """The belief carried over `dt` [s] without noise."""
    position, velocity = np.split(state.agent, 2, axis=1)
    return estimate(state._replace(agent=np.concatenate([position + dt * velocity, velocity], axis=1)), config)


def step(
    state: ChannelSlamState, measurement: Measurement, code: RisCode | None, dt: float, heading: float,
    config: ChannelSlamConfig, *, rng: np.random.Generator,
) -> tuple[ChannelSlamState, StepInfo]:  # fmt: skip
    """Advance by one cycle: `dt` [s] since the last, `heading` [rad]. `code` is there for the interface, not used."""
    state = state._replace(agent=_move(state.agent, dt, config, rng=rng), heading=float(heading))
    length, std, rows = point_ranges(measurement, state.body, state.radio, config.specular_ratio, config.smallest_std)
    turn = rotation_z(np.asarray(heading))
    upper = state.radio.array.pattern == "upper"
    model = Bistatic(turn @ state.body.tx_offset, turn @ state.body.rx_offset, upper)
    state, label = _label(state, length, std, dt, config)
    state, squares, evidence = _correct(state, label, length, std, model, config)
    state = _give_birth(state, label, length, std, model, config)
    ess = float(effective_fraction(np.exp(state.log_weight)[None])[0]) * config.num_particles
    low = ess < config.resample_below * config.num_particles
    if low:
        state = _resample(state, rng=rng)
    nis, dof = float(squares.sum()), len(squares)
    strain = state.strain + 0.5 * STRAIN_RATE * (nis / dof - state.strain) if dof else state.strain
    state = state._replace(strain=strain)
    landmark = np.full(len(measurement), REMOVED)
    landmark[rows] = np.where(np.isin(label, state.transmitters.label), label, UNUSED)
    shown = len(state.transmitters.starts)
    outcome = _outcome(len(measurement), shown, strain)
    return state, StepInfo(landmark, ess, low, nis, dof, evidence, shown, outcome)


def estimate(state: ChannelSlamState, config: ChannelSlamConfig) -> SlamEstimate:
    """Mean and covariance of the pose, samples of it, and virtual transmitters that are no longer anywhere."""
    weight = np.exp(state.log_weight)
    mean, covariance = _agent_moments(state.log_weight, state.agent)
    edges = np.cumsum(weight)
    comb = (np.arange(config.num_samples) + 0.5) / config.num_samples * edges[-1]
    rows = np.minimum(np.searchsorted(edges, comb), len(weight) - 1)
    return SlamEstimate(
        mean[:3],
        mean[3:],
        state.heading,
        covariance,
        state.agent[rows, :3],
        state.body,
        _map(state.transmitters, weight, config),
    )


def _move(agent: Floats, dt: float, config: ChannelSlamConfig, *, rng: np.random.Generator) -> Floats:
    """Discrete white-noise acceleration."""
    position, velocity = np.split(agent, 2, axis=1)
    push = config.sigma_a * config.axes * rng.standard_normal(position.shape)
    return np.concatenate([position + dt * velocity + 0.5 * dt**2 * push, velocity + dt * push], axis=1)


def _label(
    state: ChannelSlamState, length: Floats, std: Floats, dt: float, config: ChannelSlamConfig
) -> tuple[ChannelSlamState, Integers]:
    """Tracks after this cycle's ranges, and the label (M,) of each range; virtual transmitters of ended tracks go."""
    tracks = advance(state.tracks, dt, config.range_acceleration)
    found = assign(tracks, length, std, config.gate)
    speed = float(np.linalg.norm(np.exp(state.log_weight) @ state.agent[:, 3:]))
    tracks, label = follow(tracks, found, length, std, 2.0 * speed + 0.02, state.next_label)
    patience = np.where(tracks.hits >= config.confirm_hits, config.max_misses, 1)
    tracks = tracks.keep(tracks.misses <= patience)
    alive = state.transmitters.keep(np.isin(state.transmitters.label, tracks.label))
    first = max(state.next_label, int(label.max(initial=-1)) + 1)
    return state._replace(tracks=tracks, transmitters=alive, next_label=first), label


def _correct(
    state: ChannelSlamState, label: Integers, length: Floats, std: Floats, model: Bistatic, config: ChannelSlamConfig
) -> tuple[ChannelSlamState, Floats, float]:
    """Weights and virtual transmitters after their ranges; those that do not fit their path for long are dropped."""
    known = state.transmitters
    seen = np.isin(known.label, label)
    rest, hit = known.keep(~seen), known.keep(seen)
    names = hit.label[hit.starts]
    if not len(names):
        return state, np.zeros(0), 0.0
    order = np.argsort(label)
    rows = order[np.searchsorted(label[order], names)]
    weight = np.exp(state.log_weight)
    result = update(hit, state.agent[:, :3], weight, length[rows], std[rows], model, config.outlier_probability)
    log_weight, evidence = normalised(state.log_weight + result.log_likelihood)
    strains = dict(state.strains)
    for name, square in zip(names.tolist(), result.square.tolist(), strict=True):
        strains[name] = strains.get(name, 1.0) + STRAIN_RATE * (square - strains.get(name, 1.0))
    unfit = [name for name in names.tolist() if strains[name] > config.strain_limit]
    hit = prune(result.transmitters, np.exp(log_weight), config.prune_weight)
    hit = hit.keep(~np.isin(hit.label, unfit))
    joined = join([rest, hit])
    present = set(joined.label.tolist())
    strains = {name: value for name, value in strains.items() if name in present}
    return state._replace(log_weight=log_weight, transmitters=joined, strains=strains), result.square, evidence


def _give_birth(
    state: ChannelSlamState, label: Integers, length: Floats, std: Floats, model: Bistatic, config: ChannelSlamConfig
) -> ChannelSlamState:
    """A virtual transmitter for every confirmed track that was seen and has none."""
    ready = state.tracks.label[(state.tracks.hits >= config.confirm_hits) & (state.tracks.misses == 0)]
    known = state.transmitters
    for row in np.flatnonzero(np.isin(label, ready) & ~np.isin(label, known.label)):
        new = born(
            int(label[row]), state.agent[:, :3], float(length[row]), float(std[row]), model, config.num_directions
        )
        known = join([known, new])
    return state._replace(transmitters=known)


def _resample(state: ChannelSlamState, *, rng: np.random.Generator) -> ChannelSlamState:
    """Equally likely particles, each with the virtual transmitters of its ancestor.

    No kernel: to move an agent without its whole history breaks what ties it to its virtual transmitters, and was seen
    to make up knowledge of the course. The process noise alone keeps particles apart, as in the publication.
    """
    count = len(state.log_weight)
    rows = systematic_ancestors(state.log_weight, count, rng=rng)
    known = state.transmitters
    return state._replace(
        agent=state.agent[rows],
        log_weight=np.full(count, -np.log(count)),
        transmitters=known._replace(
            base=known.base[rows],
            mean=known.mean[rows],
            covariance=known.covariance[rows],
            log_share=known.log_share[rows],
        ),
    )


def _agent_moments(log_weight: Floats, agent: Floats) -> tuple[Floats, Floats]:
    """Weighted mean (6,) and covariance (6, 6) of the agent's states (N, 6)."""
    weight = np.exp(log_weight)
    mean = weight @ agent
    centred = agent - mean
    return mean, (centred * weight[:, None]).T @ centred


def _map(known: Transmitters, weight: Floats, config: ChannelSlamConfig) -> MapEstimate:
    mean, covariance = moments(known, weight)
    clear = np.trace(covariance, axis1=1, axis2=2) < config.shown_std**2
    count = int(clear.sum())
    return MapEstimate(
        known.label[known.starts][clear], mean[clear], covariance[clear], np.full(count, -1), np.zeros(count),
        np.zeros(count), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2)),
    )  # fmt: skip


def _outcome(num_measurements: int, num_paths: int, strain: float) -> Outcome:
    if num_measurements == 0:
        return Outcome.NO_MEASUREMENTS
    if num_paths == 0:
        return Outcome.NO_LANDMARKS
    return Outcome.DIVERGED if strain > NIS_LIMIT else Outcome.OK
