"""Data of a room for the interactive views: walls as triangles and outlines, panels, scatterers, trajectory."""

from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.walls import build_walls
from rislam_rt.geometry.triangles import outline_edges, triangle_areas, triangle_cross
from rislam_rt.model import RisPanel, Scene

MOST_TRIANGLES = 8000
"""Largest number of triangles in a view: walls with the largest surface come first, the rest is left out."""
MOST_NAMES = 60
"""Largest number of wall names in a view."""
WAY_POINTS = 600
"""Largest number of points of the trajectory in a view."""
DIGITS = 3
"""Decimals of coordinates [m] in a view."""


def room_data(scene: Scene) -> dict[str, Any]:
    """Data of a scene's static parts for the interactive views: walls, occluders, panels, scatterers, trajectory."""
    way = scene.agent.position
    walls, left_out = _walls(scene)
    meshes = [*scene.occluders, *(s.shade for s in scene.scatterers if s.shade is not None)]
    occluders = np.concatenate([np.zeros((0, 3, 3)), *(mesh.triangles for mesh in meshes)])
    return {
        "bounds": rounded(scene.bounds), "walls": walls, "left_out": left_out,
        "shades": rounded(occluders[:MOST_TRIANGLES]), "panels": [_panel(panel) for panel in scene.panels],
        "scatterers": [{"name": s.name, "position": rounded(s.position)} for s in scene.scatterers],
        "track": rounded(way[spread(len(way), WAY_POINTS)]),
    }  # fmt: skip


def spread(count: int, most: int) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
    """Indices of what a view shows, spread evenly over `count` entries, at most `most`, with the first and the last."""
    return np.unique(np.linspace(0, max(count - 1, 0), min(count, most)).round().astype(np.int64))


def rounded(points: Floats, digits: int = DIGITS) -> Any:
    """Nested lists of numbers rounded to `digits` decimals, for a view."""
    return (np.round(points, digits) + 0.0).tolist()


def _walls(scene: Scene) -> tuple[list[dict[str, Any]], int]:
    """Data of a room's largest walls for a view, and the number of walls left out."""
    walls = build_walls(scene)
    corners = walls.triangles
    area = triangle_areas(corners)
    of_wall = np.bincount(walls.wall_of_triangle, weights=area, minlength=len(walls))
    order = np.argsort(-of_wall, kind="stable")
    counts = np.bincount(walls.wall_of_triangle, minlength=len(walls))
    shown = order[np.cumsum(counts[order]) <= MOST_TRIANGLES]
    named: set[str] = set()
    found = []
    for wall in shown:
        own = corners[walls.wall_of_triangle == wall]
        clockwise = triangle_cross(own) @ walls.normal[wall] < 0.0
        turned = np.where(clockwise[:, None, None], own[:, ::-1], own)
        reflector = walls.names[wall].partition("#")[0]
        label = reflector if reflector not in named and len(named) < MOST_NAMES else ""
        named.add(reflector)
        found.append(
            {
                "name": walls.names[wall], "label": label, "normal": rounded(walls.normal[wall], 5),
                "offset": round(float(walls.offset[wall]), 5),
                "center": rounded(np.average(own.mean(axis=1), axis=0, weights=area[walls.wall_of_triangle == wall])),
                "triangles": rounded(turned), "edges": rounded(outline_edges(own)),
            }
        )  # fmt: skip
    return found, len(order) - len(shown)


def _panel(panel: RisPanel) -> dict[str, Any]:
    """Data of a RIS panel for a view: name, centre, corners."""
    spec = panel.spec
    across = 0.5 * spec.cols * spec.spacing[0] * spec.right
    along = 0.5 * spec.rows * spec.spacing[1] * spec.up
    corners = panel.center + np.array([-across - along, across - along, across + along, along - across])
    return {"name": panel.name, "center": rounded(panel.center), "corners": rounded(corners)}
