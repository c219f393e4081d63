"""One element of a RIS panel: radiation pattern F and gain-area product G dx dy of eq. `single`."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model.ris import RisSpec

TANG_GAIN = 8.0
"""Gain G of a panel's element of pattern cos^3 (Tang et al., IEEE TWC 2021): 2 (q + 1) for F = cos^q, q = 3."""


def element_pattern(spec: RisSpec, cos_theta: Floats) -> Floats:
    """Power pattern F(theta) of a panel's element at cosines (...,) of the angle to its normal; 0 behind the panel.

    `tang`: cos^3 theta. `energy`: cos theta, the projected area of the cell.
    """
    front = np.clip(cos_theta, 0.0, 1.0)
    return front * front * front if spec.element == "tang" else front


def element_gain_area(spec: RisSpec, wavelength: float) -> float:
    """Gain times area of a panel's element, G dx dy [m^2].

    `tang`: 8 dx dy. `energy`: 4 pi (dx dy)^2 / lambda^2, what a perfectly conducting cell of that area re-radiates.
    """
    area = float(spec.spacing[0] * spec.spacing[1])
    return TANG_GAIN * area if spec.element == "tang" else 4.0 * np.pi * area**2 / wavelength**2
