"""Fisher information of overlapping paths on delays, angles and gains (Appendix B), and its part with gains unknown.

Antenna l receives `sum_i alpha_i b_l(i) s(t - tau_i)` in noise of density N0. Every derivative of it is a coefficient
times a derivative of s times an antenna vector, so the whole matrix follows from R_s, two derivatives of it, and the
inner products of antenna vectors.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.information.position_bound import Outcome
from rislam_rt.model import RadioConfig
from rislam_rt.waveform import autocorrelation

ILL_CONDITIONED = 1e-10
"""Smallest eigenvalue, of a matrix with unit diagonal, below which two paths' gains count as inseparable."""


class EquivalentDelayInformation(NamedTuple):
    """Equivalent Fisher information on delays (and cosines) of overlapping paths, the complex gains unknown."""

    information: Floats
    """(..., D, D): D = P delays [1/s^2], or 3 P delays, first and second cosines. Zero where degenerate."""
    outcome: Integers
    """(...,) values of `Outcome`."""


def steering(arrival: Floats, radio: RadioConfig, heading: Floats | float = 0.0) -> Complexes:
    """Antenna vectors (..., P, L) `exp(j 2 pi x_l . a / lambda)` of directions (..., P, 3), for the information on
    delays and gains."""
    body = arrival @ rotation_z(np.asarray(heading, dtype=np.float64))
    return np.exp(2j * np.pi / radio.wavelength * body @ radio.array.positions(radio.wavelength).T)


def delay_gain_information(
    tau: Floats, gain: Complexes, radio: RadioConfig, *, antennas: Complexes | None = None, angles: bool = False
) -> Floats:
    """Fisher information J(chi) of overlapping paths over (tau, [u, v,] Re alpha, Im alpha), Appendix B: (..., 3P, 3P),
    with angles (..., 5P, 5P).

    Parameters
    ----------
    tau
        (..., P) [s].
    gain
        (..., P).
    antennas
        (..., P, L) of `steering`; without it one antenna vector of ones serves all paths, so that only delays tell
        paths apart.
    angles
        Whether the direction cosines u, v (body x, y) are unknown too.

    Lambda_B has the first derivative of R_s, where the paper prints a second one. Units: 1/s^2 for delays, 1 for
    gains and cosines, and their products.
    """
    tau, gain = np.asarray(tau, dtype=np.float64), np.asarray(gain, dtype=np.complex128)
    positions = radio.array.positions(radio.wavelength)
    if antennas is None:
        antennas = np.ones((*tau.shape, len(positions)), dtype=np.complex128)
    difference = tau[..., :, None] - tau[..., None, :]
    zeroth, first, second = (
        autocorrelation(difference, radio.bandwidth, radio.energy, derivative=order) for order in (0, 1, 2)
    )
    # time factor of <row, column> for (undifferentiated, delay-differentiated) rows and columns
    time = {(0, 0): zeroth, (1, 0): first, (0, 1): -first, (1, 1): -second}
    blocks: list[tuple[int, Complexes, Complexes]] = [(1, gain, antennas)]
    if angles:
        slope = 2j * np.pi / radio.wavelength * positions
        blocks += [(0, gain, antennas * slope[:, axis]) for axis in (0, 1)]
    one = np.ones_like(gain)
    blocks += [(0, one, antennas), (0, 1j * one, antennas)]
    rows = []
    for order_i, factor_i, vector_i in blocks:
        row = []
        for order_j, factor_j, vector_j in blocks:
            space = np.conj(factor_i)[..., :, None] * factor_j[..., None, :]
            space = space * (np.conj(vector_i) @ np.swapaxes(vector_j, -1, -2))
            row.append(2.0 / radio.noise_psd * np.real(space) * time[order_i, order_j])
        rows.append(np.concatenate(row, axis=-1))
    return np.concatenate(rows, axis=-2)


def eliminate_gains(information: Floats, num_paths: int) -> EquivalentDelayInformation:
    """Equivalent Fisher information on delays (and cosines) from J(chi), gains eliminated by Schur complement."""
    kept = information.shape[-1] - 2 * num_paths
    nuisance = information[..., kept:, kept:]
    scale = np.sqrt(np.diagonal(nuisance, axis1=-2, axis2=-1))
    unit_diagonal = nuisance / scale[..., :, None] / scale[..., None, :]
    degenerate = np.linalg.eigvalsh(unit_diagonal)[..., 0] < ILL_CONDITIONED
    safe = np.where(degenerate[..., None, None], np.eye(2 * num_paths), unit_diagonal)
    cross = information[..., :kept, kept:] / scale[..., None, :]
    reduced = information[..., :kept, :kept] - cross @ np.linalg.solve(safe, np.swapaxes(cross, -1, -2))
    reduced = np.where(degenerate[..., None, None], 0.0, 0.5 * (reduced + np.swapaxes(reduced, -1, -2)))
    return EquivalentDelayInformation(reduced, np.where(degenerate, int(Outcome.DEGENERATE), int(Outcome.OK)))


def map_to_position(delays: Floats, gradient: Floats) -> Floats:
    """Fisher information (..., D, D) [1/m^2] on the position from that on delays (..., P, P): `T J T^T` of Appendix B.

    `gradient` (..., P, D) is that of the path lengths.
    """
    return np.swapaxes(gradient, -1, -2) @ delays @ gradient / SPEED_OF_LIGHT**2
