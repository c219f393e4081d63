"""Matching of estimated planes with a room's true walls, and ghost planes that stand for none."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, cross
from rislam_rt.evaluate.set_distances import match_nearest

NEAR_WALL = 0.5
"""Largest RMS distance [m], over a true wall's surface, of an estimated plane that can stand for the wall."""
NEAR_ANGLE = 10.0
"""Largest angle [deg] between a true wall and an estimated plane that can stand for it. Distance alone says nothing of
a small surface: a plane at right angles to it is near all of it. A plane of random direction is within this by chance
in 1 - cos 10 degrees = 1.5 % of cases, and none is within it of two walls that stand more than 20 degrees apart."""


class Surfaces(NamedTuple):
    """Surfaces of a room's W true walls, against which estimated planes are scored."""

    middle: Floats
    """Centroid (W, 3) [m] of each wall's surface."""
    normal: Floats
    """Unit normals (W, 3) of the walls."""
    spread: Floats
    """Covariance (W, 3, 3) [m^2] of the points of each wall's surface."""


def plane_distance(surfaces: Surfaces, normal: Floats, offset: Floats) -> Floats:
    """RMS distances (W, M) [m] of M planes `normal . x = offset`, (M, 3) and (M,), from the surfaces of W true
    walls.

    The mean square of a distance is the square of its mean, that at the middle, and its variance, `n^T spread n`.
    """
    level = surfaces.middle @ normal.T - offset
    variance = np.einsum("mi,wij,mj->wm", normal, surfaces.spread, normal)
    return np.asarray(np.sqrt(np.maximum(level**2 + variance, 0.0)))


def plane_angle(surfaces: Surfaces, normal: Floats) -> Floats:
    """Angles (W, M) [deg], 0 to 90, between W true walls and M planes of unit normals (M, 3)."""
    across = cross(surfaces.normal[:, None], normal[None])
    return np.asarray(np.degrees(np.arctan2(np.linalg.norm(across, axis=-1), np.abs(surfaces.normal @ normal.T))))


def match_planes(surfaces: Surfaces, normal: Floats, offset: Floats, heard: Booleans | None = None) -> Integers:
    """Row (W,) of the estimated plane that stands for each true wall `heard` (W,), one to one; -1 for none.

    A plane can stand for a wall within `NEAR_WALL` over its surface and `NEAR_ANGLE`; of all ways to pair them the one
    with the least sum of distances is taken.
    """
    match = np.full(len(surfaces.middle), -1)
    asked = np.arange(len(match)) if heard is None else np.flatnonzero(heard)
    if len(asked) and len(offset):
        distance, angle = plane_distance(surfaces, normal, offset), plane_angle(surfaces, normal)
        match[asked] = match_nearest(np.where(angle <= NEAR_ANGLE, distance, np.inf)[asked], NEAR_WALL)
    return match


def ghost_planes(surfaces: Surfaces, normal: Floats, offset: Floats) -> Booleans:
    """Whether each of M estimated planes is a ghost: it stands for no true wall, heard or not, one to one.

    A second plane for one wall is a ghost, as GOSPA counts a second point for one landmark as false.
    """
    ghosts = np.ones(len(offset), dtype=np.bool_)
    match = match_planes(surfaces, normal, offset)
    ghosts[match[match >= 0]] = False
    return ghosts
