"""Cross-section of a scatterer: what it re-radiates from one direction into another, by the law of its scene."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.cylinder import cylinder_rcs
from rislam_rt.channel.sphere import sphere_rcs
from rislam_rt.model import Scatterer


def cross_section(scatterer: Scatterer, wavelength: float, toward_tx: Floats, toward_rx: Floats) -> Floats:
    """Cross-section (...,) [m^2] between unit vectors (..., 3) from the scatterer to both ends of the path.

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
