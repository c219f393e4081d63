"""Fields of traced legs: reflections and antenna patterns by Sionna's materials and patterns, carried in float64.

Sionna carries a field in the (theta, phi) basis of the ray's direction, in float32. That basis turns over at the pole:
within 1e-3 rad of the vertical Sionna takes another one, in which a bounce off floor or ceiling is a mirror image, and
a vertical ray has no azimuth that both its ends agree on. So the materials are asked in the plane of incidence, where
no basis has a pole, and the field is carried from bounce to bounce by the path's own directions.
"""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import sionna.rt as rt
from sionna.rt import antenna_pattern
from sionna.rt.utils import spectrum_to_matrix_4f

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers, cross
from rislam_rt.channel.specular_legs import NO_WALL
from rislam_rt.channel.traced.leg_query import LegEndpoints
from rislam_rt.channel.traced.path_geometry import PathGeometry, segment_directions
from rislam_rt.channel.traced.radio_materials import ConstantReflection
from rislam_rt.channel.traced.tracer_scene import TracerScene, as_floats
from rislam_rt.channel.walls import Walls
from rislam_rt.model import Antennas

POLE = 1e-12
"""Sine of the zenith angle below which a direction counts as vertical (a thousand float64 roundings): its azimuth is
then 0, for all segments of a leg alike."""


def leg_coefficients(
    tracer_scene: TracerScene, walls: Walls, sequences: Integers, ends: LegEndpoints, geometry: PathGeometry,
    antennas: Antennas,
) -> Complexes:  # fmt: skip
    """Field coefficient (N,) of legs over wall sequences (N, D), from reflections and antenna patterns, without
    spreading loss and carrier phase.

    Between isotropic antennas of one polarisation what is left is the reflection: exactly the
    product of R for walls of constant R, and the part of the Fresnel-reflected field in that polarisation for slabs.
    The field is a Jones vector (N, 2) along theta_hat and phi_hat of each segment's direction of travel.
    """
    if len(sequences) == 0:
        return np.zeros(0, dtype=np.complex128)
    travel = segment_directions(walls, sequences, geometry.at_device)
    field = _radiated(antennas, travel[:, 0], ends.heading, ends.from_rx, antennas.of_tx)
    for bounce, wall in enumerate(sequences.T):
        for number, material in enumerate(tracer_scene.materials):
            rows = np.flatnonzero((wall != NO_WALL) & (tracer_scene.material_of_wall[wall] == number))
            if len(rows):
                normal = walls.normal[wall[rows]]
                jones = _jones(material, travel[rows, bounce], travel[rows, bounce + 1], normal)
                field[rows] = (jones @ field[rows][..., None])[..., 0]
    received = _radiated(antennas, -travel[:, -1], ends.heading, ends.to_rx, antennas.of_landmark)
    received[:, 1] *= -1.0  # theta_hat is the same seen from either end, phi_hat the opposite
    return np.vecdot(received, field)


def _jones(material: Any, incident: Floats, reflected: Floats, normal: Floats) -> Complexes:
    """Jones matrices (N, 2, 2), or (1, 2, 2) for all, of the field's reflection between the (theta, phi) bases of rays
    (N, 3) before and after."""
    # A wall of constant R is given in those bases; a slab across the plane of incidence and in it, and turned here.
    if isinstance(material, ConstantReflection):
        return incidence_jones(material, np.ones(1))
    along = np.vecdot(incident, normal)
    across = cross(incident, normal)
    sine = np.linalg.norm(across, axis=-1, keepdims=True)
    # at normal incidence any direction in the wall will do: across and along the plane are alike there
    across = np.where(sine > POLE, across / np.where(sine > POLE, sine, 1.0), spherical_basis(incident)[0])
    before, after = (_turn(spherical_basis(ray), across) for ray in (incident, reflected))
    return np.asarray(after.swapaxes(1, 2) @ incidence_jones(material, np.abs(along)) @ before)


