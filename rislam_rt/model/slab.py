"""Slabs of building materials: permittivity and reflection coefficients by ITU-R P.2040."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model.itu import itu_parameters
from rislam_rt.model.scene import Material

VACUUM_PERMITTIVITY = 8.8541878128e-12
"""[F/m], CODATA 2018."""


def relative_permittivity(name: str, carrier: float) -> complex:
    """Complex relative permittivity of an ITU-R P.2040 material at the carrier [Hz].

    `a f^b - j c f^d / (omega eps0)`, f in GHz.

    Raises
    ------
    SceneError
        The material is unknown, or not specified at the carrier.
    """
    a, b, c, d = itu_parameters(name, carrier)
    ghz = carrier / 1e9
    return complex(a * ghz**b, -c * ghz**d / (2.0 * np.pi * carrier * VACUUM_PERMITTIVITY))


def slab_permittivity(material: Material, carrier: float) -> complex:
    """Complex relative permittivity of a material at the carrier [Hz], by ITU-R P.2040 or as given; 1 for constant R.

    Raises
    ------
    SceneError
        An ITU material is not specified at the carrier.
    """
    if material.itu is not None:
        return relative_permittivity(material.itu, carrier)
    if material.permittivity is None:
        return 1.0 + 0.0j
    return complex(material.permittivity, -material.conductivity / (2.0 * np.pi * carrier * VACUUM_PERMITTIVITY))


def slab_coefficients(
    cos_theta: Floats, permittivity: Complexes, thickness: Floats, carrier: float
) -> tuple[Complexes, Complexes]:
    """TE and TM reflection coefficients (...,) of a slab in air (ITU-R P.2040, single-layer slab).

    Parameters
    ----------
    cos_theta
        (...,) cosine of the angle of incidence, in [0, 1].
    permittivity
        (...,) complex relative permittivity, imaginary part not positive.
    thickness
        (...,) [m].
    """
    root = np.sqrt(permittivity - (1.0 - cos_theta**2))
    te = (cos_theta - root) / (cos_theta + root)
    tm = (permittivity * cos_theta - root) / (permittivity * cos_theta + root)
    through = np.exp(-4j * np.pi * carrier / SPEED_OF_LIGHT * thickness * root)
    return te * (1.0 - through) / (1.0 - te**2 * through), tm * (1.0 - through) / (1.0 - tm**2 * through)


class NormalReflection(NamedTuple):
    """Reflection of a slab at normal incidence, beside that of the same material without a back."""

    slab: float
    """Modulus of the reflection coefficient."""
    half_space: float
    """Modulus of the reflection coefficient of an infinitely thick slab."""
    half_wave: float
    """Thickness [m] of half a wave in the material: of slabs of its multiples the two faces' reflections cancel."""


def normal_reflection(material: Material, carrier: float) -> NormalReflection | None:
    """Reflection of a slab at normal incidence and the carrier [Hz]; None for constant coefficients.

    Raises
    ------
    SceneError
        An ITU material is not specified at the carrier.
    """
    if material.itu is None and material.permittivity is None:
        return None
    permittivity, one = np.array(slab_permittivity(material, carrier)), np.array(1.0)
    slab, _ = slab_coefficients(one, permittivity, np.array(material.thickness), carrier)
    root = np.sqrt(permittivity)
    half_wave = SPEED_OF_LIGHT / (2.0 * carrier * float(root.real))
    return NormalReflection(float(abs(slab)), float(abs((1.0 - root) / (1.0 + root))), half_wave)
