"""Both channels of a scene, ray-traced and image-source, run at the same random poses and compared."""

import zlib
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.channel.compare.comparison_report import PathReport
from rislam_rt.channel.compare.path_matching import compare_paths
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.image_source.wall_facets import WallFacets, build_facets
from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import SceneError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.model import Body, Paths, RadioConfig, RisCode, Scene, Trajectory


class Validation(NamedTuple):
    """Comparison of the ray-traced and the image-source channel in one room."""

    scene: str
    depth: int
    numbers: str
    """Precision of the traced paths: `traced` (the tracer's float32) or `refined` (float64)."""
    report: PathReport


def compare_channels(
    scene: Scene, radio: RadioConfig, *, poses: int, depth: int, rng: np.random.Generator, refine: bool = True
) -> PathReport:
    """Compare the ray-traced with the image-source channel path by path, at random poses and under one random code.

    By default the channel as its users get it, its numbers refined in float64 on the facets that the tracer named;
    without `refine` the tracer's own float32 numbers.
    """
    from rislam_rt.channel.traced.float32_limits import shortest_segment

    traced, analytic, trajectory = trace_both(scene, radio, poses=poses, depth=depth, rng=rng, refine=refine)
    return compare_paths(traced, analytic, scene, trajectory, radio=radio, shortest_segment=shortest_segment(scene))


def trace_both(
    scene: Scene, radio: RadioConfig, *, poses: int, depth: int, rng: np.random.Generator, refine: bool = True
) -> tuple[Paths, Paths, Trajectory]:
    """Ray-traced and image-source paths of a scene at random poses, under the same random panel code, and the poses."""
    from rislam_rt.channel.traced import TracedChannel  # starting the tracer takes seconds

    trajectory = random_poses(scene, poses, rng=rng)
    channels = TracedChannel(scene, radio, depth, refine=refine), ImageSourceChannel(scene, radio, depth)
    traced, analytic = (channel.paths(trajectory) for channel in channels)
    if scene.ris is not None:
        spec = scene.ris.spec
        code = RisCode(rng.integers(spec.levels, size=(spec.rows, spec.cols)), spec.levels)
        traced, analytic = channels[0].respond(traced, code), channels[1].respond(analytic, code)
    return traced, analytic, trajectory


def validate_rooms(
    rooms: Iterable[tuple[Scene, int]], radio: RadioConfig, *, poses: int, seed: int
) -> list[Validation]:
    """Compare ray-traced and image-source channel in several rooms, each with its depth, in float32 and refined.

    A room's poses depend on seed and name alone.
    """
    rows = []
    for scene, depth in rooms:
        for refine in (False, True):
            rng = room_rng(scene, seed)
            report = compare_channels(scene, radio, poses=poses, depth=depth, rng=rng, refine=refine)
            rows.append(Validation(scene.name, depth, "refined" if refine else "traced", report))
    return rows


def room_rng(scene: Scene, seed: int) -> np.random.Generator:
    """Random generator of a room's poses for comparison, from the seed and the room's name."""
    return np.random.default_rng([seed, zlib.crc32(scene.name.encode())])


_ROUNDS = 20


def random_poses(
    scene: Scene, count: int, *, rng: np.random.Generator, clearance: float = 0.1, baseline: float = 0.1
) -> Trajectory:
    """Draw `count` random poses for a comparison inside the room, the midpoint at least `clearance` [m] from every
    surface.

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
    """Trajectory to compare channels on: positions (K, 3) [m] at rest, one a second, random headings and baseline."""
    count = len(position)
    elevation = rng.uniform(np.radians(15.0), np.radians(60.0)) * rng.choice([-1.0, 1.0])
    offset = 0.5 * baseline * np.array([np.cos(elevation), 0.0, np.sin(elevation)])
    heading = rng.uniform(-np.pi, np.pi, count)
    return Trajectory(
        np.arange(count, dtype=np.float64), position, np.zeros((count, 3)), heading, Body(-offset, offset)
    )


def _reachable(facets: WallFacets, start: Floats, points: Floats) -> Booleans:
    """Which points (N, 3) [m] random poses can have: reachable from the start by straight lines that nothing blocks."""
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
