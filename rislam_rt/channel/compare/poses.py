"""Random poses for comparing channels: inside the room, off every surface, baseline in no special direction."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.channel.image_source.facets import WallFacets, build_facets
from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import SceneError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.model import Body, Scene, Trajectory

_ROUNDS = 20


def random_poses(
    scene: Scene, count: int, *, rng: np.random.Generator, clearance: float = 0.1, baseline: float = 0.1
) -> Trajectory:
    """Draw `count` random poses inside the room, the midpoint at least `clearance` [m] from every surface.

    Inside means reachable from the scene's start by a chain of free straight lines between poses, so that the
    insides of closed objects are left out and rooms of any shape are covered. The baseline [m] has one random
    elevation for all poses (it belongs to the body) and a random azimuth for each.

    Raises
    ------
    SceneError
        Too little of the room's bounding box is free.
    """
    facets = build_facets(build_walls(scene))
    surfaces = np.concatenate([facets.corners, facets.occluders.triangles])
    free = np.zeros((0, 3))
    for _ in range(_ROUNDS):
        batch = rng.uniform(scene.bounds[0], scene.bounds[1], size=(2 * count + 64, 3))
        free = np.concatenate([free, batch[distance_to_triangles(batch, surfaces) >= clearance]])
        inside = free[_reachable(facets, scene.agent.position[0], free)]
        if len(inside) >= count:
            return _as_trajectory(inside[:count], baseline, rng)
    raise SceneError(
        f"{scene.name}: {count} poses {clearance} m off every surface asked for, {len(inside)} found; ask for fewer"
    )


def _as_trajectory(position: Floats, baseline: float, rng: np.random.Generator) -> Trajectory:
    """Trajectory of positions (K, 3) [m] at rest, one a second, with random headings and a random baseline."""
    count = len(position)
    elevation = rng.uniform(np.radians(15.0), np.radians(60.0)) * rng.choice([-1.0, 1.0])
    offset = 0.5 * baseline * np.array([np.cos(elevation), 0.0, np.sin(elevation)])
    heading = rng.uniform(-np.pi, np.pi, count)
    return Trajectory(
        np.arange(count, dtype=np.float64), position, np.zeros((count, 3)), heading, Body(-offset, offset)
    )


def _reachable(facets: WallFacets, start: Floats, points: Floats) -> Booleans:
    """Which points (N, 3) [m] are reachable from the start by straight lines that nothing blocks, over other points."""
    reached = np.zeros(len(points), dtype=np.bool_)
    walls = facets.possible_blockers(np.concatenate([start[None], points]))
    stations = [start]
    while stations and not reached.all():
        station = stations.pop()
        rows = np.flatnonzero(~reached)
        origin = np.broadcast_to(station, (len(rows), 3))
        walled = facets.hidden_by(origin, points[rows], walls, np.full(len(rows), -1)) >= 0
        free = rows[~walled & ~facets.occluders.hides(origin, points[rows])]
        reached[free] = True
        stations += list(points[free])
    return reached
