"""Which measurement a feature may have made, and how likely: likelihood ratios of ranges, loopy association."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.schemes.bp_slam_static.config import BpSlamStaticConfig
from rislam_rt.slam.schemes.shared.association import Association, associate
from rislam_rt.slam.schemes.shared.scan import Scan

GATE = 5.0
"""Standard deviations beyond which the likelihood of a range counts as zero (4e-6 of its peak)."""


class RangeEvaluation(NamedTuple):
    """Likelihood ratios p_d f(z|x,a) / clutter of one feature for the measurements within its gate."""

    measurement: Integers
    """(G,)."""
    ratio: Floats
    """(G, S, N) over pairings and feature particles."""


def evaluate_ranges(reach: Floats, scan: Scan, config: BpSlamStaticConfig) -> RangeEvaluation:
    """Likelihood ratios for associating ranges with one static feature, from the ranges (S, N) of its pairs."""
    low, high = reach.min(), reach.max()
    near = np.flatnonzero((scan.length > low - GATE * scan.std) & (scan.length < high + GATE * scan.std))
    scaled = (reach - scan.length[near, None, None]) / scan.std[near, None, None]
    peak = config.detection_probability / (np.sqrt(2.0 * np.pi) * scan.std[near] * config.clutter_density)
    scaled *= scaled
    scaled *= -0.5
    return RangeEvaluation(near, np.exp(scaled, out=scaled) * peak[:, None, None])


def associate_anchor(
    seen: list[RangeEvaluation], weight: Floats, existence: Floats, fresh: Floats, config: BpSlamStaticConfig
) -> Association:
    """Loopy association of one anchor's features (K,) and measurements (M,)."""
    pair = np.zeros((len(seen), len(fresh)))
    for row, evaluation in enumerate(seen):
        pair[row, evaluation.measurement] = existence[row] * (evaluation.ratio.mean(axis=1) @ weight[row])
    missed = 1.0 - existence * config.detection_probability
    return associate(missed, pair, fresh, config.iterations, config.tolerance)


def pair_message(seen: RangeEvaluation, to_feature: Floats, config: BpSlamStaticConfig) -> Floats:
    """(S, N) association's factor of every pair of particles: missed, or made one of the ranges; never zero."""
    weight = to_feature[seen.measurement]
    return (1.0 - config.detection_probability) + np.einsum("g,gsn->sn", weight, seen.ratio)
