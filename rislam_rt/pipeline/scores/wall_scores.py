"""Scores of walls: matches estimated planes with true walls, and measures their distance and angle."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.walls import Walls, build_walls
from rislam_rt.constants import COPLANAR_ANGLE, COPLANAR_OFFSET
from rislam_rt.evaluate import Surfaces, ghost_planes, match_planes, plane_angle, plane_distance
from rislam_rt.model import MapEstimate, Paths, Scene
from rislam_rt.pipeline.scores.audible_paths import HEARD, audible_planes, audible_seconds
from rislam_rt.pipeline.scores.posterior_bound import SchemeBound


def wall_scores(
    scene: Scene, estimate: MapEstimate, least: SchemeBound | None = None, audible_s: Floats | None = None
) -> dict[str, dict[str, Any]]:
    """Scores of each true wall against the last map: RMS distance over its surface, angle, offset; null if missing.

    Besides, the map's own standard deviation of the angle (both tilts together), and the bounds of angle and offset.
    A wall that reflects no path cannot be found: it has no bound, and no plane is matched with it. Coplanar walls are
    one: the plane matched with one of them is matched with all that reflect a path, and `plane` is the number that they
    share. `audible_s` (W,) [s] is how long in all a path over the wall's plane was above the detection threshold.
    """
    walls = build_walls(scene)
    group, alone = coplanar(walls), wall_surfaces(walls, np.arange(len(walls)))
    heard = np.array([least is None or name in least.walls for name in walls.names], dtype=np.bool_)
    asked = np.bincount(group, weights=heard) > 0
    match = match_planes(wall_surfaces(walls, group), estimate.wall_normal, estimate.wall_offset, asked)[group]
    errors = {
        "rmse_m": plane_distance(alone, estimate.wall_normal, estimate.wall_offset),
        "angle_deg": plane_angle(alone, estimate.wall_normal),
        "offset_m": np.abs(alone.middle @ estimate.wall_normal.T - estimate.wall_offset),
    }
    scores: dict[str, dict[str, Any]] = {}
    for number, name in enumerate(walls.names):
        row, bound = match[number] if heard[number] else -1, least.walls.get(name) if least else None
        scores[name] = {
            **{key: float(error[number, row]) if row >= 0 else None for key, error in errors.items()},
            "std_deg": float(np.degrees(np.sqrt(2.0) * estimate.wall_std[row, 0])) if row >= 0 else None,
            "bound_deg": float(np.degrees(bound.angle)) if bound else None,
            "bound_m": bound.distance if bound else None,
            "audible_s": None if audible_s is None else float(audible_s[number]),
            "plane": int(group[number]),
        }
    return scores


class PlaneScore(NamedTuple):
    """Score of the walls in one plane, which are one."""

    names: list[str]
    """Names of the walls, in the order of the scene."""
    wall: Mapping[str, Any]
    """Scores of the first of them that was found, or of the first."""
    heard: bool | None
    """Whether a path over the plane was audible for `HEARD` seconds, so that it counts as one to be found; None in runs
    in slices, which do not ask for that."""

    @property
    def found(self) -> bool:
        """Whether the scheme's last map has the plane."""
        return self.wall["rmse_m"] is not None


def plane_scores(walls: Mapping[str, Mapping[str, Any]]) -> list[PlaneScore]:
    """Scores of walls by name, plane by plane, in the order of the scene: what `score_run` counts as one wall."""
    planes: dict[int, list[str]] = {}
    for name, wall in walls.items():
        planes.setdefault(wall["plane"], []).append(name)
    scores = []
    for names in planes.values():
        best = next((walls[name] for name in names if walls[name]["rmse_m"] is not None), walls[names[0]])
        seconds = best["audible_s"]
        scores.append(PlaneScore(names, best, None if seconds is None else bool(seconds >= HEARD - 1e-9)))
    return scores


def found_walls(walls: Mapping[str, Mapping[str, Any]]) -> dict[str, int | None]:
    """Score of a scheme's walls, those in one plane as one: how many were heard (None where that is not known), and how
    many of these it found."""
    planes = plane_scores(walls)
    asked = all(plane.heard is not None for plane in planes)
    return {
        "walls_found": sum(plane.found and plane.heard is not False for plane in planes),
        "walls_heard": sum(bool(plane.heard) for plane in planes) if asked else None,
    }


def found_of_heard(walls: Mapping[str, Mapping[str, Any]]) -> str:
    """Score of a scheme's walls in words: how many it found of those heard, `7 of 9`; `7` where that is not known."""
    found, heard = found_walls(walls).values()
    return f"{found}" if heard is None else f"{found} of {heard}"


def seconds_audible(scene: Scene, paths: Paths, audible: Booleans) -> Floats:
    """Total time (W,) [s] for which an `audible` path (K, P) went over each wall's plane, for its score."""
    group = coplanar(build_walls(scene))
    return audible_seconds(audible_planes(paths, audible, group), scene.agent.time)[group]


def count_ghosts(scene: Scene, estimate: MapEstimate) -> int:
    """Number of ghost walls: estimated planes of a map that match no true wall."""
    walls = build_walls(scene)
    surfaces = wall_surfaces(walls, coplanar(walls))
    return int(ghost_planes(surfaces, estimate.wall_normal, estimate.wall_offset).sum())


def coplanar(walls: Walls) -> Integers:
    """Number of the plane of each true wall (W,) for its score, from 0; coplanar walls, which no agent can tell apart,
    have one."""
    group = np.full(len(walls), -1)
    while (group < 0).any():
        wall = int(np.argmax(group < 0))
        cosine = walls.normal @ walls.normal[wall]
        same = (np.abs(cosine) >= np.cos(COPLANAR_ANGLE)) & (group < 0)
        same &= np.abs(walls.offset * np.sign(cosine) - walls.offset[wall]) <= COPLANAR_OFFSET
        same[wall] = True
        group[same] = group.max() + 1
    return group


def wall_surfaces(walls: Walls, group: Integers) -> Surfaces:
    """Middle, normal and second moments of the surface of each group of true walls, to score; `group` (W,) numbers from
    0.

    Over a triangle the mean of x x^T is (sum of v v^T + s s^T) / 12, with its corners v and their sum s.
    """
    count = int(group.max(initial=-1)) + 1
    middle, normal, spread = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 3, 3))
    merged = replace(walls, wall_of_triangle=group[walls.wall_of_triangle])
    for number in range(count):
        normal[number] = walls.normal[int(np.argmax(group == number))]
        middle[number], weight = merged.surface(number)
        corner: Any = walls.triangles[merged.wall_of_triangle == number] - middle[number]
        total = corner.sum(axis=1)
        square = np.einsum("tci,tcj->tij", corner, corner) + np.einsum("ti,tj->tij", total, total)
        spread[number] = np.einsum("t,tij->ij", weight, square) / 12.0
    return Surfaces(middle, normal, spread)
