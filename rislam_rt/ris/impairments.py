"""Impairments of a RIS panel: weak, dead, stuck or phase-shifted elements, and bit errors on its control link."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers, freeze
from rislam_rt.errors import ConfigError
from rislam_rt.model.ris import DataSheet, RisCode
from rislam_rt.ranges import NotNegative, Probability, check_ranges

FREE = -1
"""Level of an element that is not stuck."""


@dataclass(frozen=True, slots=True)
class PanelTolerance:
    """Tolerances of a RIS panel's elements; all zero: a perfect panel."""

    amplitude_std: NotNegative = 0.0
    """Standard deviation of an element's amplitude about that of the data sheet, relative; at least 0 remains."""
    phase_std: NotNegative = 0.0
    """Standard deviation [rad] of an element's own phase offset (normal)."""
    dead: Probability = 0.0
    """Probability that an element reflects nothing."""
    stuck: Probability = 0.0
    """Probability that an element stays at a level of its own, whatever the code."""

    def __post_init__(self) -> None:
        check_ranges("panel", self)


@dataclass(frozen=True, slots=True, eq=False)
class PanelErrors:
    """Errors of a built RIS panel, element by element (N, M); of several panels all elements (1, E)."""

    amplitude: Floats
    """Factor on the data sheet's amplitude, 0 or more."""
    phase: Floats
    """[rad] added to the element's phase shift."""
    dead: Booleans
    """True where an element reflects nothing."""
    stuck: Any
    """Level at which an element is stuck, `FREE` where it takes on the code's."""

    def __post_init__(self) -> None:
        shape = np.shape(self.amplitude)
        freeze(self, np.float64, amplitude=(None, None), phase=shape)
        freeze(self, np.bool_, dead=shape)
        freeze(self, np.int64, stuck=shape)
        if (self.amplitude < 0.0).any():
            raise ConfigError(f"panel.amplitude: {self.amplitude.min()} received; give factors of 0 or more")

    @property
    def weight(self) -> Complexes:
        """Complex factor (N, M) of each panel element beside its commanded phase: amplitude, phase error; 0 if dead."""
        return np.where(self.dead, 0.0, self.amplitude) * np.exp(-1j * self.phase)

    def applied(self, code: RisCode) -> RisCode:
        """Panel code (..., N, M) that the elements take on under a commanded code: stuck ones keep their level."""
        return RisCode(np.where(self.stuck == FREE, code.index, self.stuck), code.levels)


def draw_panel(spec: DataSheet, tolerance: PanelTolerance, *, rng: np.random.Generator) -> PanelErrors:
    """Draw the element errors of a RIS panel, or of several, independently for each element.

    Every kind of error has a draw of its own, so that changing one tolerance leaves the other errors as they are.
    """
    shape = spec.rows, spec.cols
    amplitude = np.maximum(1.0 + tolerance.amplitude_std * rng.standard_normal(shape), 0.0)
    phase = tolerance.phase_std * rng.standard_normal(shape)
    dead = rng.random(shape) < tolerance.dead
    level = rng.integers(spec.levels, size=shape)
    return PanelErrors(amplitude, phase, dead, np.where(rng.random(shape) < tolerance.stuck, level, FREE))


def flip_bits(code: RisCode, probability: float, *, rng: np.random.Generator) -> RisCode:
    """Panel code after a control link that flips each bit of each level with a probability.

    A level travels as a plain binary number of log2(H) bits.

    Raises
    ------
    ConfigError
        H is not a power of two, or the probability is outside [0, 1].
    """
    if not 0.0 <= probability <= 1.0:
        raise ConfigError(f"panel.bit_flip: {probability} received; give a probability from 0 to 1")
    bits = int(code.levels).bit_length() - 1
    if code.levels != 1 << bits:
        raise ConfigError(f"ris.levels: {code.levels} received; bit errors need a power of two")
    flipped: Integers = (rng.random((*code.index.shape, bits)) < probability) @ (1 << np.arange(bits))
    return RisCode(code.index ^ flipped, code.levels)
