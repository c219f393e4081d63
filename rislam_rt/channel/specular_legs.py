"""Specular legs: the connections between a moving device and a landmark (or between Tx and Rx) over walls."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers, freeze

NO_WALL = -1
"""Padding of wall sequences."""


def turned_round(sequences: Integers) -> Integers:
    """Wall sequences (S, D) of specular legs in reverse, the padding kept at the end."""
    index = (sequences != NO_WALL).sum(axis=1)[:, None] - 1 - np.arange(sequences.shape[1])
    return np.where(index >= 0, np.take_along_axis(sequences, np.maximum(index, 0), axis=1), NO_WALL)


@dataclass(frozen=True, slots=True, eq=False)
class SpecularLegs:
    """Specular legs from a device to a landmark, or from Tx to Rx, for K cycles by S wall sequences.

    Where `valid` is False the rest means nothing. The gain of a leg is
    `coefficient * lambda / (4 pi length) * exp(-j 2 pi length / lambda)`.
    """

    walls: Integers
    """(S, D) wall sequences in the order from device to far end, padded with -1."""
    valid: Booleans
    """(K, S) whether the leg exists."""
    length: Floats
    """(K, S) unfolded length [m]."""
    at_device: Floats
    """(K, S, 3) unit vector from the device along the ray."""
    at_far_end: Floats
    """(K, S, 3) unit vector from the far end along the ray, back towards the device."""
    coefficient: Complexes
    """(K, S) product of the reflection coefficients and of antenna patterns that are not isotropic; the radio's antenna
    gains are not in it."""
    vertices: Floats
    """(K, S, D, 3) [m] bounce points in the order from device to far end; the first `num_bounces` count."""

    def __post_init__(self) -> None:
        cycles, sequences = np.shape(self.valid)
        depth = np.shape(self.walls)[1]
        freeze(self, np.int64, walls=(sequences, depth))
        freeze(self, np.bool_, valid=(cycles, sequences))
        freeze(self, np.float64, length=(cycles, sequences))
        freeze(self, np.float64, at_device=(cycles, sequences, 3), at_far_end=(cycles, sequences, 3))
        freeze(self, np.complex128, coefficient=(cycles, sequences))
        freeze(self, np.float64, vertices=(cycles, sequences, depth, 3))

    @property
    def num_bounces(self) -> Integers:
        """Number (S,) of bounces on a specular leg, by wall sequence."""
        return (self.walls >= 0).sum(axis=1)

    def gain(self, wavelength: float) -> Complexes:
        """Complex gain (K, S) of specular legs, carrier phase included, 0 where not valid."""
        length = np.where(self.valid, self.length, 1.0)
        gain = self.coefficient * wavelength / (4.0 * np.pi * length) * np.exp(-2j * np.pi / wavelength * length)
        return np.where(self.valid, gain, 0.0)
