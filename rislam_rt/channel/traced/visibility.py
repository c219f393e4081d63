"""Visibility test by Sionna's image method: which candidates for legs exist in the meshes, and where they bounce.

`PathSolver` finds its candidates by shooting rays, for all pairs of sources and targets. Here the candidates are
given (`wall_sequences.py`), each row naming one far end, one device and one wall sequence, so that a whole trajectory
is one solve and no candidate depends on luck. The answer is the tracer's own: images in the meshes' planes, rays back
through the scene, occlusion, and the primitives hit.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import sionna.rt as rt
from sionna.rt.path_solvers import image_method
from sionna.rt.path_solvers.image_method import ImageMethod
from sionna.rt.path_solvers.paths_buffer import PathsBuffer
from sionna.rt.utils import spawn_ray_to

from rislam_rt.arrays import Floats, Integers, take_rows
from rislam_rt.channel.specular_legs import NO_WALL, turned_round
from rislam_rt.channel.traced.float32_limits import SEGMENT_LIMIT
from rislam_rt.channel.traced.tracer_scene import NO_OCCLUDER, TracerScene, as_indices, as_mask, as_points
from rislam_rt.channel.traced.wall_sequences import CandidateIndices


class SingleRays:
    """Proxy of a Mitsuba scene that casts every ray by itself, not in packets.

    The image method declares its rays coherent, and Embree then casts them in packets in which a ray that grazes the
    edge between two triangles hits or misses depending on its neighbours: a path came and went with its row's number.
    """

    def __init__(self, scene: Any) -> None:
        self._scene = scene

    def __getattr__(self, name: str) -> Any:
        return getattr(self._scene, name)

    def ray_intersect(self, *args: Any, **options: Any) -> Any:
        """Intersect rays with the scene for a visibility test like `mi.Scene.ray_intersect`, each ray by itself."""
        return self._scene.ray_intersect(*args, **{**options, "coherent": False})


def visible_rows(
    tracer_scene: TracerScene, sequences: Integers, far: Floats, device: Floats, rows: CandidateIndices,
    spared: int = NO_OCCLUDER,
) -> tuple[CandidateIndices, Floats]:  # fmt: skip
    """Candidates for legs that the tracer finds visible, and their bounce points (N, D, 3) [m] from device to far end.

    Parameters
    ----------
    sequences
        (S, D) from device to far end.
    far, device
        Positions (F, 3) and (N, 3) [m]. Rays run from the device back to the far end, which may lie on a face.
    spared
        Number of the scatterer at the far ends, if it has an occluding mesh: that does not hide its own centre from
        the last bounce, but does hide the bounces from each other.
    """
    if len(rows.far) == 0:
        return rows, np.zeros((0, sequences.shape[1], 3))
    candidates = sequences[rows.sequence]
    sources, targets = as_points(far - tracer_scene.origin), as_points(device - tracer_scene.origin)
    with _short_segments():
        traced = ImageMethod()(
            scene=SingleRays(tracer_scene.views[spared]), paths=fill_buffer(tracer_scene, candidates, rows),
            diffraction=False, diffraction_lit_region=False, src_positions=sources, tgt_positions=targets,
        )  # fmt: skip
    traced.schedule()  # one pass through the scene for all that is read below
    dr.eval()
    keep = _confirmed(tracer_scene, candidates, traced)
    rows, vertices = take_rows(rows, keep), read_vertices(tracer_scene, traced, keep, candidates[keep])
    if spared == NO_OCCLUDER:
        return rows, vertices
    clear = _clear_of_occluder(tracer_scene, spared, candidates[keep], device[rows.device], vertices)
    return take_rows(rows, clear), vertices[clear]


def _clear_of_occluder(
    tracer_scene: TracerScene, spared: int, sequences: Integers, device: Floats, vertices: Floats
) -> Integers:
    """Rows of legs that stay visible: the mesh of the scatterer at their end hides no segment but the last."""
    clear = np.ones(len(device), dtype=np.bool_)
    last = device
    for bounce, wall in enumerate(sequences.T):
        point = np.where((wall != NO_WALL)[:, None], vertices[:, bounce], last)
        ray = spawn_ray_to(as_points(last - tracer_scene.origin), as_points(point - tracer_scene.origin))
        clear &= ~np.array(tracer_scene.occluders[spared].ray_test(ray), dtype=np.bool_)
        last = point
    return np.flatnonzero(clear)


def _confirmed(tracer_scene: TracerScene, sequences: Integers, traced: PathsBuffer) -> Integers:
    """Rows of the candidates that the tracer's visibility test confirmed with every bounce on the wall asked for."""
    # The image method also accepts a hit on another wall in the same plane; that is another path's business. Where
    # walls lie on each other the ray meets any of them, and the one on top reflects.
    valid = np.array(traced.valid, dtype=np.bool_)
    wanted = turned_round(sequences)
    depth = wanted.shape[1]
    shape, primitive = (np.array(t, dtype=np.int64)[:, :depth] for t in (traced.shapes, traced.primitives))
    hit = tracer_scene.wall_hit(shape, primitive)
    met = (hit == wanted) | (wanted == NO_WALL)
    rows = np.flatnonzero(valid & tracer_scene.is_stacked(wanted).any(axis=1))
    if len(rows):
        points = turned_vertices(read_vertices(tracer_scene, traced, rows, sequences[rows]), sequences[rows])
        met[rows] |= tracer_scene.share_plane(hit[rows], wanted[rows])
        met[rows] &= tracer_scene.on_top(wanted[rows], points)
    return np.flatnonzero(valid & met.all(axis=1))


