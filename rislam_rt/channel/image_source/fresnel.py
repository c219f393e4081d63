"""Fresnel reflection of a polarised ray on walls: slabs of building materials, or constant coefficients."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers, cross
from rislam_rt.geometry.planes import mirror_direction
from rislam_rt.model import Material
from rislam_rt.model.slab import slab_coefficients, slab_permittivity


def polarisation_basis(direction: Floats) -> tuple[Floats, Floats]:
    """Polarisation basis theta_hat and phi_hat (..., 3) of directions (..., 3); along the pole, those of azimuth 0."""
    x, y, z = np.moveaxis(direction, -1, 0)
    across = np.hypot(x, y)
    at_pole = across < 1e-12
    scale = np.where(at_pole, 1.0, across)
    c, s = np.where(at_pole, 1.0, x / scale), np.where(at_pole, 0.0, y / scale)
    zero = np.zeros_like(c)
    return np.stack([z * c, z * s, -across], axis=-1), np.stack([-s, c, zero], axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class Coatings:
    """Reflection properties of W walls at one carrier: constant coefficients, or slabs for the Fresnel equations."""

    carrier: float
    """[Hz]."""
    reflection: Floats
    """(W,) constant reflection coefficient, 0 for slabs."""
    permittivity: Complexes
    """(W,) complex relative permittivity, 1 for a constant reflection coefficient."""
    thickness: Floats
    """(W,) [m] of the slab."""
    specular: Floats
    """(W,) share of the reflected field that is not scattered."""
    te: Floats
    """(W,) constant TE coefficient (across the plane of incidence), NaN where it follows from the angle."""
    tm: Floats
    """(W,) constant TM coefficient (in the plane of incidence), NaN where it follows from the angle."""

    def coefficient(self, walls: Integers, normals: Floats, direction: Floats) -> Complexes:
        """Fresnel reflection coefficients (N,) of rays that leave along `direction` (N, 3) and meet `walls` (N, d).

        With slabs on the way, both ends are vertically polarised and the coefficient is the vertical part of what
        arrives of a vertical unit field. `normals` (N, d, 3) are those of the walls. Seen from the far end theta_hat is
        the same; taken from the arriving ray it also has the same azimuth where that ray is exactly vertical.
        """
        constant: Complexes = np.prod(self.reflection[walls], axis=1).astype(np.complex128)
        rows = np.flatnonzero((self.reflection[walls] == 0.0).any(axis=1))
        field = polarisation_basis(direction[rows])[0].astype(np.complex128)
        field, incident = self.carried(field, walls[rows], normals[rows], direction[rows])
        constant[rows] = np.sum(field * polarisation_basis(incident)[0], axis=-1)
        return np.asarray(constant * np.prod(self.specular[walls], axis=1))

    def carried(self, field: Complexes, walls: Integers, normals: Floats, incident: Floats) -> tuple[Complexes, Floats]:
        """Polarised fields (N, 3) after specular reflection on `walls` (N, d), scattering loss left out, and the last
        rays' directions (N, 3)."""
        for wall, normal in zip(walls.T, normals.swapaxes(0, 1), strict=True):
            reflected = mirror_direction(incident, normal)
            field = self._reflect(field, incident, reflected, normal, wall)
            incident = reflected
        return field, incident

    def _reflect(
        self, field: Complexes, incident: Floats, reflected: Floats, normal: Floats, wall: Integers
    ) -> Complexes:
        """Field vectors (N, 3) after a Fresnel bounce on walls (N,)."""
        # A slab acts on the components across (TE) and in (TM) the plane of incidence; a wall with a constant
        # coefficient keeps the vertical and the horizontal component and scales both.
        cos_theta = np.abs(np.sum(incident * normal, axis=-1))
        te, tm = slab_coefficients(cos_theta, self.permittivity[wall], self.thickness[wall], self.carrier)
        te = np.where(np.isnan(self.te[wall]), te, self.te[wall])
        tm = np.where(np.isnan(self.tm[wall]), tm, self.tm[wall])
        across, along_in, along_out = _incidence_basis(incident, reflected, normal)
        slab = _turned(field, across, across, te) + _turned(field, along_in, along_out, tm)
        before, after = polarisation_basis(incident), polarisation_basis(reflected)
        constant = self.reflection[wall]
        kept = _turned(field, before[0], after[0], constant) + _turned(field, before[1], after[1], constant)
        return np.where(constant[:, None] > 0.0, kept, slab)


def build_coatings(materials: tuple[Material, ...], carrier: float) -> Coatings:
    """Look up the materials of the walls for Fresnel reflection at the carrier [Hz].

    Raises
    ------
    SceneError
        A material is unknown, or not specified at the carrier.
    """
    return Coatings(
        carrier,
        np.array([m.reflection or 0.0 for m in materials], dtype=np.float64),
        np.array([slab_permittivity(m, carrier) for m in materials], dtype=np.complex128),
        np.array([m.thickness for m in materials], dtype=np.float64),
        np.array([m.specular_share for m in materials], dtype=np.float64),
        np.array([np.nan if m.reflection_te is None else m.reflection_te for m in materials], dtype=np.float64),
        np.array([np.nan if m.reflection_tm is None else m.reflection_tm for m in materials], dtype=np.float64),
    )


def _incidence_basis(incident: Floats, reflected: Floats, normal: Floats) -> tuple[Floats, Floats, Floats]:
    """Unit vectors for Fresnel reflection: across the plane of incidence, and in it across either ray."""
    across = cross(incident, normal)
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    level: Booleans = length < 1e-12  # normal incidence: any direction in the wall serves, TE and TM agree there
    fallback = cross(normal, np.where(np.abs(normal[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    across = np.where(level, fallback, across)
    across = across / np.linalg.norm(across, axis=-1, keepdims=True)
    return across, cross(across, incident), cross(across, reflected)


def _turned(field: Complexes, onto: Floats, out: Floats, coefficient: Floats | Complexes) -> Complexes:
    """Reflected part `coefficient (onto . field) out` of a polarised field (N, 3): the part along `onto`, now along
    `out`."""
    return np.asarray((coefficient * np.sum(field * onto, axis=-1))[:, None] * out)
