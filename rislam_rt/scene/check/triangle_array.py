"""All triangles of a scene as one array, from which every part of the scene check works."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.triangles import triangle_heights
from rislam_rt.model import Scene
from rislam_rt.scene.findings import Finding, error_at, warning_at

MIN_CLEARANCE = 1e-3
"""Least distance [m] of a device or scatterer from a surface: a nearer one loses that surface's reflection."""
KEEP_AWAY = f"keep {MIN_CLEARANCE * 1e3:g} mm away from surfaces"
"""How to mend the place of a device or scatterer on a surface."""
MIN_ALTITUDE = 1e-6
"""Least height [m] of a triangle: one with a smaller height has no usable normal."""
START_KEY = "agent.start"
"""Key of the agent's start, as findings of the scene check name it, unless the scene file says it otherwise."""


class TriangleArray(NamedTuple):
    """All triangles of a scene's reflectors, the reflector that each belongs to, and their bounds."""

    file: str
    """Path of the scene file, for findings."""
    scene: Scene
    triangles: Floats
    """(T, 3, 3) [m]."""
    owner: Integers
    """(T,) number of the reflector of each triangle."""
    bounds: Floats
    """(2, 3) [m] lowest and highest corner."""
    start_key: str = START_KEY
    """Key of the scene file that says where the agent starts, for findings."""

    def error(self, field: str, message: str, mend: str) -> Finding:
        """Error of the scene check at a key of the scene file."""
        return error_at(self.file, field, message, mend)

    def warning(self, field: str, message: str, mend: str) -> Finding:
        """Warning of the scene check at a key of the scene file."""
        return warning_at(self.file, field, message, mend)

    def name(self, triangle: int | np.int64) -> str:
        """Name of the reflector that a triangle of the scene belongs to."""
        return self.scene.reflectors[self.owner[triangle]].name

    def outside(self, points: Floats) -> Integers:
        """Indices of those points (K, 3) that lie outside the bounds of a triangle array."""
        low, high = self.bounds
        return np.flatnonzero(((points < low) | (points > high)).any(axis=-1))

    @property
    def box(self) -> str:
        """Bounds of a scene's triangles in words."""
        low, high = np.round(self.bounds, 3).tolist()
        return f"{low} to {high}"


def build_triangle_array(scene: Scene, file: str, start_key: str = START_KEY) -> TriangleArray:
    """Collect the triangles of a scene that was read from `file` in one array for the scene check."""
    triangles = np.concatenate([r.triangles for r in scene.reflectors])
    owner = np.repeat(np.arange(len(scene.reflectors)), [len(r.faces) for r in scene.reflectors])
    corners = triangles.reshape(-1, 3)
    bounds = np.stack([corners.min(axis=0), corners.max(axis=0)])
    return TriangleArray(file, scene, triangles, owner, bounds, start_key)


def without_area(triangles: Floats) -> Booleans:
    """Whether (T,) triangles (T, 3, 3) of a scene are no more than a line, for the scene check."""
    return triangle_heights(triangles) <= MIN_ALTITUDE
