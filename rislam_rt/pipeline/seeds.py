"""Seeds of a run's random numbers: a child for each purpose, and for each cycle."""

from typing import NamedTuple

import numpy as np


class Seeds(NamedTuple):
    """Every scheme draws the same motion, start, noise, losses and filter numbers: only its codes differ."""

    start: np.random.SeedSequence
    noise: np.random.SeedSequence
    control: np.random.SeedSequence
    filter: np.random.SeedSequence
    design: np.random.SeedSequence
    motion: np.random.SeedSequence
    panel: np.random.SeedSequence
    room: np.random.SeedSequence
    told: np.random.SeedSequence
    """Of the compass, and of how the body sways."""
    hardware: np.random.SeedSequence
    """Of the front end, and of the noise in its calibration."""


def spawn_seeds(*, rng: np.random.Generator) -> Seeds:
    """Seeds of a run: the children of its generator."""
    return Seeds(*rng.bit_generator.seed_seq.spawn(len(Seeds._fields)))  # type: ignore[attr-defined]


def child(seed: np.random.SeedSequence, number: int) -> np.random.Generator:
    """Child seed by number, as of a cycle: the same generator every time, however many numbers others draw."""
    return np.random.default_rng(np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, number)))
