"""Training, validation and test sets of the component classifier, from walks through random and named rooms."""

import zlib
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import join_rows
from rislam_rt.errors import SceneError
from rislam_rt.measurement import with_reference_snr
from rislam_rt.model import RadioConfig, Scene, Trajectory
from rislam_rt.pipeline.channels import build_channel
from rislam_rt.pipeline.specification.pipeline_spec import build_receiver
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.progress import Tell, tell_nobody
from rislam_rt.scene.random_rooms import draw_room
from rislam_rt.scene.random_rooms.box_rooms import random_room
from rislam_rt.studies.classifier.spec import LEARNT_FIRST, ClassifierSpec
from rislam_rt.studies.classifier.training_examples import Examples, gather_walk
from rislam_rt.studies.classifier.walks import AIMED, POLICIES, random_walk, set_codes

DEPTH = 2
"""Largest number of wall bounces on a path in random rooms, both legs together."""
BLIND = tuple(number for number in range(len(POLICIES)) if number not in AIMED)
"""Indices of the code policies that do not know where the agent is."""
_TRIES = 20


class Sets(NamedTuple):
    """Training, validation and test sets of the component classifier."""

    train: Examples
    validation: Examples
    test: dict[str, Examples]
    """Test examples by named room."""
    drawn: dict[str, Examples]
    """Test examples by room of `scene.random_rooms`; none of these rooms is in the training set."""

    @property
    def tested(self) -> Examples:
        """Test examples of all named rooms together."""
        return join_rows(self.test.values())

    @property
    def all_drawn(self) -> Examples:
        """Test examples of all drawn rooms together."""
        return join_rows(self.drawn.values())


def gather_sets(scenes: Sequence[Scene], spec: ClassifierSpec, *, progress: Tell = tell_nobody) -> Sets:
    """Gather the training, validation and test sets of the classifier; the specification's seed decides all draws.
    Drawn rooms are tested on their own motion, under every code policy.

    Raises
    ------
    SceneError
        A room is too full for random walks.
    TraceError, SetupError
        The traced channel failed, or the machine lacks what it needs.
    """
    total, rooms = spec.train + spec.validation, list[Examples]()
    progress("rooms to learn from", 0, total)
    for number in range(total):
        rooms.append(gather_random(number, spec))
        progress("rooms to learn from", number + 1, total)
    test, drawn, radio = dict[str, Examples](), dict[str, Examples](), build_radio(spec.radio)
    progress("rooms to test on", 0, len(scenes) + spec.drawn)
    for scene, named in zip(scenes, spec.rooms, strict=True):
        test[scene.name] = gather_room(scene, named.depth, spec)
        progress("rooms to test on", len(test), len(scenes) + spec.drawn)
    for seed in range(spec.drawn_first, spec.drawn_first + spec.drawn):
        room, rng = draw_room(seed).scene, np.random.default_rng([spec.seed, seed, 1])
        drawn[f"random_{seed}"] = gather_motion(
            room, room.agent[: spec.cycles], DEPTH, radio, spec, seed, range(len(POLICIES)), rng=rng
        )
        progress("rooms to test on", len(test) + len(drawn), len(scenes) + spec.drawn)
    return Sets(join_rows(rooms[: spec.train]), join_rows(rooms[spec.train :]), test, drawn)


def gather_random(number: int, spec: ClassifierSpec) -> Examples:
    """Training examples of one walk through the random room of that number, under one aimed and one blind code policy.

    Rooms of odd number are those of `scene.random_rooms` with the motion that is drawn there, the others boxes with a
    random walk.
    """
    rng = np.random.default_rng([spec.seed, number])
    snr = float(rng.uniform(spec.snr_low_db, spec.snr_high_db))
    radio, policies = with_reference_snr(build_radio(spec.radio), snr), (rng.choice(BLIND), rng.choice(AIMED))
    if number % 2:
        scene = draw_room(LEARNT_FIRST + LEARNT_FIRST * (spec.seed % LEARNT_FIRST) + number).scene
        return gather_motion(scene, scene.agent[: spec.cycles], DEPTH, radio, spec, number, policies, rng=rng)
    for _ in range(_TRIES):
        scene = random_room(f"random_{number}", rng=rng)
        try:
            motion = random_walk(scene, spec.cycles, rng=rng)
        except SceneError:  # too full for a walk: another room
            continue
        return gather_motion(scene, motion, DEPTH, radio, spec, number, policies, rng=rng)
    raise SceneError(f"random room {number}: no walk of {spec.cycles} cycles in {_TRIES} rooms; give fewer cycles")


def gather_room(scene: Scene, depth: int, spec: ClassifierSpec) -> Examples:
    """Test examples of random walks through a named room under every code policy.

    The walks depend on the room's name and the seed alone.
    """
    name, radio = zlib.crc32(scene.name.encode()), build_radio(spec.radio)
    parts = []
    for walk in range(spec.walks):
        rng = np.random.default_rng([spec.seed, name, 0, walk])
        motion, number = random_walk(scene, spec.cycles, rng=rng), 1000 * (name % 1_000_000) + walk
        parts.append(gather_motion(scene, motion, depth, radio, spec, number, range(len(POLICIES)), rng=rng))
    return join_rows(parts)


def gather_motion(
    scene: Scene, motion: Trajectory, depth: int, radio: RadioConfig, spec: ClassifierSpec, walk: int,
    policies: Sequence[int], *, rng: np.random.Generator,
) -> Examples:  # fmt: skip
    """Examples of the classifier along a motion, once for each code policy; once in a room without a RIS panel."""
    paths = build_channel(spec.channel, replace(scene, agent=motion), radio, depth).paths(motion)
    receiver = build_receiver(spec.receiver, len(scene.panels))
    panel = None if scene.ris is None else scene.ris.spec
    parts = []
    for policy in policies if panel is not None else [-1]:
        lit = set_codes(paths, panel, POLICIES[policy], rng=rng)
        parts.append(gather_walk(lit, motion, radio, receiver, (walk, policy), spec.stride, rng=rng))
    return join_rows(parts)
