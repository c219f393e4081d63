"""One step of BP-SLAM on a factor graph: predict, evaluate ranges, associate, update agent and features, give birth.

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
from rislam_rt.slam.schemes.bp_slam.features import (
    Features,
    Scan,
    birth_ratio,
    born,
    join,
    predict_features,
    prune,
    select,
)
from rislam_rt.slam.schemes.bp_slam.ranges import RangeModel
from rislam_rt.slam.schemes.resampling import (
    cell_levels,
    effective_fraction,
    kernel_width,
    normalised_rows,
    smooth,
    systematic_rows,
)

GATE = 5.0
"""Standard deviations beyond which the likelihood of a range counts as zero (3e-6 of its peak)."""


class Belief(NamedTuple):
    """Agent of N equally likely particles, and potential features."""

    position: Floats
    """(N, D) [m]."""
    velocity: Floats
    """(N, D) [m/s]."""
    features: Features
    undetected: Floats
    """(A,) features per anchor that exist and were never seen, expected."""
    next_ident: int


class UpdateInfo(NamedTuple):
    """How a step went."""

    effective: float
    """Effective sample size of the agent over N."""
    rounds: int
    """Of data association, the most of all anchors."""
    claimed: tuple[Floats, ...]
    """Per anchor (K_a, M+1): marginals of the association, rows in the order of `claimants`."""
    claimants: tuple[Integers, ...]
    """Per anchor (K_a,): numbers of the features before the update."""


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
    push = accelerate * rng.standard_normal(belief.position.shape)
    survivors = config.survival_probability * (1.0 - config.detection_probability) * belief.undetected
    return belief._replace(
        position=belief.position + dt * belief.velocity + 0.5 * dt**2 * push,
        velocity=belief.velocity + dt * push,
        features=predict_features(belief.features, config, rng=rng),
        undetected=survivors + config.birth_mean,
    )


def update_belief(
    belief: Belief, scans: tuple[Scan, ...], model: RangeModel, upper_half: bool, config: BpSlamConfig,
    max_range: float, *, rng: np.random.Generator,
) -> tuple[Belief, UpdateInfo]:  # fmt: skip
    """One scan of every anchor into the belief. The agent's message to every feature is its prediction, as published."""
    count, dims = belief.position.shape
    shuffled = rng.permutation(count)
    position, velocity = belief.position[shuffled], belief.velocity[shuffled]
    features = belief.features
    shifts = (np.arange(config.num_pairings) * count) // config.num_pairings
    partner = (np.arange(count) + shifts[:, None]) % count
    reach = model.ranges(position[partner], features.cloud[:, None])
    log_agent, log_feature = np.zeros(count), np.zeros((len(features.ident), count))
    existence = features.existence.copy()
    newborn, associations, claimants = [], [], []
    next_ident = belief.next_ident
    for anchor, scan in enumerate(scans):
        rows = np.flatnonzero(features.anchor == anchor)
        seen = [_evaluate(reach[row], scan, config) for row in rows]
        fresh = 1.0 + birth_ratio(scan, float(belief.undetected[anchor]), model, dims, config, max_range)
        result = _associate(seen, features.existence[rows], fresh, config)
        for number, row in enumerate(rows):
            gain = _message(seen[number], result.to_feature[number], config)
            agent_gain = gain[np.arange(len(shifts))[:, None], (np.arange(count) - shifts[:, None]) % count]
            prior = features.existence[row]
            log_agent += np.log(prior * agent_gain.mean(axis=0) + 1.0 - prior)
            over = gain.mean(axis=0)
            log_feature[row] = np.log(over)
            existence[row] = prior * over.mean() / (prior * over.mean() + 1.0 - prior)
        alive = result.unclaimed * (fresh - 1.0) / fresh
        newborn.append(born(scan, anchor, position, alive, model, next_ident, upper_half, rng=rng))
        next_ident += len(scan.length)
        associations.append(result)
        claimants.append(features.ident[rows])
    position, velocity, effective = _resample_agent(position, velocity, log_agent, rng=rng)
    old = _resample_features(features._replace(existence=existence), log_feature, config, rng=rng)
    info = UpdateInfo(
        effective,
        max((result.rounds for result in associations), default=0),
        tuple(result.feature for result in associations),
        tuple(claimants),
    )
    kept = prune(join([old, *newborn]), config)
    return Belief(position, velocity, kept, belief.undetected, next_ident), info


def _evaluate(reach: Floats, scan: Scan, config: BpSlamConfig) -> _Evaluation:
    """Likelihood ratios of one feature, from the ranges (S, N) of its pairs."""
    low, high = reach.min(), reach.max()
    near = np.flatnonzero((scan.length > low - GATE * scan.std) & (scan.length < high + GATE * scan.std))
    scaled = (reach - scan.length[near, None, None]) / scan.std[near, None, None]
    peak = config.detection_probability / (np.sqrt(2.0 * np.pi) * scan.std[near] * config.clutter_density)
    scaled *= scaled
    scaled *= -0.5
    return _Evaluation(near, np.exp(scaled, out=scaled) * peak[:, None, None])


def _associate(seen: list[_Evaluation], existence: Floats, fresh: Floats, config: BpSlamConfig) -> Association:
    """Loopy association of one anchor's features (K,) and measurements (M,)."""
    pair = np.zeros((len(seen), len(fresh)))
    for row, evaluation in enumerate(seen):
        pair[row, evaluation.measurement] = evaluation.ratio.mean(axis=(1, 2)) * existence[row]
    missed = 1.0 - existence * config.detection_probability
    return associate(missed, pair, fresh, config.iterations, config.tolerance)


def _message(seen: _Evaluation, to_feature: Floats, config: BpSlamConfig) -> Floats:
    """(S, N) factor of every pair: missed, or made one of the measurements; never zero."""
    weight = to_feature[seen.measurement]
    return (1.0 - config.detection_probability) + np.einsum("g,gsn->sn", weight, seen.ratio)


def _resample_agent(
    position: Floats, velocity: Floats, log_weight: Floats, *, rng: np.random.Generator
) -> tuple[Floats, Floats, float]:
    """Equally likely particles of position and velocity together, widened where many share an ancestor."""
    joint = np.concatenate([position, velocity], axis=1)[None]
    weight = normalised_rows(log_weight[None])
    effective = effective_fraction(weight)
    ancestors = systematic_rows(weight, rng=rng)
    chosen = np.take_along_axis(joint, ancestors[..., None], axis=1)
    width = kernel_width(joint.shape[1], joint.shape[2], effective)
    moved = smooth(chosen, width, 0, rng=rng)[0]
    dims = position.shape[1]
    return moved[:, :dims], moved[:, dims:], float(effective[0])


def _resample_features(
    features: Features, log_weight: Floats, config: BpSlamConfig, *, rng: np.random.Generator
) -> Features:
    """Equally likely particles of every feature; known anchors stay as they are."""
    free = np.flatnonzero(~features.known & (features.existence >= config.pruning_threshold))
    rest = select(features, features.known)
    if not len(free):
        return rest
    moving = select(features, free)
    weight = normalised_rows(log_weight[free])
    effective = effective_fraction(weight)
    ancestors = systematic_rows(weight, rng=rng)
    chosen = np.take_along_axis(moving.cloud, ancestors[..., None], axis=1)
    levels = cell_levels(chosen.shape[1])
    width = kernel_width(chosen.shape[1] >> levels, chosen.shape[2], effective)
    return join([rest, moving._replace(cloud=smooth(chosen, width, levels, rng=rng))])
