"""Loopy probabilistic data association: which potential feature made which measurement, by the sum-product rule.

Source: Williams and Lau, "Approximate evaluation of marginal association probabilities with belief propagation",
IEEE TAES 2014, in the form with new features of Leitinger et al., arXiv 1801.04463, eqs. (19) to (26).
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats


class Association(NamedTuple):
    """Messages and marginals of K legacy features and M measurements."""

    to_feature: Floats
    """Message (K, M) of every measurement to every feature, relative to that of "missed"."""
    feature: Floats
    """Probability (K, M+1) that a feature made measurement m; last column: none."""
    unclaimed: Floats
    """Probability (M,) that no legacy feature made the measurement."""


def associate(missed: Floats, pair: Floats, fresh: Floats, iterations: int, tolerance: float) -> Association:
    """Approximate marginals of the one-to-one association of features with measurements, by loopy belief propagation.

    Parameters
    ----------
    missed
        (K,) positive weight of "the feature made no measurement".
    pair
        (K, M) weight of "feature k made measurement m", in units of the clutter density.
    fresh
        (M,) positive weight of "no legacy feature made measurement m": clutter (1) plus new feature.

    The rounds converge for any positive input (Williams and Lau, theorem 2); they end at `tolerance`, relative.
    """
    features, shown = pair.shape
    ratio = pair / np.maximum(missed, 1e-300)[:, None]
    others_m, others_k = 1.0 - np.eye(shown), 1.0 - np.eye(features)
    to_feature = np.broadcast_to(1.0 / fresh, pair.shape)
    to_measurement = ratio
    for _ in range(iterations):
        to_measurement = ratio / (1.0 + (ratio * to_feature) @ others_m)
        last, to_feature = to_feature, 1.0 / (fresh + others_k @ to_measurement)
        if np.abs(to_feature - last).max(initial=0.0) <= tolerance * np.abs(to_feature).max(initial=0.0):
            break
    joint = np.concatenate([ratio * to_feature, np.ones((features, 1))], axis=1)
    marginal = joint / joint.sum(axis=1, keepdims=True)
    return Association(to_feature, marginal, fresh / (fresh + to_measurement.sum(axis=0)))