@contextmanager
def _short_segments() -> Iterator[None]:
    """Lower Sionna's limit on the length of segments to `SEGMENT_LIMIT` for a visibility test, in a `with` block."""
    own = image_method.MIN_SEGMENT_LENGTH
    image_method.MIN_SEGMENT_LENGTH = SEGMENT_LIMIT
    try:
        yield
    finally:
        image_method.MIN_SEGMENT_LENGTH = own


def fill_buffer(tracer_scene: TracerScene, sequences: Integers, rows: CandidateIndices) -> PathsBuffer:
    """Fill Sionna's path buffer with candidates to test their visibility, from far ends to devices over wall sequences
    (N, D), in reverse.

    Its vertices are any point of each wall's plane, which the image method needs, from the tracer scene's origin.
    """
    count, depth = sequences.shape
    buffer = PathsBuffer(count, max(depth, 1), False)  # at depth 0 the image method counts down from 0 without end
    walls = turned_round(sequences)
    for column, (wall, point) in enumerate(zip(walls.T, np.moveaxis(tracer_scene.corner[walls], 1, 0), strict=True)):
        real = wall != NO_WALL
        event = np.where(real, rt.InteractionType.SPECULAR, rt.InteractionType.NONE)
        at, here = dr.opaque(mi.UInt, column + 1, count), as_mask(real)
        buffer.set_interaction_type(at, as_indices(event), mi.Bool(True))
        buffer.set_shape(at, as_indices(tracer_scene.shape[wall]), here)
        buffer.set_primitive(at, as_indices(tracer_scene.primitive[wall]), here)
        buffer.set_vertex(at, as_points(point), here)
        buffer.set_prob(at, mi.Float(1.0), here)
    buffer._src_indices = as_indices(rows.far)
    buffer._tgt_indices = as_indices(rows.device)
    return buffer


def read_vertices(tracer_scene: TracerScene, buffer: PathsBuffer, keep: Integers, sequences: Integers) -> Floats:
    """Bounce points (N, D, 3) [m] of the visible paths `keep` from the tracer's buffer, from device to far end."""
    columns = [np.array(getattr(buffer, f"vertices_{axis}"), dtype=np.float64) for axis in "xyz"]
    return turned_vertices(np.stack(columns, axis=-1)[keep, : sequences.shape[1]] + tracer_scene.origin, sequences)


def turned_vertices(vertices: Floats, sequences: Integers) -> Floats:
    """Bounce points (N, D, 3) of visible paths, opposite to the tracer's buffer, zero where there is no wall."""
    index = (sequences != NO_WALL).sum(axis=1)[:, None] - 1 - np.arange(sequences.shape[1])
    turned = np.take_along_axis(vertices, np.maximum(index, 0)[..., None], axis=1)
    return np.where((index >= 0)[..., None], turned, 0.0)
