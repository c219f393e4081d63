"""Two range models behind one interface: the agent ranges to a static feature from one point, or over two ends."""

from typing import NamedTuple, Protocol

import numpy as np

from rislam_rt.arrays import Floats


class RangeModel(Protocol):
    """How far a feature appears, and where features of a given range may be."""

    @property
    def upper_half(self) -> bool:
        """Whether features lie above the agent only."""
        ...

    def ranges(self, agent: Floats, feature: Floats) -> Floats:
        """Ranges (...,) [m] of features (..., D) from agents (..., D); both broadcast."""
        ...

    def invert(self, agent: Floats, direction: Floats, length: Floats) -> Floats:
        """Features (..., D) that lie along unit vectors (..., D) from the agents (..., D) at ranges (...,) [m]."""
        ...

    def shell(self, length: Floats, dims: int) -> Floats:
        """Measure (...,) [m^(D-1)] of the features per metre of range at ranges (...,) [m]."""
        ...


class Direct(NamedTuple):
    """The published form: `|x - a|`, the feature being an anchor or an anchor's mirror image."""

    upper_half: bool = False
    """Whether features lie above the agent only."""

    def ranges(self, agent: Floats, feature: Floats) -> Floats:
        """Range from agent to feature, |x - a|."""
        return length_of(agent - feature)

    def invert(self, agent: Floats, direction: Floats, length: Floats) -> Floats:
        """Feature at a range, x + r u."""
        return agent + length[..., None] * direction

    def shell(self, length: Floats, dims: int) -> Floats:
        """Circle or sphere of features of one range, or the half of it."""
        full = 2.0 * np.pi * length if dims == 2 else 4.0 * np.pi * length**2
        return full * (0.5 if self.upper_half else 1.0)


class Bistatic(NamedTuple):
    """The moving form: `|p_T - a| + |a - p_R|`, both ends carried by the agent."""

    tx: Floats
    """(D,) [m] Tx from the agent's position, turned by the heading."""
    rx: Floats
    """(D,) [m]."""
    upper_half: bool = False

    def ranges(self, agent: Floats, feature: Floats) -> Floats:
        """Range over both ends, |p_T - a| + |a - p_R|."""
        offset = feature - agent
        return length_of(offset - self.tx) + length_of(offset - self.rx)

    def invert(self, agent: Floats, direction: Floats, length: Floats) -> Floats:
        """The ellipsoid with foci Tx and Rx in polar form about its centre; a range below the baseline counts as it."""
        focus = 0.5 * (self.rx - self.tx)
        major = np.maximum(0.5 * length, (1.0 + 1e-9) * length_of(focus))
        along = direction @ focus
        radius = np.sqrt((major**2 - focus @ focus) / (1.0 - (along / major) ** 2))
        return agent + 0.5 * (self.tx + self.rx) + radius[..., None] * direction

    def shell(self, length: Floats, dims: int) -> Floats:
        """That of a sphere of half the range: exact for ends that coincide, else to (baseline / range)^2."""
        return 0.5 * Direct(upper_half=self.upper_half).shell(0.5 * length, dims)


def length_of(vector: Floats) -> Floats:
    """Euclidean lengths (...,) of vectors (..., D), D = 2 or 3, without the temporaries of a norm."""
    square = vector[..., 0] ** 2
    for axis in range(1, vector.shape[-1]):
        square = square + vector[..., axis] ** 2
    return np.sqrt(square)


def random_directions(shape: tuple[int, int], dims: int, upper_half: bool, *, rng: np.random.Generator) -> Floats:
    """Unit vectors (K, N, D), uniform on circle or sphere; with `upper_half` the last coordinate is not negative.

    In two dimensions every row goes once round, one random angle in each of N equal parts.
    """
    if dims == 2:
        angle = (np.arange(shape[1]) + rng.random(shape)) * (np.pi if upper_half else 2.0 * np.pi) / shape[1]
        return np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    vector = rng.standard_normal((*shape, dims))
    if upper_half:
        vector[..., -1] = np.abs(vector[..., -1])
    return vector / np.maximum(length_of(vector), 1e-300)[..., None]
