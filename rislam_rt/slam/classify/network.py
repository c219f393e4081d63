"""The network that tells landmark paths from the direct path and wall returns: three fully connected layers, numpy."""

from functools import cache
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.errors import ConfigError
from rislam_rt.slam.classify.sighting_features import FEATURES

NUM_LAYERS = 3
"""Number of the network's layers."""
WEIGHTS = "weights.npz"
"""The trained network's file, beside this module."""
LEAST_SHARE, SURE = 0.3, 8.0
"""Least weight of the latest classification in a track's log odds, and the largest log odds of one classification."""


class Network(NamedTuple):
    """Weights of F features, two hidden layers of H and one output: F x H, H x H, H x 1, each with its bias."""

    mean: Floats
    """Means (F,) that are taken off the features."""
    scale: Floats
    """Scales (F,) by which the features are then divided."""
    weight: tuple[Floats, ...]
    """Three matrices (inputs, outputs)."""
    bias: tuple[Floats, ...]
    """Three vectors (outputs,)."""


def classify(features: Floats, network: Network) -> Floats:
    """Probability (M,) by the network that rows of features (M, F) are of landmark paths (PS, VS, RIS, VRIS: keep)."""
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * log_odds(features, network))))


def log_odds(features: Floats, network: Network) -> Floats:
    """Network's log odds (M,) that a track is a landmark path (keep), not a wall return, from features (M, F)."""
    value = (features - network.mean) / network.scale
    for layer, (weight, bias) in enumerate(zip(network.weight, network.bias, strict=True)):
        value = value @ weight + bias
        if layer < NUM_LAYERS - 1:
            value = np.tanh(value)
    return value[:, 0]


def blend(odds: Floats, looks: Integers, fresh: Floats) -> Floats:
    """Network's log odds (M,) of tracks over their lives: `odds` after `looks` (M,) earlier ones, and `fresh` ones now.

    A mean of the first looks, then one that forgets; clipped, so that no single look decides for good.
    """
    share = np.maximum(1.0 / (looks + 1.0), LEAST_SHARE)
    return np.asarray(odds + share * (np.clip(fresh, -SURE, SURE) - odds))


@cache
def load_classifier() -> Network:
    """The network that comes with the package, trained by `pipelines/train_classifier.toml`.

    Raises
    ------
    ConfigError
        Its file is missing or of another shape.
    """
    source = files("rislam_rt.slam.classify").joinpath(WEIGHTS)
    try:
        with source.open("rb") as file:
            return read_network(file)
    except FileNotFoundError:
        raise ConfigError(
            f"{WEIGHTS}: not in the package; run pipelines/train_classifier.toml and install it"
        ) from None


def read_network(file: IO[bytes] | Path) -> Network:
    """A network from an `.npz` file without pickle.

    Raises
    ------
    ConfigError
        The file does not hold a network for these features.
    """
    with np.load(file, allow_pickle=False) as content:
        names = ["features", "mean", "scale", *(f"{n}{k}" for k in range(NUM_LAYERS) for n in ("weight", "bias"))]
        missing = [name for name in names if name not in content]
        if missing:
            raise ConfigError(f"{WEIGHTS}: '{missing[0]}' missing; train it anew with pipelines/train_classifier.toml")
        held = {name: np.array(content[name]) for name in names}
    if tuple(held["features"].tolist()) != FEATURES:
        raise ConfigError(f"{WEIGHTS}: made for other features; train it anew with pipelines/train_classifier.toml")
    weight, bias = ([held[f"{name}{k}"] for k in range(NUM_LAYERS)] for name in ("weight", "bias"))
    sizes = [len(FEATURES), *(len(vector) for vector in bias)]
    shapes = [matrix.shape for matrix in weight]
    fits = shapes == list(pairwise(sizes)) and sizes[-1] == 1
    if not fits or not all(np.isfinite(array).all() for array in (held["mean"], held["scale"], *weight, *bias)):
        raise ConfigError(f"{WEIGHTS}: layers of shapes {shapes} received; train it anew")
    return Network(held["mean"], held["scale"], tuple(weight), tuple(bias))


def network_arrays(network: Network) -> dict[str, Any]:
    """Arrays of a network by name, for `np.savez`, as `read_network` reads them."""
    arrays: dict[str, Any] = {"features": np.array(FEATURES), "mean": network.mean, "scale": network.scale}
    for layer in range(NUM_LAYERS):
        arrays |= {f"weight{layer}": network.weight[layer], f"bias{layer}": network.bias[layer]}
    return arrays
