"""Specular legs by mirror images: mirror the far end in the walls, find the bounce points, test walls and occlusion."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, distinct_rows, join_rows, take_rows
from rislam_rt.channel.image_source.antennas import LegEnds
from rislam_rt.channel.image_source.fresnel import Coatings
from rislam_rt.channel.image_source.leg_candidates import SequenceSearch, candidate_rows
from rislam_rt.channel.image_source.wall_facets import SEAM, WallFacets
from rislam_rt.channel.specular_legs import SpecularLegs
from rislam_rt.constants import SURFACE_TOLERANCE
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.planes import mirror, mirror_direction


class ImageRays(NamedTuple):
    """N specular legs, one row each: cycle (N,), walls (N, d), bounces (N, d, 3) and far end's image (N, 3) [m]."""

    cycle: Integers
    walls: Integers
    bounces: Floats
    image: Floats


def find_legs(
    search: SequenceSearch, coatings: Coatings, device: Floats, far: Floats, depth: int, *, host: int = -1,
    front: Floats | None = None, landmark: int = -1, terminals: LegEnds | None = None,
) -> SpecularLegs:  # fmt: skip
    """Every specular leg of up to `depth` bounces from device positions (K, 3) to far ends (K, 3) or (1, 3) [m].

    Parameters
    ----------
    host
        Wall behind a panel at the far end: no bounce on it next to the panel, and it does not hide the panel.
    front
        (3,) normal of the panel at the far end, which only sees what lies before it.
    landmark
        Number of the landmark at the far end, which its own occluding mesh does not hide; -1 for none.
    terminals
        Antennas at both ends; None for isotropic and vertical ones.
    """
    facets = search.facets
    nothing = np.zeros((len(device), 0), dtype=np.int64)
    straight = np.zeros((len(device), 0, 3))
    found = {0: [ImageRays(np.arange(len(device)), nothing, straight, np.broadcast_to(far, device.shape))]}
    for cycle, walls in candidate_rows(search, device, far, depth, host):
        rays = _reflected_rays(facets, cycle, walls, device, far)
        found.setdefault(walls.shape[1], []).append(rays)
    blockers = facets.possible_blockers(np.concatenate([device, far]))
    joined = map(join_rows, found.values())
    visible = [_visible(facets, rays, device, far, blockers, host, front, landmark) for rays in joined]
    return _legs(facets, coatings, [rays for rays in visible if len(rays.cycle)], device, depth, terminals)


def _reflected_rays(facets: WallFacets, cycle: Integers, walls: Integers, device: Floats, far: Floats) -> ImageRays:
    """Legs of cycles (N,) over walls (N, d) whose bounce points all lie on their walls; occlusion is not tested."""
    images = [far[cycle if len(far) > 1 else np.zeros_like(cycle)]]
    for wall in walls.T[::-1]:
        images.insert(0, mirror(images[0], facets.normal[wall], facets.offset[wall]))
    bounces = np.zeros((*walls.shape, 3))
    row, point = np.arange(len(cycle)), device[cycle]
    for bounce in range(walls.shape[1]):
        wall, target = walls[row, bounce], images[bounce][row]
        last = bounce == walls.shape[1] - 1
        tolerance = (SURFACE_TOLERANCE if bounce == 0 else SEAM, SURFACE_TOLERANCE if last else SEAM)
        crosses, hit = _plane_crossing(point, target, facets.normal[wall], facets.offset[wall], tolerance)
        on_wall = facets.reflects(hit, wall[crosses])
        row, point = row[np.flatnonzero(crosses)[on_wall]], hit[on_wall]
        bounces[row, bounce] = point
    return ImageRays(cycle[row], walls[row], bounces[row], images[0][row])


def _plane_crossing(
    start: Floats, end: Floats, normal: Floats, offset: Floats, tolerance: tuple[float, float]
) -> tuple[Booleans, Floats]:
    """Which segments (N, 3) to mirror images cross their planes, ends farther than tolerances [m], and where (n, 3)."""
    a = np.einsum("ni,ni->n", start, normal) - offset
    b = np.einsum("ni,ni->n", end, normal) - offset
    crosses = (a * b < 0.0) & (np.abs(a) > tolerance[0]) & (np.abs(b) > tolerance[1])
    a, b = a[crosses], b[crosses]
    return crosses, start[crosses] + (a / (a - b))[:, None] * (end[crosses] - start[crosses])


def _visible(
    facets: WallFacets, rays: ImageRays, device: Floats, far: Floats, blockers: Integers, host: int,
    front: Floats | None, landmark: int,
) -> ImageRays:  # fmt: skip
    """Mirror images' legs that no wall or occluder hides and that reach a panel at the far end from its front."""
    count, bounces = rays.walls.shape
    target = np.broadcast_to(far, device.shape)[rays.cycle]
    points = np.concatenate([device[rays.cycle][:, None], rays.bounces, target[:, None]], axis=1)
    keep = np.ones(count, dtype=np.bool_)
    if front is not None:
        keep = (points[:, -2] - points[:, -1]) @ front > SURFACE_TOLERANCE
    for segment in range(bounces + 1):
        rows = np.flatnonzero(keep)
        spared = np.full(len(rows), host if segment == bounces else -1)
        blocker = facets.hidden_by(points[rows, segment], points[rows, segment + 1], blockers, spared)
        keep[rows[blocker >= 0]] = False
        rows = np.flatnonzero(keep)
        own = landmark if segment == bounces else -1
        keep[rows] = ~facets.occluders.hides(points[rows, segment], points[rows, segment + 1], own)
    return take_rows(rays, keep)


def _legs(
    facets: WallFacets, coatings: Coatings, found: list[ImageRays], device: Floats, depth: int,
    terminals: LegEnds | None,
) -> SpecularLegs:  # fmt: skip
    """Arrange the legs of mirror images by cycle and wall sequence (K, S), a column for each sequence that exists."""
    cycles = len(device)
    columns: list[Integers] = []
    parts: list[tuple[Integers, Integers, ImageRays]] = []
    for rays in found:
        first, column, _ = distinct_rows(rays.walls)
        unique = rays.walls[first]
        parts.append((rays.cycle, column + sum(len(c) for c in columns), rays))
        columns.append(np.pad(unique, ((0, 0), (0, depth - unique.shape[1])), constant_values=-1))
    walls = np.concatenate(columns) if columns else np.zeros((0, depth), dtype=np.int64)
    count = len(walls)
    valid = np.zeros((cycles, count), dtype=np.bool_)
    length = np.zeros((cycles, count))
    at_device, at_far_end = np.zeros((cycles, count, 3)), np.zeros((cycles, count, 3))
    coefficient = np.zeros((cycles, count), dtype=np.complex128)
    vertices = np.zeros((cycles, count, depth, 3))
    for cycle, column, rays in parts:
        place = cycle, column
        ray = rays.image - device[cycle]
        leaving, normals = unit(ray), facets.normal[rays.walls]
        valid[place] = True
        length[place] = np.linalg.norm(ray, axis=-1)
        at_device[place] = arriving = leaving
        for normal in normals.swapaxes(0, 1):
            arriving = mirror_direction(arriving, normal)
        at_far_end[place] = -arriving
        if terminals is None:
            coefficient[place] = coatings.coefficient(rays.walls, normals, leaving)
        else:
            coefficient[place] = terminals.coefficient(coatings, rays.walls, normals, leaving, cycle)
        vertices[cycle, column, : rays.walls.shape[1]] = rays.bounces
    return SpecularLegs(walls, valid, length, at_device, at_far_end, coefficient, vertices)
