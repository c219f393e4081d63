"""Gather examples in all rooms, train on some, score on the others."""

import zlib
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.measurement import with_reference_snr
from rislam_rt.model import RadioConfig, Scene
from rislam_rt.pipeline.run import Progress, build_channel
from rislam_rt.pipeline.spec import build_radio
from rislam_rt.pipeline.studies.classifier.gather import POLICIES, Examples, gather_walk, join, set_codes
from rislam_rt.pipeline.studies.classifier.score import Score, f1, importance, rules, score
from rislam_rt.pipeline.studies.classifier.spec import ClassifierSpec, LearnedRoom, build_receiver
from rislam_rt.pipeline.studies.classifier.train import train_network
from rislam_rt.pipeline.studies.classifier.walks import random_version, random_walk
from rislam_rt.slam.classify import Network


class RoomExamples(NamedTuple):
    """Examples of one room."""

    name: str
    use: str
    plain: Examples
    """From walks through the room as it is."""
    versions: Examples
    """From walks through random versions of it."""


class Training(NamedTuple):
    """The network and what it is worth."""

    network: Network
    rooms: list[RoomExamples]
    scores: dict[str, dict[str, dict[str, Score]]]
    """By set (`plain`, `versions`), by room (and `all test rooms`), by rule."""
    restarts: list[float]
    """F1 on all test rooms as they are, of each random start's network."""
    importance: dict[str, Floats]
    """Loss of F1 on all test rooms as they are, feature by feature, several shuffles each."""


ALL = "all test rooms"


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
    rooms: list[RoomExamples] = []
    tell("rooms", 0, len(scenes))
    for scene, room in zip(scenes, spec.rooms, strict=True):
        rooms.append(gather_room(scene, room, spec))
        tell("rooms", len(rooms), len(scenes))
    return train_and_score(rooms, spec)


def train_and_score(rooms: list[RoomExamples], spec: ClassifierSpec) -> Training:
    """Fit from several random starts on the training rooms; score the first fit on all rooms."""
    starts = np.random.default_rng(spec.seed).spawn(spec.network.restarts)
    networks = [_fit(rooms, spec, rng=child) for child in starts]
    test = {kind: _all_tests(rooms, kind) for kind in ("plain", "versions")}
    known = test["plain"].pick(test["plain"].labelled)
    restarts = [f1(known.keep, rules(network)["network"](known)) for network in networks]
    network = networks[0]
    scores = {
        kind: {
            name: {
                rule: score(examples, judge, spec.coverage, rng=np.random.default_rng(spec.seed))
                for rule, judge in rules(network).items()
            }
            for name, examples in ({room.name: getattr(room, kind) for room in rooms} | {ALL: test[kind]}).items()
        }
        for kind in ("plain", "versions")
    }
    lost = importance(test["plain"], network, rng=np.random.default_rng(spec.seed))
    return Training(network, rooms, scores, restarts, lost)


def gather_room(scene: Scene, room: LearnedRoom, spec: ClassifierSpec) -> RoomExamples:
    """Examples of one room; they depend on its name and the seed alone."""
    name = zlib.crc32(scene.name.encode())
    radio = build_radio(spec.radio)
    sets = []
    for kind, walks in enumerate((spec.walks, spec.versions)):
        parts = []
        for walk in range(walks):
            rng = np.random.default_rng([spec.seed, name, kind, walk])
            version = random_version(scene, rng=rng) if kind else scene
            noise = with_reference_snr(radio, float(rng.uniform(spec.snr_low_db, spec.snr_high_db))) if kind else radio
            parts.append(_walk(version, room.depth, noise, spec, 1000 * (name % 1_000_000) + walk, rng=rng))
        sets.append(join(parts))
    return RoomExamples(scene.name, room.use, sets[0], sets[1])


def _walk(
    scene: Scene, depth: int, radio: RadioConfig, spec: ClassifierSpec, walk: int, *, rng: np.random.Generator
) -> Examples:
    """Examples of one random walk through one version of a room."""
    motion = random_walk(scene, spec.cycles, rng=rng)
    paths = build_channel(spec.channel, replace(scene, agent=motion), radio, depth).paths(motion)
    policy = POLICIES[walk % len(POLICIES)]
    paths = set_codes(paths, scene.ris.spec if scene.ris is not None else None, policy, rng=rng)
    receiver = build_receiver(spec.receiver)
    return gather_walk(paths, motion, radio, receiver, walk, spec.stride, rng=rng)


def _fit(rooms: list[RoomExamples], spec: ClassifierSpec, *, rng: np.random.Generator) -> Network:
    """One network from one random start; keep and remove have the same weight."""
    parts = [part for room in rooms if room.use == "train" for part in (room.plain, room.versions)]
    together = join([part.pick(part.labelled) for part in parts])
    share = float(np.clip(together.keep.mean(), 1e-6, 1.0 - 1e-6))
    weight = np.where(together.keep, 1.0 / share, 1.0 / (1.0 - share))
    section = spec.network
    return train_network(
        together.features, together.keep, weight, section.hidden, section.penalty, section.iterations, rng=rng
    )


def _all_tests(rooms: list[RoomExamples], kind: str) -> Examples:
    return join([getattr(room, kind) for room in rooms if room.use == "test"])
