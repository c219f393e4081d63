"""Rays along which components arrive, and where they would end if they came straight from a point."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.slam.returns import Poses


def places(seen: Floats, poses: Poses) -> tuple[Floats, Floats]:
    """Points (..., 3) at which lengths and cosines (..., 3) end, and their distances (...,) from the Rx.

    A point on the ray `u` from the Rx lies as far out as the two legs have length for: `|r u - b| = l - r` with `b`
    from Rx to Tx.
    """
    ray, base = rays(seen, poses.heading), poses.tx - poses.rx
    length = np.maximum(seen[..., 0], np.linalg.norm(base) + 1e-3)
    reach = (length**2 - base @ base) / (2.0 * (length - ray @ base))
    return poses.rx + reach[..., None] * ray, reach


def rays(seen: Floats, heading: Floats | float) -> Floats:
    """Unit vectors (..., 3) towards what arrives from above with lengths and cosines (..., 3), in the room's axes."""
    flat = seen[..., 1:] / np.maximum(1.0, np.linalg.norm(seen[..., 1:], axis=-1))[..., None]
    up = np.sqrt(np.maximum(1.0 - np.sum(flat**2, axis=-1), 0.0))
    return np.concatenate([flat, up[..., None]], axis=-1) @ rotation_z(np.asarray(heading)).T
