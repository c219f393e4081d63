"""Spherical angles: theta is the zenith angle in [0, pi], phi the azimuth in (-pi, pi]."""

import numpy as np

from rislam_rt.arrays import Floats, cross


def unit(vector: Floats) -> Floats:
    """Vectors (..., 3) divided by their length; a zero vector stays zero."""
    vector = np.asarray(vector, dtype=np.float64)
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    return vector / np.where(length > 0.0, length, 1.0)


def angles_from_direction(direction: Floats) -> tuple[Floats, Floats]:
    """Zenith and azimuth (...,) [rad] of directions (..., 3), which need not be unit vectors."""
    x, y, z = np.moveaxis(np.asarray(direction, dtype=np.float64), -1, 0)
    return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)


def wrap(angle: Floats) -> Floats:
    """Angles (...,) [rad] brought to (-pi, pi]."""
    return -((-np.asarray(angle, dtype=np.float64) + np.pi) % (2.0 * np.pi) - np.pi)


def angle_between(a: Floats, b: Floats) -> Floats:
    """Angle (...,) [rad] between directions (..., 3), exact for small angles too (atan2 of cross and dot)."""
    return np.arctan2(np.linalg.norm(cross(a, b), axis=-1), np.sum(np.asarray(a) * np.asarray(b), axis=-1))


def rotation_about(axis: Floats, angle: float) -> Floats:
    """Rotation matrix (3, 3) by an angle [rad] about an axis, a unit vector (3,) (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def rotation_z(heading: Floats) -> Floats:
    """Rotations (..., 3, 3) about z by headings (...,) [rad]: from the agent's body frame (x forward) to the room."""
    heading = np.asarray(heading, dtype=np.float64)
    rotation = np.zeros((*heading.shape, 3, 3))
    rotation[..., 0, 0] = rotation[..., 1, 1] = np.cos(heading)
    rotation[..., 1, 0] = np.sin(heading)
    rotation[..., 0, 1] = -rotation[..., 1, 0]
    rotation[..., 2, 2] = 1.0
    return rotation
