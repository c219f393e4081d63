"""Training of the component classifier: fits networks by L-BFGS from several starts, keeps the best and scores it."""

from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from rislam_rt.arrays import Booleans, Floats, take_rows
from rislam_rt.slam.classify import Network
from rislam_rt.studies.classifier.score import (
    ClassifierScore,
    f1,
    importance,
    mean_over_rooms,
    right_by_class,
    rules,
    score,
)
from rislam_rt.studies.classifier.sets import Sets
from rislam_rt.studies.classifier.spec import ClassifierSpec
from rislam_rt.studies.classifier.training_examples import Examples


def train_network(
    features: Floats, keep: Booleans, weight: Floats, hidden: int, penalty: float, iterations: int,
    *, rng: np.random.Generator
) -> Network:  # fmt: skip
    """Fit a network to examples by least weighted cross-entropy plus `penalty` times half the squared weights.

    Biases are not penalised.

    `features` (N, F), `keep` (N,), `weight` (N,) of the examples (scaled to mean 1). Starts from Glorot's uniform
    distribution; the result depends on `rng` through that alone.
    """
    mean, scale = features.mean(axis=0), np.maximum(features.std(axis=0), 1e-6)
    inputs = (features - mean) / scale
    sizes = [features.shape[1], hidden, hidden, 1]
    shapes: list[tuple[int, ...]] = [s for a, b in pairwise(sizes) for s in ((a, b), (b,))]
    start = []
    for shape in shapes:
        reach = np.sqrt(6.0 / sum(shape)) if len(shape) == 2 else 0.0
        start.append(rng.uniform(-reach, reach, shape).ravel())
    target, share = keep.astype(np.float64), weight / weight.sum()

    def cost(flat: Floats) -> tuple[float, Floats]:
        return loss_and_slope(flat, shapes, inputs, target, share, penalty)

    found = minimize(cost, np.concatenate(start), jac=True, method="L-BFGS-B",
                     options={"maxiter": iterations, "maxcor": 20, "maxfun": 10 * iterations})  # fmt: skip
    arrays = _unpack(found.x, shapes)
    return Network(mean, scale, tuple(arrays[0::2]), tuple(arrays[1::2]))


def loss_and_slope(
    flat: Floats, shapes: list[tuple[int, ...]], inputs: Floats, target: Floats, share: Floats, penalty: float
) -> tuple[float, Floats]:
    """Penalised cross-entropy of the classifier's network with weights `flat` (P,), and its gradient (P,)."""
    arrays = _unpack(flat, shapes)
    values = [inputs]
    for layer in range(0, len(arrays), 2):
        value = values[-1] @ arrays[layer] + arrays[layer + 1]
        values.append(np.tanh(value) if layer < len(arrays) - 2 else value)
    odds = values[-1][:, 0]
    loss = float(share @ (np.logaddexp(0.0, odds) - target * odds))
    back = (share * (0.5 * (1.0 + np.tanh(0.5 * odds)) - target))[:, None]
    slopes: list[Floats] = []
    for layer in range(len(arrays) - 2, -1, -2):
        slopes = [values[layer // 2].T @ back + penalty * arrays[layer], back.sum(axis=0), *slopes]
        back = (back @ arrays[layer].T) * (1.0 - values[layer // 2] ** 2)
    loss += 0.5 * penalty * float(sum(np.sum(matrix**2) for matrix in arrays[0::2]))
    return loss, np.concatenate([slope.ravel() for slope in slopes])


def _unpack(flat: Floats, shapes: list[tuple[int, ...]]) -> list[Floats]:
    """Weight matrices and biases of the network's layers from the one vector that training optimises."""
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])
    return [part.reshape(shape) for part, shape in zip(np.split(flat, ends[:-1]), shapes, strict=True)]


ALL, DRAWN, RANDOM = "all test rooms", "drawn rooms", "random rooms (validation)"
"""Names of the joint sets of examples that are scored beside the named rooms."""


class Training(NamedTuple):
    """Trained network of the component classifier, its training and test sets, and its scores."""

    network: Network
    sets: Sets
    scores: dict[str, dict[str, ClassifierScore]]
    """Scores by named room (and `ALL`, `DRAWN`, `RANDOM`), then by classification rule."""
    mean: dict[str, Floats]
    """Mean (3,) over the test rooms' F1 with its interval, by classification rule."""
    restarts: list[tuple[float, float]]
    """For each random start: mean share classified correctly over the path classes of the validation rooms, by which
    the network is chosen, and F1 on all test rooms."""
    importance: dict[str, Floats]
    """Loss of F1 on all test rooms when a feature is shuffled, by feature, several shuffles each."""


def train_and_score(sets: Sets, spec: ClassifierSpec) -> Training:
    """Train the classifier from several random starts, keep the best on the validation rooms, score it on all sets."""
    section, tested = spec.network, sets.tested
    known = take_rows(sets.train, sets.train.labelled & ~sets.train.near)
    fit = partial(
        train_network, known.features, known.keep, balance(known), section.hidden, section.penalty, section.iterations
    )
    networks = [fit(rng=child) for child in np.random.default_rng(spec.seed).spawn(section.restarts)]
    paths, keepers = take_rows(tested, tested.labelled), [rules(net)["network"] for net in networks]
    restarts = [(right_by_class(sets.validation, keeper), f1(paths.keep, keeper(paths))) for keeper in keepers]
    network = networks[int(np.argmax([chosen for chosen, _ in restarts]))]
    places = {**sets.test, ALL: tested, DRAWN: sets.all_drawn, RANDOM: sets.validation}
    judges = rules(network)
    scores = {
        name: {
            rule: score(examples, judge, spec.coverage, rng=np.random.default_rng(spec.seed))
            for rule, judge in judges.items()
        }
        for name, examples in places.items()
    }
    filled = [examples for examples in sets.test.values() if examples.keep.any()]
    mean = {
        rule: mean_over_rooms(filled, judge, spec.coverage, rng=np.random.default_rng(spec.seed))
        for rule, judge in judges.items()
    }
    lost = importance(tested, network, rng=np.random.default_rng(spec.seed))
    return Training(network, sets, scores, mean, restarts, lost)


def balance(examples: Examples) -> Floats:
    """Weights (N,) of the classifier's training examples: the two answers weigh the same, and so do their path classes.

    Within a class an example's weight is one over the root of the number of examples of its walk.
    """
    _, row, count = np.unique(examples.walk, return_inverse=True, return_counts=True)
    weight = 1.0 / np.sqrt(count[row])
    for side in (examples.keep, ~examples.keep):
        kinds = np.unique(examples.kind[side])
        for kind in kinds:
            own = examples.kind == kind
            weight[own] *= 0.5 / (len(kinds) * weight[own].sum())
    return np.asarray(weight)
