"""Random seeds of a run: one for each purpose, and a child of it for each cycle."""

from typing import NamedTuple

import numpy as np


class Seeds(NamedTuple):
    """Random seeds of a run by purpose; all schemes draw the same motion, start, noise, losses and filter numbers."""

    start: np.random.SeedSequence
    """Of the errors of the start prior."""
    noise: np.random.SeedSequence
    """Of the receiver, a child for each cycle."""
    control: np.random.SeedSequence
    """Of lost control messages and flipped bits, a child for each cycle."""
    filter: np.random.SeedSequence
    """Of the estimator."""
    design: np.random.SeedSequence
    """Of the code designer."""
    motion: np.random.SeedSequence
    """Of the true motion's accelerations."""
    panel: np.random.SeedSequence
    """Of the panel's hardware errors."""
    room: np.random.SeedSequence
    """Of added scatterers."""
    told: np.random.SeedSequence
    """Of the compass errors and of the body's sway."""
    hardware: np.random.SeedSequence
    """Of the front end's impairments, and of the noise in its calibration."""


def spawn_seeds(*, rng: np.random.Generator) -> Seeds:
    """Spawn the random seeds of a run, one for each purpose, from its generator."""
    return Seeds(*rng.bit_generator.seed_seq.spawn(len(Seeds._fields)))  # type: ignore[attr-defined]


def child(seed: np.random.SeedSequence, number: int) -> np.random.Generator:
    """Random generator of a numbered child of a seed, as of one cycle: always the same, whatever others draw."""
    return np.random.default_rng(np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, number)))
