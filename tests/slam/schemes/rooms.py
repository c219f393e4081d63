"""Points in a room, an agent that walks past them, and what its receiver would say of their delays."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Body, Measurement, RadioConfig
from rislam_rt.slam import StartPrior

BODY = Body()
RADIO = RadioConfig()
HEADING = 0.3
CYCLE = 0.1
STD = 0.005
VELOCITY = np.array([0.0707, 0.0707, 0.0])


class Room(NamedTuple):
    """Truth and data of K cycles."""

    position: Floats
    """(K, 3) [m]."""
    start: StartPrior
    measurements: list[Measurement]


def measurement_of(length: Floats, ratio: float = 0.05) -> Measurement:
    """Components of lengths (M,) [m], as strong as `ratio` of free space."""
    count = len(length)
    amplitude = ratio * RADIO.wavelength / (4.0 * np.pi * length)
    return Measurement(
        length / SPEED_OF_LIGHT,
        np.zeros((count, 2)),
        amplitude,
        np.full(count, STD / SPEED_OF_LIGHT),
        np.full((count, 2), 0.01),
        0.1 * amplitude,
    )


def build_room(cycles: int, seed: int) -> Room:
    """Six points above the agent, seen in every cycle, and one false delay every other cycle."""
    rng = np.random.default_rng([seed, 9])
    points = rng.uniform([0.0, 0.0, 1.2], [6.0, 6.0, 3.0], (6, 3))
    position = np.array([0.5, 0.7, 0.5]) + CYCLE * np.arange(cycles)[:, None] * VELOCITY
    horizontal = np.array([1.0, 1.0, 0.0])
    start = StartPrior(
        position[0] + 0.01 * rng.standard_normal(3) * horizontal,
        VELOCITY + 0.01 * rng.standard_normal(3) * horizontal,
        HEADING,
    )
    measurements = []
    for tx, rx in zip(*BODY.ends(position, np.full(cycles, HEADING)), strict=True):
        length = np.linalg.norm(points - tx, axis=1) + np.linalg.norm(points - rx, axis=1)
        length = length + STD * rng.standard_normal(len(points))
        false = rng.uniform(1.0, 15.0, rng.integers(0, 2))
        measurements.append(measurement_of(rng.permutation(np.concatenate([length, false]))))
    return Room(position, start, measurements)
