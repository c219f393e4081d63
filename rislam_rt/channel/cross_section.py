"""Radar cross-section of a scatterer, from the Tx's direction into the Rx's, by the law that the scene file names.

A conducting sphere by physical optics (pi r^2, the scene's default) or by the exact Mie series, a conducting cylinder
by physical optics.
"""

import numpy as np
import scipy

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.errors import SceneError
from rislam_rt.model import Scatterer

MAX_SIZE = 3000.0
"""Largest size parameter k r of a sphere for which the Mie series is summed: its time grows with the square (0.2 s
there), and from 1000 on the cross-section is pi r^2 within 3e-7."""


def cross_section(scatterer: Scatterer, wavelength: float, toward_tx: Floats, toward_rx: Floats) -> Floats:
    """Radar cross-section (...,) [m^2] of a scatterer for a path with unit vectors (..., 3) from it to both ends.

    `constant`: the scene's value. `mie`: the exact backscattering of a conducting sphere at the wavelength [m], for
    all directions as in eq. `a2`. `cylinder`: physical optics, direction by direction.
    """
    if scatterer.law == "cylinder":
        assert scatterer.radius is not None
        assert scatterer.height is not None
        return cylinder_rcs(scatterer.radius, scatterer.height, scatterer.axis, wavelength, toward_tx, toward_rx)
    value = scatterer.rcs
    if scatterer.law == "mie":
        assert scatterer.radius is not None
        value = float(sphere_rcs(scatterer.radius, wavelength, np.array(np.pi))[0])
    return np.full(np.broadcast_shapes(np.shape(toward_tx), np.shape(toward_rx))[:-1], value)


def sphere_rcs(radius: float, wavelength: float, angle: Floats) -> tuple[Floats, Floats]:
    """Bistatic cross-sections (...,) [m^2] of a perfectly conducting sphere, across and in the scattering plane.

    Parameters
    ----------
    radius, wavelength
        [m].
    angle
        (...,) [rad] between the directions of travel before and after; pi is back to the source.

    `4 pi |S1|^2 / k^2` and `4 pi |S2|^2 / k^2` of the Mie series (Bohren and Huffman, ch. 4).
    """
    number = 2.0 * np.pi / wavelength
    across, within = mie_amplitudes(number * radius, np.cos(angle))
    scale = 4.0 * np.pi / number**2
    return scale * np.abs(across) ** 2, scale * np.abs(within) ** 2


def mie_amplitudes(size: float, cos_angle: Floats) -> tuple[Complexes, Complexes]:
    """Mie amplitudes S1 and S2 (...,) of a conducting sphere's cross-section at size parameter k r, by cosines (...,)
    of scattering.

    Raises
    ------
    SceneError
        The sphere is larger than `MAX_SIZE`.
    """
    if size > MAX_SIZE:
        raise SceneError(
            f"scatterer.mie: a sphere of k r = {size:.3g} received, of which the series takes as many terms; "
            f"leave 'mie' out above {MAX_SIZE:g}, where pi r^2 is the same within 3e-7"
        )
    electric, magnetic = mie_coefficients(size)
    cos_angle = np.asarray(cos_angle, dtype=np.float64)
    before, here = np.zeros_like(cos_angle), np.ones_like(cos_angle)
    s1, s2 = (np.zeros(cos_angle.shape, dtype=np.complex128) for _ in range(2))
    for n, (a, b) in enumerate(zip(electric, magnetic, strict=True), start=1):
        tau = n * cos_angle * here - (n + 1) * before
        weight = (2 * n + 1) / (n * (n + 1))
        s1 += weight * (a * here + b * tau)
        s2 += weight * (a * tau + b * here)
        before, here = here, ((2 * n + 1) * cos_angle * here - (n + 1) * before) / n
    return s1, s2


def mie_coefficients(size: float) -> tuple[Complexes, Complexes]:
    """Mie coefficients a_n and b_n (N,), n = 1 .. N, of a conducting sphere of size parameter k r, for its
    cross-section.

    With psi and xi the Riccati-Bessel functions, `a_n = psi_n' / xi_n'`, `b_n = psi_n / xi_n`; Wiscombe's number of
    terms.
    """
    n = np.arange(1, int(size + 4.05 * size ** (1.0 / 3.0) + 2.0) + 1)
    j, y = scipy.special.spherical_jn(n, size), scipy.special.spherical_yn(n, size)
    psi, chi = size * j, size * y
    d_psi = j + size * scipy.special.spherical_jn(n, size, derivative=True)
    d_chi = y + size * scipy.special.spherical_yn(n, size, derivative=True)
    return d_psi / (d_psi + 1j * d_chi), psi / (psi + 1j * chi)


def cylinder_rcs(
    radius: float, height: float, axis: Floats, wavelength: float, toward_tx: Floats, toward_rx: Floats
) -> Floats:
    """Radar cross-section (...,) [m^2] of the round side of a finite conducting cylinder; its flat ends are left out.

    Parameters
    ----------
    radius, height, wavelength
        [m].
    axis
        (3,) unit vector.
    toward_tx, toward_rx
        (..., 3) unit vectors from the cylinder.

    `sigma = r q_across h^2 sinc^2(q_along h / 2) / 2` with `q = 2 pi / lambda (toward_tx + toward_rx)`, split along
    and across the axis: the surface integral of `n . q` evaluated at the line that mirrors the one direction into the
    other. Broadside backscattering is the textbook's `2 pi r h^2 / lambda`; the same integral over a sphere gives
    `pi r^2` for all directions, the paper's value. For `2 pi r / lambda` well above 1 and distances beyond
    `2 h^2 / lambda`.
    """
    q = 2.0 * np.pi / wavelength * (np.asarray(toward_tx) + np.asarray(toward_rx))
    along = q @ axis
    across = np.linalg.norm(q - along[..., None] * axis, axis=-1)
    return 0.5 * radius * across * height**2 * np.sinc(along * height / (2.0 * np.pi)) ** 2
