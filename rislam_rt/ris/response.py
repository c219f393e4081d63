"""Response of a panel's elements to the legs of a path: element-wise (eq. `single`, default) and far-field (`a3`)."""

import numpy as np

from rislam_rt.arrays import Complexes, Floats, phasor
from rislam_rt.model.ris import DataSheet, RisCode, RisSpec
from rislam_rt.ris.element import element_gain_area, element_pattern


def leg_response(spec: RisSpec, center: Floats, device: Floats, coefficient: Complexes, wavelength: float) -> Complexes:
    """Response (..., N, M) of every panel element to one leg: eq. `single` without its phase shift is the product of
    two.

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
    """Amplitudes (..., N, M) of a panel's element responses to one leg, for a coefficient of 1, and distances [m] of
    the elements."""
    ray, offsets = np.asarray(device - center), spec.offsets()
    along = (ray @ offsets.reshape(-1, 3).T).reshape(*ray.shape[:-1], *offsets.shape[:-1])
    distance = np.sqrt(np.vecdot(ray, ray)[..., None, None] - 2.0 * along + np.vecdot(offsets, offsets))
    pattern = element_pattern(spec, (ray @ spec.normal)[..., None, None] / distance)
    return _leg_share(spec, wavelength) * np.sqrt(pattern) * wavelength / (4.0 * np.pi * distance), distance


def far_field_response(
    spec: RisSpec, center: Floats, device: Floats, coefficient: Complexes, wavelength: float
) -> Complexes:
    """Response (..., N, M) of every panel element to one leg in the far field (Appendix A): plane waves, amplitude of
    the centre.

    Valid for distances above `2 D^2 / lambda`, D the panel's diagonal.
    """
    ray = np.asarray(device - center)
    distance = np.linalg.norm(ray, axis=-1)
    direction = ray / distance[..., None]
    amplitude = (
        _leg_share(spec, wavelength)
        * np.sqrt(element_pattern(spec, direction @ spec.normal))
        * wavelength
        / (4.0 * np.pi * distance)
    )
    along = np.einsum("nmi,...i->...nm", spec.offsets(), direction)
    phase = phasor(-2.0 * np.pi / wavelength * (distance[..., None, None] - along))
    return (np.asarray(coefficient) * amplitude)[..., None, None] * phase


def zero_code(spec: DataSheet) -> RisCode:
    """Panel code with every element at phase level 0."""
    return RisCode(np.zeros((spec.rows, spec.cols), dtype=np.int64), spec.levels)


def _leg_share(spec: RisSpec, wavelength: float) -> float:
    """Square root of the factor `sqrt(4 pi G dx dy) A / lambda` that joins two legs."""
    join = np.sqrt(4.0 * np.pi * element_gain_area(spec, wavelength)) * spec.amplitude / wavelength
    return float(np.sqrt(join))
