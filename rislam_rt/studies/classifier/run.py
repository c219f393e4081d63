"""A run of the classifier's training: gather examples in random rooms, train, choose, score once on the named rooms."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
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
from rislam_rt.studies.classifier.train import train_network
from rislam_rt.studies.classifier.training_examples import Examples

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
    starts = np.random.default_rng(spec.seed).spawn(spec.network.restarts)
    networks = [_fit(sets.train, spec, rng=child) for child in starts]
    tested = sets.tested
    restarts = [(right_by_class(sets.validation, rules(net)["network"]), _f1_of(tested, net)) for net in networks]
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


def _fit(examples: Examples, spec: ClassifierSpec, *, rng: np.random.Generator) -> Network:
    """Train one network of the classifier from one random start."""
    known, section = examples.pick(examples.labelled & ~examples.near), spec.network
    return train_network(
        known.features, known.keep, balance(known), section.hidden, section.penalty, section.iterations, rng=rng
    )


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


def _f1_of(examples: Examples, network: Network) -> float:
    """F1 of a network on the examples that are paths."""
    known = examples.pick(examples.labelled)
    return f1(known.keep, rules(network)["network"](known))
