"""One step of BP-SLAM on its factor graph: predict, evaluate ranges, associate, update agent and features, give birth.

Source: Leitinger, Meyer, Hlawatsch, Witrisal, Tufvesson and Win, "A belief propagation algorithm for multipath-based
SLAM", IEEE TWC 2019 (arXiv 1801.04463), section V; undetected features as a Poisson field that thins as it is observed.

Every message between the agent and a feature is an integral over the other's cloud. Each particle of the one meets
`num_pairings` particles of the other, spread evenly over its cells, and the same likelihoods serve both messages.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.schemes.bp_slam_static.association import associate_anchor, evaluate_ranges, pair_message
from rislam_rt.slam.schemes.bp_slam_static.config import BpSlamStaticConfig
from rislam_rt.slam.schemes.bp_slam_static.coupling import carry, correct_slopes
from rislam_rt.slam.schemes.bp_slam_static.features import (
    Features,
    born,
    join,
    predict_features,
    prune,
    refresh,
    select,
)
from rislam_rt.slam.schemes.shared.ranges import RangeModel
from rislam_rt.slam.schemes.shared.resampling import (
    cell_levels,
    cell_order,
    effective_fraction,
    kernel_width,
    normalised_rows,
    smooth,
    systematic_rows,
)
from rislam_rt.slam.schemes.shared.scan import Scan, birth_ratio

AGENT_MEMORY = 100.0
"""Steps over which the agent's error stays much the same."""


