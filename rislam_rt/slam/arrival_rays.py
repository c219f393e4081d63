"""Arrival rays of components in room axes, and where on them a point scatterer would lie."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.slam.predicted_returns import Poses


def scatterer_positions(seen: Floats, poses: Poses) -> tuple[Floats, Floats]:
    """Positions (..., 3) [m] on arrival rays of the scatterers that explain lengths and cosines (..., 3), and distances
    (...,) to Rx.

    A point on the ray `u` from the Rx lies as far out as the two legs have length for: `|r u - b| = l - r` with `b`
    from Rx to Tx.
    """
    ray, base = rays(seen, poses.heading), poses.tx - poses.rx
    length = np.maximum(seen[..., 0], np.linalg.norm(base) + 1e-3)
    reach = (length**2 - base @ base) / (2.0 * (length - ray @ base))
    return poses.rx + reach[..., None] * ray, reach


def rays(seen: Floats, heading: Floats | float) -> Floats:
    """Arrival rays: unit vectors (..., 3) in room axes towards the arrivals of lengths and cosines (..., 3), taken as
    from above."""
    flat = seen[..., 1:] / np.maximum(1.0, np.linalg.norm(seen[..., 1:], axis=-1))[..., None]
    up = np.sqrt(np.maximum(1.0 - np.sum(flat**2, axis=-1), 0.0))
    return np.concatenate([flat, up[..., None]], axis=-1) @ rotation_z(np.asarray(heading)).T
