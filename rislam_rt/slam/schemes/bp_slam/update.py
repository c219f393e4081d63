"""One step of BP-SLAM on its factor graph: predict, evaluate ranges, associate, update agent and features, give birth.

Source: Leitinger, Meyer, Hlawatsch, Witrisal, Tufvesson and Win, "A belief propagation algorithm for multipath-based
SLAM", IEEE TWC 2019 (arXiv 1801.04463), section V; undetected features as a Poisson field that thins as it is observed.

Every message between the agent and a feature is an integral over the other's cloud. Each particle of the one meets
`num_pairings` particles of the other, spread evenly over its cells, and the same likelihoods serve both messages.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.schemes.bp_slam.association import Association, associate
from rislam_rt.slam.schemes.bp_slam.config import BpSlamConfig
from rislam_rt.slam.schemes.bp_slam.coupling import carry, regress
from rislam_rt.slam.schemes.bp_slam.features import (
    Features,
    Scan,
    birth_ratio,
    born,
    join,
    predict_features,
    prune,
    refresh,
    select,
)
from rislam_rt.slam.schemes.bp_slam.ranges import RangeModel
from rislam_rt.slam.schemes.resampling import (
    cell_levels,
    cell_order,
    effective_fraction,
    kernel_width,
    normalised_rows,
    smooth,
    systematic_rows,
)

GATE = 5.0
"""Standard deviations beyond which the likelihood of a range counts as zero (4e-6 of its peak)."""


class Belief(NamedTuple):
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


class _Pairs(NamedTuple):
    """Which particle meets which."""

    agent: Integers
    """(S, N) agent particle that feature particle n meets."""
    feature: Integers
    """(S, N) feature particle that agent particle n meets."""


class _Evaluation(NamedTuple):
    """Likelihood ratios p_d f(z|x,a) / clutter of one feature for the measurements within its gate."""

    measurement: Integers
    """(G,)."""
    ratio: Floats
    """(G, S, N) over pairings and feature particles."""


def predict_belief(
    belief: Belief, dt: float, accelerate: Floats, config: BpSlamConfig, *, rng: np.random.Generator
) -> Belief:
    """Discrete white-noise acceleration of standard deviations `accelerate` (D,) [m/s^2]; features survive or not."""
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
    belief: Belief, scans: tuple[Scan, ...], model: RangeModel, config: BpSlamConfig, *, rng: np.random.Generator
) -> tuple[Belief, UpdateInfo]:
    """One scan of every anchor into the belief. The agent's message to every feature is its prediction, as published."""
    state, features = rng.permutation(belief.state), belief.features
    count, dims = belief.position.shape
    pairs = _pair_up(count, config.num_pairings)
    lean = (state - state.mean(axis=0)) @ features.slope
    candidates = features.cloud[:, None] + lean[:, pairs.agent]
    reach = model.ranges(state[pairs.agent, :dims], candidates)
    weight = features.weight
    gains, existence = np.ones(reach.shape), features.existence.copy()
    log_agent = np.zeros(count)
    newborn, associations, claimants = [], [], []
    next_ident = belief.next_ident
    for anchor, scan in enumerate(scans):
        rows = np.flatnonzero(features.anchor == anchor)
        seen = [_evaluate(reach[row], scan, config) for row in rows]
        fresh = 1.0 + birth_ratio(scan, float(belief.undetected[anchor]), model, dims, config)
        result = _associate(seen, weight[rows], existence[rows], fresh, config)
        for number, row in enumerate(rows):
            gain, prior = _message(seen[number], result.to_feature[number], config), features.existence[row]
            log_agent += np.log(prior * _to_agent(gain, weight[row], pairs) + 1.0 - prior)
            over = float(weight[row] @ gain.mean(axis=0))
            existence[row] = prior * over / (prior * over + 1.0 - prior)
            gains[row] = gain
        alive = result.unclaimed * (fresh - 1.0) / fresh
        newborn.append(born(scan, anchor, state[:, :dims], alive, model, next_ident, rng=rng))
        next_ident += len(scan.length)
        associations.append(result)
        claimants.append(features.ident[rows])
    after, effective = _resample_agent(state, log_agent, rng=rng)
    old = features._replace(existence=existence)
    old = _update_features(old, candidates, gains, state[pairs.agent], after.mean(axis=0), config, rng=rng)
    info = UpdateInfo(
        effective,
        max((result.rounds for result in associations), default=0),
        tuple(result.feature for result in associations),
        tuple(claimants),
    )
    return Belief(after, prune(join([old, *newborn]), config), belief.undetected, next_ident), info