class FactorGraphBelief(NamedTuple):
    """Agent of N equally likely particles, and potential features."""

    state: Floats
    """(N, 2D) position [m] and velocity [m/s]."""
    features: Features
    undetected: Floats
    """(A,) features per anchor that exist and were never seen, expected."""
    next_ident: int

    @property
    def position(self) -> Floats:
        """(N, D) [m]."""
        return self.state[:, : self.state.shape[1] // 2]


class UpdateInfo(NamedTuple):
    """How a step went."""

    effective: float
    """Effective sample size of the agent over N."""
    rounds: int
    """Of data association, the most of all anchors."""
    claimed: tuple[Floats, ...]
    """Per anchor (K_a, M+1): marginals of the association; last column: missed."""
    claimants: tuple[Integers, ...]
    """Per anchor (K_a,): numbers of the features of those rows."""
    predicted: tuple[Floats, ...]
    """Per anchor (K_a, 2): mean and standard deviation [m] of the range predicted for each."""
    log_evidence: float
    """Logarithm of the mean weight of the agent's particles; clutter alone counts as 0."""


def predict_belief(
    belief: FactorGraphBelief, dt: float, accelerate: Floats, config: BpSlamStaticConfig, *, rng: np.random.Generator
) -> FactorGraphBelief:
    """Agent's states after white acceleration of deviations `accelerate` (D,) [m/s^2]; features survive or not."""
    before = rng.permutation(belief.state)
    position, velocity = np.split(before, 2, axis=1)
    push = accelerate * rng.standard_normal(position.shape)
    after = np.concatenate([position + dt * velocity + 0.5 * dt**2 * push, velocity + dt * push], axis=1)
    unseen = config.survival_probability * (1.0 - config.detection_probability) * belief.undetected
    features = carry(belief.features, before, after)
    return belief._replace(
        state=after,
        features=predict_features(features, config, rng=rng),
        undetected=unseen + config.birth_mean,
    )


def update_belief(
    belief: FactorGraphBelief,
    scans: tuple[Scan, ...],
    model: RangeModel,
    config: BpSlamStaticConfig,
    *,
    rng: np.random.Generator,
) -> tuple[FactorGraphBelief, UpdateInfo]:
    """Update static BP-SLAM's belief by one scan of every anchor; the agent's message to features is its prediction, as
    published."""
    state, features = rng.permutation(belief.state), belief.features
    dims = belief.position.shape[1]
    shifts = (np.arange(config.num_pairings) * len(state)) // config.num_pairings
    reach = _reach(state, features, shifts, model)
    gains = np.ones(reach.shape)
    weight = features.weight
    newborn, results, claimants = [], [], []
    next_ident = belief.next_ident
    for anchor, scan in enumerate(scans):
        rows = np.flatnonzero(features.anchor == anchor)
        seen = [evaluate_ranges(reach[row], scan, config) for row in rows]
        fresh = 1.0 + birth_ratio(scan, float(belief.undetected[anchor]), model, dims, config.odds)
        result = associate_anchor(seen, weight[rows], features.existence[rows], fresh, config)
        for number, row in enumerate(rows):
            gains[row] = pair_message(seen[number], result.to_feature[number], config)
        alive = result.unclaimed * (fresh - 1.0) / fresh
        new = np.flatnonzero(alive >= config.pruning_threshold)
        newborn.append(born(scan.take(new), anchor, state[:, :dims], alive[new], model, next_ident, config, rng=rng))
        next_ident += len(new)
        results.append(result)
        claimants.append(features.ident[rows])
    over = np.einsum("kn,ksn->k", weight, gains) / len(shifts)
    existence = features.existence * over / (features.existence * over + 1.0 - features.existence)
    log_agent = _to_agent(gains, weight, features.existence, shifts)
    after, effective = _resample_agent(state, log_agent, rng=rng)
    noise = np.concatenate([scan.std for scan in scans]) if scans else np.zeros(0)
    thickness = float(noise.mean()) if len(noise) else config.range_std
    old = _update_features(
        features._replace(existence=existence), gains, state, shifts, after.mean(axis=0), thickness, config, rng=rng
    )
    new_features = prune(join([old, _moved(join(newborn), state, after)]), config)
    rounds = max((result.rounds for result in results), default=0)
    predicted = _predicted(reach, weight)
    info = UpdateInfo(
        effective,
        rounds,
        tuple(result.feature for result in results),
        tuple(claimants),
        tuple(predicted[features.anchor == anchor] for anchor in range(len(scans))),
        float(np.logaddexp.reduce(log_agent) - np.log(len(log_agent))),
    )
    return FactorGraphBelief(after, new_features, belief.undetected, next_ident), info


def _reach(state: Floats, features: Features, shifts: Integers, model: RangeModel) -> Floats:
    """Ranges (K, S, N) in the update: feature particle n meets agent particle n + shift, round the end."""
    count, dims = state.shape[0], state.shape[1] // 2
    lean = (state - state.mean(axis=0)) @ features.slope
    twice, lean_twice = np.concatenate([state, state]), np.concatenate([lean, lean], axis=1)
    reach = np.empty((len(features.ident), len(shifts), count))
    for row, shift in enumerate(shifts):
        window = slice(shift, shift + count)
        reach[:, row] = model.ranges(twice[window, :dims], features.cloud + lean_twice[:, window])
    return reach


def _predicted(reach: Floats, weight: Floats) -> Floats:
    """Mean and standard deviation (K, 2) of the ranges (K, S, N) that the update predicts."""
    mean = np.einsum("kn,ksn->k", weight, reach) / reach.shape[1]
    square = np.einsum("kn,ksn->k", weight, (reach - mean[:, None, None]) ** 2) / reach.shape[1]
    return np.stack([mean, np.sqrt(square)], axis=1)


def _to_agent(gains: Floats, weight: Floats, existence: Floats, shifts: Integers) -> Floats:
    """Messages to the agent as log weights (N,): of every feature, the mean factor over the particles met."""
    mean, total = np.zeros(weight.shape), np.zeros(weight.shape)
    for row, shift in enumerate(shifts):
        mean += np.roll(weight * gains[:, row], shift, axis=1)
        total += np.roll(weight, shift, axis=1)
    floor = 1e-12 / weight.shape[1]
    factor = (mean + floor) / (total + floor)
    return np.log(existence[:, None] * factor + 1.0 - existence[:, None]).sum(axis=0)


def _moved(newborn: Features, before: Floats, after: Floats) -> Features:
    """New features, about the agent's mean after the update."""
    shift = (after.mean(axis=0) - before.mean(axis=0)) @ newborn.slope
    return newborn._replace(cloud=newborn.cloud + shift[:, None])


def _resample_agent(state: Floats, log_weight: Floats, *, rng: np.random.Generator) -> tuple[Floats, float]:
    """Equally likely states (N, 2D), widened where many share an ancestor."""
    weight = normalised_rows(log_weight[None])
    effective = effective_fraction(weight)
    scale = np.maximum(state.std(axis=0), 1e-12)
    order = cell_order((state / scale)[None], cell_levels(len(state)))
    chosen = state[order[0, systematic_rows(weight[:, order[0]], rng=rng)[0]]]
    width = kernel_width(len(state), state.shape[1], effective)
    return smooth(chosen[None], width, 0, rng=rng)[0], float(effective[0])


def _patience(features: Features, state: Floats, noise: float) -> Floats:
    """Powers (K,) of the factors that the update of a feature learns from, one where it is known well.

    A factor holds the noise of its own step and the agent's error `e`, which the next steps share. Over `n` steps the
    feature may learn `1 / (noise^2 / n + var e)`, and not n times the first step's share; the power
    `1 / (1 + n var e / noise^2)` gives it that. A feature that is known well keeps what it shares with the agent in its
    slope and needs no such care; one spread along an arc does, since no line follows an arc. The share of the second
    kind is taken as `v / (v + 1 m^2)` with v the variance of the cloud.
    """
    dims = features.cloud.shape[2]
    weight = features.weight
    centre = np.einsum("kn,knd->kd", weight, features.cloud)
    square = np.einsum("kn,knd->k", weight, (features.cloud - centre[:, None]) ** 2)
    wide = square / (1.0 + square)
    agent = state[:, :dims].var(axis=0).mean()
    return np.asarray(1.0 / (1.0 + AGENT_MEMORY * wide * agent / noise**2))


def _update_features(
    features: Features, gains: Floats, state: Floats, shifts: Integers, mean_after: Floats, thickness: float,
    config: BpSlamStaticConfig, *, rng: np.random.Generator,
) -> Features:  # fmt: skip
    """Features updated: weights by the mean factor of every particle, slope by one pair a particle."""
    kept = features.known | (features.existence >= config.pruning_threshold)
    features, gains = select(features, kept), gains[kept]
    free = ~features.known[:, None]
    power = _patience(features, state, thickness) if config.coupled else np.ones(len(gains))
    log_weight = features.log_weight + np.where(free, power[:, None] * np.log(gains.mean(axis=1)), 0.0)
    log_weight -= log_weight.max(axis=1, keepdims=True, initial=-np.inf)
    cloud, slope = features.cloud, features.slope
    if config.coupled:
        edges = np.cumsum(gains, axis=1)
        pick = (edges[:, -1:] * rng.random((len(gains), 1, len(state))) > edges).sum(axis=1)
        own = state[(np.arange(len(state)) + shifts[pick]) % len(state)]
        line = np.where(free[..., None], correct_slopes(features, gains, state, shifts, thickness), slope)
        met = cloud + (own - state.mean(axis=0)) @ slope
        cloud, slope = met - (own - mean_after) @ line, line
    return refresh(features._replace(cloud=cloud, log_weight=log_weight, slope=slope), rng=rng)
