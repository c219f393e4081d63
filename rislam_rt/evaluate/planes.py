"""Which estimated plane stands for which true wall, and which stands for none: the one criterion of all scores."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.evaluate.set_distances import match_nearest

NEAR_WALL = 0.5
"""RMS distance [m] from a true wall, over its surface, beyond which an estimated plane is not held for it."""
NEAR_ANGLE = 10.0
"""Angle [deg] from a true wall beyond which it is not either. Distance alone says nothing of a small surface: a plane
at right angles to it is near all of it. A plane of random direction is within this by chance in 1 - cos 10 degrees =
1.5 % of cases, and none is within it of two walls that stand more than 20 degrees apart."""


class Surfaces(NamedTuple):
    """W true walls."""

    middle: Floats
    """(W, 3) [m] centroid of each wall's surface."""
    normal: Floats
    """(W, 3) unit normals."""
    spread: Floats
    """(W, 3, 3) [m^2] covariance of the points of its surface."""


def plane_distance(surfaces: Surfaces, normal: Floats, offset: Floats) -> Floats:
    """Score (W, M): RMS distance [m] of planes `normal . x = offset`, (M, 3) and (M,), from walls, over their surface.

    The mean square of a distance is the square of its mean, that at the middle, and its variance, `n^T spread n`.
    """
    level = surfaces.middle @ normal.T - offset
    variance = np.einsum("mi,wij,mj->wm", normal, surfaces.spread, normal)
    return np.asarray(np.sqrt(np.maximum(level**2 + variance, 0.0)))


def plane_angle(surfaces: Surfaces, normal: Floats) -> Floats:
    """Score (W, M): angle [deg], 0 to 90, between walls and planes of unit normals (M, 3)."""
    across = np.cross(surfaces.normal[:, None], normal[None])
    return np.asarray(np.degrees(np.arctan2(np.linalg.norm(across, axis=-1), np.abs(surfaces.normal @ normal.T))))


def match_planes(surfaces: Surfaces, normal: Floats, offset: Floats, heard: Booleans | None = None) -> Integers:
    """Row (W,) of the plane, of M, that stands for each true wall that is `heard` (W,), -1 for none; one to one.

    A plane can stand for a wall within `NEAR_WALL` over its surface and `NEAR_ANGLE`; of all ways to pair them the one
    with the least sum of distances is taken.
    """
    match = np.full(len(surfaces.middle), -1)
    asked = np.arange(len(match)) if heard is None else np.flatnonzero(heard)
    if len(asked) and len(offset):
        match[asked] = match_nearest(_allowed_distance(surfaces, normal, offset)[asked], NEAR_WALL)
    return match


def ghost_planes(surfaces: Surfaces, normal: Floats, offset: Floats) -> Booleans:
    """Which planes (M,) stand for no true wall, heard or not, one to one: ghosts of a map, for its score.

    A second plane for one wall is a ghost, as GOSPA counts a second point for one landmark as false.
    """
    ghosts = np.ones(len(offset), dtype=np.bool_)
    match = match_planes(surfaces, normal, offset)
    ghosts[match[match >= 0]] = False
    return ghosts


def _allowed_distance(surfaces: Surfaces, normal: Floats, offset: Floats) -> Floats:
    """Score (W, M): RMS distance [m], infinite where the angle forbids the pair."""
    distance, angle = plane_distance(surfaces, normal, offset), plane_angle(surfaces, normal)
    return np.where(angle <= NEAR_ANGLE, distance, np.inf)