def _pair_up(count: int, pairings: int) -> _Pairs:
    """Shifts spread evenly over the particles; agents come in random order, features in that of their cells."""
    shift = ((np.arange(pairings) * count) // pairings)[:, None]
    return _Pairs((np.arange(count) + shift) % count, (np.arange(count) - shift) % count)


def _evaluate(reach: Floats, scan: Scan, config: BpSlamConfig) -> _Evaluation:
    """Likelihood ratios of one feature, from the ranges (S, N) of its pairs."""
    low, high = reach.min(), reach.max()
    near = np.flatnonzero((scan.length > low - GATE * scan.std) & (scan.length < high + GATE * scan.std))
    scaled = (reach - scan.length[near, None, None]) / scan.std[near, None, None]
    peak = config.detection_probability / (np.sqrt(2.0 * np.pi) * scan.std[near] * config.clutter_density)
    scaled *= scaled
    scaled *= -0.5
    return _Evaluation(near, np.exp(scaled, out=scaled) * peak[:, None, None])


def _associate(
    seen: list[_Evaluation], weight: Floats, existence: Floats, fresh: Floats, config: BpSlamConfig
) -> Association:
    """Loopy association of one anchor's features (K,) and measurements (M,)."""
    pair = np.zeros((len(seen), len(fresh)))
    for row, evaluation in enumerate(seen):
        pair[row, evaluation.measurement] = existence[row] * (evaluation.ratio.mean(axis=1) @ weight[row])
    missed = 1.0 - existence * config.detection_probability
    return associate(missed, pair, fresh, config.iterations, config.tolerance)


def _message(seen: _Evaluation, to_feature: Floats, config: BpSlamConfig) -> Floats:
    """(S, N) factor of every pair: missed, or made one of the measurements; never zero."""
    weight = to_feature[seen.measurement]
    return (1.0 - config.detection_probability) + np.einsum("g,gsn->sn", weight, seen.ratio)


def _to_agent(gain: Floats, weight: Floats, pairs: _Pairs) -> Floats:
    """Mean (N,) of a feature's factors over the particles that each agent particle meets."""
    met = weight[pairs.feature]
    rows = np.arange(len(gain))[:, None]
    total = met.sum(axis=0)
    mean = np.sum(met * gain[rows, pairs.feature], axis=0) / np.where(total > 0.0, total, 1.0)
    return np.where(total > 0.0, mean, gain[rows, pairs.feature].mean(axis=0))


def _resample_agent(state: Floats, log_weight: Floats, *, rng: np.random.Generator) -> tuple[Floats, float]:
    """Equally likely states (N, 2D), widened where many share an ancestor."""
    weight = normalised_rows(log_weight[None])
    effective = effective_fraction(weight)
    scale = np.maximum(state.std(axis=0), 1e-12)
    order = cell_order((state / scale)[None], cell_levels(len(state)))
    chosen = state[order[0, systematic_rows(weight[:, order[0]], rng=rng)[0]]]
    width = kernel_width(*state.shape, effective)
    return smooth(chosen[None], width, 0, rng=rng)[0], float(effective[0])


def _update_features(
    features: Features, candidates: Floats, gains: Floats, states: Floats, mean_after: Floats, config: BpSlamConfig, *,
    rng: np.random.Generator,
) -> Features:  # fmt: skip
    """Weights by the mean factor of every particle; line through the agent's states by one pair a particle."""
    kept = features.known | (features.existence >= config.pruning_threshold)
    features, candidates, gains = select(features, kept), candidates[kept], gains[kept]
    log_weight = features.log_weight + np.log(gains.mean(axis=1))
    log_weight -= log_weight.max(axis=1, keepdims=True)
    cloud, slope = features.cloud, features.slope
    if config.coupled:
        edges = np.cumsum(gains, axis=1)
        mark = edges[:, -1:] * rng.random((len(gains), 1, gains.shape[2]))
        pick = (mark > edges).sum(axis=1)
        met = np.take_along_axis(candidates, pick[:, None, :, None], axis=1)[:, 0]
        own = states[pick, np.arange(gains.shape[2])]
        cloud, slope = regress(own, met, normalised_rows(log_weight), mean_after)
    updated = features._replace(
        cloud=np.where(features.known[:, None, None], features.cloud, cloud),
        log_weight=np.where(features.known[:, None], features.log_weight, log_weight),
        slope=np.where(features.known[:, None, None], features.slope, slope),
    )
    return refresh(updated, rng=rng)
