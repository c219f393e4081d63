"""Scores of walls: which estimated plane stands for which, and how far off it is."""

from typing import Any

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.walls import Walls, build_walls
from rislam_rt.evaluate import match_nearest
from rislam_rt.model import MapEstimate, Scene
from rislam_rt.pipeline.scores.bound import SchemeBound

NEAR_WALL = 0.5
"""RMS distance [m] from a true wall, over its surface, beyond which an estimated plane is not held for it."""


def wall_scores(scene: Scene, estimate: MapEstimate, least: SchemeBound | None = None) -> dict[str, dict[str, Any]]:
    """Scores of each wall of the last map: RMS distance over its true surface, angle, offset; null if missing.

    With the deviation of the angle, both tilts together, that the map itself reckons with, and the bounds of angle and
    offset. A wall that no path meets cannot be found: it has no bound, and no plane stands for it.
    """
    walls = build_walls(scene)
    heard = None if least is None else np.array([name in least.walls for name in walls.names], dtype=np.bool_)
    match = match_walls(walls, estimate, heard)
    scores: dict[str, dict[str, Any]] = {}
    for number, name in enumerate(walls.names):
        row, bound = match[number], least.walls.get(name) if least else None
        bounds = {
            "bound_deg": float(np.degrees(bound.angle)) if bound else None,
            "bound_m": bound.distance if bound else None,
        }
        if row < 0:
            scores[name] = {"rmse_m": None, "angle_deg": None, "offset_m": None, "std_deg": None, **bounds}
            continue
        normal, offset = estimate.wall_normal[row], estimate.wall_offset[row]
        cosine = abs(float(normal @ walls.normal[number]))
        sine = float(np.linalg.norm(np.cross(normal, walls.normal[number])))
        middle, _ = walls.surface(number)
        scores[name] = {
            "rmse_m": surface_rms(walls, number, normal, offset),
            "angle_deg": float(np.degrees(np.arctan2(sine, cosine))),
            "offset_m": abs(float(normal @ middle - offset)),
            "std_deg": float(np.degrees(np.sqrt(2.0) * estimate.wall_std[row, 0])),
            **bounds,
        }
    return scores


def match_walls(walls: Walls, estimate: MapEstimate, heard: Booleans | None = None) -> Integers:
    """Row (W,) of the estimated plane that stands for each true wall that is `heard` (W,), -1 for none; one to one."""
    match = np.full(len(walls), -1)
    asked = np.arange(len(walls)) if heard is None else np.flatnonzero(heard)
    planes = list(zip(estimate.wall_normal, estimate.wall_offset, strict=True))
    if not planes or not len(asked):
        return match
    cost = np.array([[surface_rms(walls, int(w), n, float(d)) for n, d in planes] for w in asked])
    match[asked] = match_nearest(cost, NEAR_WALL)
    return match


def surface_rms(walls: Walls, number: int, normal: Floats, offset: float) -> float:
    """Score of a wall: RMS distance [m] of a plane from it, over its surface.

    The distance is linear in the point: over a triangle its mean square is (sum of squares + square of the sum) / 12.
    """
    _, weight = walls.surface(number)
    distance = walls.triangles[walls.wall_of_triangle == number] @ normal - offset
    square = (np.sum(distance**2, axis=1) + np.sum(distance, axis=1) ** 2) / 12.0
    return float(np.sqrt(weight @ square))
