"""Cross-section of a conducting cylinder by physical optics, for any pair of directions."""

import numpy as np

from rislam_rt.arrays import Floats


def cylinder_rcs(
    radius: float, height: float, axis: Floats, wavelength: float, toward_tx: Floats, toward_rx: Floats
) -> Floats:
    """Cross-section (...,) [m^2] of the round side of a finite cylinder; its flat ends are left out.

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
