"""Gather examples in random rooms, train and choose on them, and score once on the named rooms."""

import zlib
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import SceneError
from rislam_rt.measurement import with_reference_snr
from rislam_rt.model import RadioConfig, Scene
from rislam_rt.pipeline.run import Progress, build_channel
from rislam_rt.pipeline.spec import build_radio
from rislam_rt.pipeline.studies.classifier.gather import POLICIES, Examples, gather_walk, join, set_codes
from rislam_rt.pipeline.studies.classifier.random_rooms import random_room
from rislam_rt.pipeline.studies.classifier.score import (
    Score,
    f1,
    importance,
    mean_over_rooms,
    odds_over_life,
    rules,
    score,
)
from rislam_rt.pipeline.studies.classifier.spec import ClassifierSpec, build_receiver
from rislam_rt.pipeline.studies.classifier.train import train_network
from rislam_rt.pipeline.studies.classifier.walks import random_walk
from rislam_rt.slam.classify import Network

ALL, RANDOM = "all test rooms", "random rooms (validation)"
RANDOM_DEPTH = 2
"""Wall bounces, both legs together, in random rooms."""
_TRIES = 20


class Sets(NamedTuple):
    """Examples to learn from, to choose by, and to test on."""

    train: Examples
    validation: Examples
    test: dict[str, Examples]
    """By room."""

    @property
    def tested(self) -> Examples:
        """All test rooms together."""
        return join(list(self.test.values()))


class Training(NamedTuple):
    """The network and what it is worth."""

    network: Network
    sets: Sets
    scores: dict[str, dict[str, Score]]
    """By room (and `ALL`, `RANDOM`), by rule."""
    mean: dict[str, Floats]
    """Mean (3,) over the test rooms' F1 with its interval, by rule."""
    restarts: list[tuple[float, float]]
    """F1 of each random start's network on the random rooms for validation, and on all test rooms."""
    importance: dict[str, Floats]
    """Loss of F1 on all test rooms, feature by feature, several shuffles each."""


def run_training(scenes: Sequence[Scene], spec: ClassifierSpec, *, progress: Progress | None = None) -> Training:
    """Everything that a specification asks for; its seed decides all draws.

    Raises
    ------
    SceneError
        A room is too full for random walks.
    TraceError, SetupError
        The traced channel failed, or the machine lacks what it needs.
    """
    tell = progress or (lambda stage, at, total: None)
    total, rooms = spec.train + spec.validation, list[Examples]()
    tell("random rooms", 0, total)
    for number in range(total):
        rooms.append(gather_random(number, spec))
        tell("random rooms", number + 1, total)
    test: dict[str, Examples] = {}
    tell("rooms", 0, len(scenes))
    for scene, room in zip(scenes, spec.rooms, strict=True):
        test[scene.name] = gather_room(scene, room.depth, spec)
        tell("rooms", len(test), len(scenes))
    return train_and_score(Sets(join(rooms[: spec.train]), join(rooms[spec.train :]), test), spec)


def train_and_score(sets: Sets, spec: ClassifierSpec) -> Training:
    """Fit from several random starts, keep the best on the validation rooms, score it on all."""
    starts = np.random.default_rng(spec.seed).spawn(spec.network.restarts)
    networks = [_fit(sets.train, spec, rng=child) for child in starts]
    restarts = [(_f1_of(sets.validation, network), _f1_of(sets.tested, network)) for network in networks]
    network = networks[int(np.argmax([chosen for chosen, _ in restarts]))]
    places = {**sets.test, ALL: sets.tested, RANDOM: sets.validation}
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
    lost = importance(sets.tested, network, rng=np.random.default_rng(spec.seed))
    return Training(network, sets, scores, mean, restarts, lost)


def gather_random(number: int, spec: ClassifierSpec) -> Examples:
    """Examples of one walk through the random room of a number."""
    rng = np.random.default_rng([spec.seed, number])
    for _ in range(_TRIES):
        scene = random_room(f"random_{number}", rng=rng)
        radio = with_reference_snr(build_radio(spec.radio), float(rng.uniform(spec.snr_low_db, spec.snr_high_db)))
        try:
            return _walk(scene, RANDOM_DEPTH, radio, spec, number, rng=rng)
        except SceneError:  # too full for a walk: another room
            continue
    raise SceneError(f"random room {number}: no walk of {spec.cycles} cycles in {_TRIES} rooms; give fewer cycles")


def gather_room(scene: Scene, depth: int, spec: ClassifierSpec) -> Examples:
    """Examples of a named room; they depend on its name and the seed alone."""
    name, radio = zlib.crc32(scene.name.encode()), build_radio(spec.radio)
    parts = []
    for walk in range(spec.walks):
        rng = np.random.default_rng([spec.seed, name, 0, walk])
        parts.append(_walk(scene, depth, radio, spec, 1000 * (name % 1_000_000) + walk, rng=rng))
    return join(parts)


def _walk(
    scene: Scene, depth: int, radio: RadioConfig, spec: ClassifierSpec, walk: int, *, rng: np.random.Generator
) -> Examples:
    """Examples of one random walk through a room."""
    motion = random_walk(scene, spec.cycles, rng=rng)
    paths = build_channel(spec.channel, replace(scene, agent=motion), radio, depth).paths(motion)
    policy = POLICIES[walk % len(POLICIES)]
    paths = set_codes(paths, scene.ris.spec if scene.ris is not None else None, policy, rng=rng)
    receiver = build_receiver(spec.receiver)
    return gather_walk(paths, motion, radio, receiver, walk, spec.stride, rng=rng)


def _fit(examples: Examples, spec: ClassifierSpec, *, rng: np.random.Generator) -> Network:
    """One network from one random start; a walk counts by the square root of its examples, both classes alike."""
    known = examples.pick(examples.labelled)
    _, row, count = np.unique(known.walk, return_inverse=True, return_counts=True)
    share = float(np.clip(known.keep.mean(), 1e-6, 1.0 - 1e-6))
    weight = np.where(known.keep, 1.0 / share, 1.0 / (1.0 - share)) / np.sqrt(count[row])
    section = spec.network
    return train_network(
        known.features, known.keep, weight, section.hidden, section.penalty, section.iterations, rng=rng
    )


def _f1_of(examples: Examples, network: Network) -> float:
    known = examples.pick(examples.labelled)
    return f1(known.keep, odds_over_life(known, network) > 0.0)
