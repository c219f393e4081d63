"""Response of a panel's elements to the legs of a path: eq. `single` (default) or far-field (`a3`); delays over it."""

import numpy as np

from rislam_rt.arrays import Complexes, Floats, phasor
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model.delay_spread import delay_spread_remark
from rislam_rt.model.ris import DataSheet, RisCode, RisSpec

TANG_GAIN = 8.0
"""Gain G of a panel's element of pattern cos^3 (Tang et al., IEEE TWC 2021): 2 (q + 1) for F = cos^q, q = 3."""


def element_pattern(spec: RisSpec, cos_theta: Floats) -> Floats:
    """Power pattern F(theta) of a panel's element at cosines (...,) of the angle to its normal; 0 behind the panel.

    `tang`: cos^3 theta. `energy`: cos theta, the projected area of the cell.
    """
    front = np.clip(cos_theta, 0.0, 1.0)
    return front * front * front if spec.element == "tang" else front


def element_gain_area(spec: RisSpec, wavelength: float) -> float:
    """Gain times area of a panel's element in its response, G dx dy [m^2].

    `tang`: 8 dx dy. `energy`: 4 pi (dx dy)^2 / lambda^2, what a perfectly conducting cell of that area re-radiates.
    """
    area = float(spec.spacing[0] * spec.spacing[1])
    return TANG_GAIN * area if spec.element == "tang" else 4.0 * np.pi * area**2 / wavelength**2


def leg_response(spec: RisSpec, center: Floats, device: Floats, coefficient: Complexes, wavelength: float) -> Complexes:
    """Response (..., N, M) of every panel element to one leg: two make eq. `single` without its phase shift.

    Parameters
    ----------
    center
        (..., 3) panel centre [m].
    device
        (..., 3) the device [m], mirrored in the walls of the leg, so that distance and direction are those in which
        the ray meets the panel.
    coefficient
        (...,) reflection coefficients of the leg times the square root of the device's antenna gain.
    wavelength
        [m].

    Each leg takes half (in dB) of the join's `sqrt(4 pi G dx dy) A / lambda`.
    """
    amplitude, distance = leg_parts(spec, center, device, wavelength)
    return np.asarray(coefficient)[..., None, None] * amplitude * phasor(-2.0 * np.pi / wavelength * distance)


def leg_parts(spec: RisSpec, center: Floats, device: Floats, wavelength: float) -> tuple[Floats, Floats]:
    """Amplitudes (..., N, M) of a panel's responses to one leg of coefficient 1, and elements' distances [m]."""
    distance = element_distances(spec, center, device)
    pattern = element_pattern(spec, ((device - center) @ spec.normal)[..., None, None] / distance)
    return leg_scale(spec, wavelength) * np.sqrt(pattern) / distance, distance


def element_distances(spec: RisSpec, center: Floats, device: Floats) -> Floats:
    """Distances (..., N, M) [m] of a panel's elements from a device (..., 3), for the response to one leg."""
    ray, offsets = np.asarray(device - center), spec.offsets()
    along = (ray @ offsets.reshape(-1, 3).T).reshape(*ray.shape[:-1], *offsets.shape[:-1])
    return np.asarray(np.sqrt(np.vecdot(ray, ray)[..., None, None] - 2.0 * along + np.vecdot(offsets, offsets)))


def far_field_response(
    spec: RisSpec, center: Floats, device: Floats, coefficient: Complexes, wavelength: float
) -> Complexes:
    """Response (..., N, M) of panel elements to a leg in the far field (Appendix A): plane waves, centre's amplitude.

    Valid for distances above `2 D^2 / lambda`, D the panel's diagonal.
    """
    ray = np.asarray(device - center)
    distance = np.linalg.norm(ray, axis=-1)
    direction = ray / distance[..., None]
    amplitude = leg_scale(spec, wavelength) * np.sqrt(element_pattern(spec, direction @ spec.normal)) / distance
    along = np.einsum("nmi,...i->...nm", spec.offsets(), direction)
    phase = phasor(-2.0 * np.pi / wavelength * (distance[..., None, None] - along))
    return (np.asarray(coefficient) * amplitude)[..., None, None] * phase


def zero_code(spec: DataSheet) -> RisCode:
    """Panel code with every element at phase level 0."""
    return RisCode(np.zeros((spec.rows, spec.cols), dtype=np.int64), spec.levels)


def leg_scale(spec: RisSpec, wavelength: float) -> float:
    """Factor [m] of a panel's response that is each leg's, before distance and pattern: a device's `lambda / (4 pi)`,
    and the square root of `sqrt(4 pi G dx dy) A / lambda`."""
    join = np.sqrt(4.0 * np.pi * element_gain_area(spec, wavelength)) * spec.amplitude / wavelength
    return float(np.sqrt(join) * wavelength / (4.0 * np.pi))


def delay_spread(spec: RisSpec, center: Floats, tx: Floats, rx: Floats) -> Floats:
    """Delay spread (...,) [s] over a panel: largest difference between elements of the delay from tx (..., 3) over the
    element to rx (..., 3)."""
    elements = np.asarray(center) + spec.offsets().reshape(-1, 3)
    length = sum(np.linalg.norm(np.asarray(end)[..., None, :] - elements, axis=-1) for end in (tx, rx))
    return np.ptp(length, axis=-1) / SPEED_OF_LIGHT


def delay_spread_warnings(spec: RisSpec, center: Floats, tx: Floats, rx: Floats, bandwidth: float) -> tuple[str, ...]:
    """Warning if delays over a panel spread by more than 1 / B: a path over it has no single delay; else none."""
    spread = float(np.max(delay_spread(spec, center, tx, rx), initial=0.0))
    if spread * bandwidth <= 1.0:
        return ()
    return ("ris: " + "; ".join(delay_spread_remark(spread, bandwidth)),)