def incidence_jones(material: Any, cosine: Floats) -> Complexes:
    """Jones matrices (N, 2, 2) of a field's reflection by a radio material at cosines (N,) of incidence, in the basis
    across and in the plane of incidence.

    The first component of a field is along a unit vector s across the plane, the second along `k x s`, k being the
    ray's direction. Sionna's material is evaluated with the wall's normal along x and the rays level, where its own
    basis is s = -z.
    """
    count = len(cosine)
    along, up = map(as_floats, (cosine, np.sqrt(1.0 - np.minimum(cosine, 1.0) ** 2)))
    incident, reflected = mi.Vector3f(-along, up, 0.0), mi.Vector3f(along, up, 0.0)
    bounce = dr.zeros(mi.SurfaceInteraction3f, count)
    bounce.n = bounce.sh_frame.n = mi.Normal3f(1.0, 0.0, 0.0)
    bounce.initialize_sh_frame()
    bounce.wi = bounce.to_local(incident)
    event = dr.full(mi.UInt, rt.InteractionType.SPECULAR, count)
    bounce.dp_du = mi.Vector3f(0.0, 0.0, dr.reinterpret_array(mi.Float, event))
    context = mi.BSDFContext(mode=mi.TransportMode.Importance, type_mask=0, component=0)
    real = spectrum_to_matrix_4f(material.eval(context, bounce, reflected, True))
    dr.eval(real)
    # read part by part: as a whole Dr.Jit would compile a kernel that reorders it, for every number of rays another
    matrix = np.empty((count, 2, 2), dtype=np.complex128)
    for row, column in np.ndindex(2, 2):
        matrix[:, row, column] = np.array(real[row, column]) + 1j * np.array(real[2 + row, column])
    return matrix


def spherical_basis(direction: Floats) -> tuple[Floats, Floats]:
    """Basis of a traced field: unit vectors theta_hat and phi_hat (N, 3) of directions (N, 3), of azimuth 0 along the
    vertical."""
    cosine, azimuth = direction[:, 2], _azimuth(direction)
    c, s = np.cos(azimuth), np.sin(azimuth)
    sine = np.hypot(direction[:, 0], direction[:, 1])
    return np.stack([cosine * c, cosine * s, -sine], axis=-1), np.stack([-s, c, np.zeros_like(c)], axis=-1)


def _azimuth(direction: Floats) -> Floats:
    """Azimuth (N,) [rad] of directions (N, 3), for the basis of a traced field; 0 along the vertical."""
    x, y = direction[:, 0], direction[:, 1]
    return np.where(np.hypot(x, y) > POLE, np.arctan2(y, x), 0.0)


def _turn(basis: tuple[Floats, Floats], across: Floats) -> Floats:
    """Matrices (N, 2, 2) that turn fields along theta_hat and phi_hat to those along s = `across` (N, 3) and k x s."""
    c, s = (np.vecdot(vector, across) for vector in basis)
    return np.stack([np.stack([c, s], axis=-1), np.stack([-s, c], axis=-1)], axis=1)


def _radiated(
    antennas: Antennas, direction: Floats, heading: Floats, is_rx: Booleans, otherwise: tuple[str, str]
) -> Complexes:
    """Field (N, 2) along theta_hat and phi_hat that antennas radiate in `direction` (N, 3): the Rx's where `is_rx` (N,)
    holds, else that of pattern and polarisation `otherwise`."""
    field = np.empty((len(direction), 2), dtype=np.complex128)
    for mine, (name, polarization) in ((is_rx, antennas.of_rx), (~is_rx, otherwise)):
        rows = np.flatnonzero(mine)
        if not len(rows):
            continue
        shape = getattr(antenna_pattern, f"v_{name}_pattern")
        kind = antenna_pattern.PolarizedAntennaPattern(v_pattern=shape, polarization=polarization)
        theta = np.arctan2(np.hypot(direction[rows, 0], direction[rows, 1]), direction[rows, 2])
        angles = theta, _azimuth(direction[rows]) - heading[rows]
        gains = kind.patterns[0](*map(as_floats, angles))
        for part, gain in enumerate(gains):
            field[rows, part] = np.array(gain.real) + 1j * np.array(gain.imag)
    return field
