"""Antenna patterns in closed form, and the coefficient of a specular leg between two such antennas."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.channel.image_source.fresnel import Coatings, polarisation_basis
from rislam_rt.model import Antennas

SHORT, HALF_WAVE = 1.5, 1.643
"""Directivities of a short and of a half-wave dipole (Balanis, Antenna Theory, eq. 4-26a and 4-84)."""
BEAM, DEEPEST, PEAK = np.radians(65.0), 30.0, 8.0
"""3GPP TR 38.901, table 7.3-1: beam width in either plane, largest attenuation [dB], gain [dBi]."""


class LegEnds(NamedTuple):
    """Antennas at the two ends of specular legs, and the agent's heading."""

    device: tuple[str, str]
    """Pattern and polarisation (`model.radio`) at the device."""
    far: tuple[str, str]
    """Pattern and polarisation at the far end: a landmark, or the Rx."""
    heading: Floats
    """(K,) [rad] of the agent, with which its antennas turn."""

    def coefficient(
        self, coatings: Coatings, walls: Integers, normals: Floats, direction: Floats, cycle: Integers
    ) -> Complexes:
        """Coefficient (N,) from antenna to antenna of legs that leave along `direction` (N, 3) and bounce on `walls`
        (N, d): both antenna patterns and the polarised reflections, without spreading loss and carrier phase."""
        heading = self.heading[cycle]
        basis = polarisation_basis(direction)
        parts = radiated(*self.device, direction, heading)
        sent = (parts[:, :1] * basis[0] + parts[:, 1:] * basis[1]).astype(np.complex128)
        field, arriving = coatings.carried(sent, walls, normals, direction)
        # seen from the other end theta_hat is the same and phi_hat the opposite
        basis, parts = polarisation_basis(arriving), radiated(*self.far, -arriving, heading)
        received = parts[:, :1] * basis[0] - parts[:, 1:] * basis[1]
        return np.asarray(np.sum(field * received, axis=-1) * np.prod(coatings.specular[walls], axis=1))


def radiated(pattern: str, polarization: str, direction: Floats, heading: Floats) -> Floats:
    """Field (N, 2) along theta_hat and phi_hat that an antenna turned by `heading` (N,) radiates along rays (N, 3), by
    its pattern."""
    level = amplitude(pattern, direction, heading)
    nothing = np.zeros_like(level)
    return np.stack([level, nothing] if polarization == "V" else [nothing, level], axis=-1)


def peak_amplitude(antennas: Antennas) -> float:
    """Largest amplitude factor of the Tx's and the Rx's antenna pattern together: all patterns are strongest ahead."""
    ahead, heading = np.array([[1.0, 0.0, 0.0]]), np.zeros(1)
    return float(amplitude(antennas.tx, ahead, heading)[0] * amplitude(antennas.rx, ahead, heading)[0])


def amplitude(pattern: str, direction: Floats, heading: Floats) -> Floats:
    """Amplitude (N,) of an antenna pattern in `direction` (N, 3): the root of its gain, 1 for an isotropic antenna."""
    cosine, sine = direction[:, 2], np.hypot(direction[:, 0], direction[:, 1])
    if pattern == "dipole":
        return np.asarray(np.sqrt(SHORT) * sine)
    if pattern == "hw_dipole":
        level = np.cos(0.5 * np.pi * cosine) / np.where(sine > 1e-5, sine, 1.0)
        return np.asarray(np.sqrt(HALF_WAVE) * np.abs(level))
    if pattern == "tr38901":
        below = np.arctan2(sine, cosine) - 0.5 * np.pi
        beside = np.angle(np.exp(1j * (np.arctan2(direction[:, 1], direction[:, 0]) - heading)))
        loss = [np.minimum(12.0 * (angle / BEAM) ** 2, DEEPEST) for angle in (below, beside)]
        return np.asarray(10.0 ** ((PEAK - np.minimum(loss[0] + loss[1], DEEPEST)) / 20.0))
    return np.ones(len(direction))
