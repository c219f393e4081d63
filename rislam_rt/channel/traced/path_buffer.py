"""Sionna's path buffer, filled with candidates for legs: row i names its own source, target and wall sequence."""

import drjit as dr
import mitsuba as mi
import numpy as np
import sionna.rt as rt
from sionna.rt.path_solvers.paths_buffer import PathsBuffer

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.traced.candidate_indices import CandidateIndices
from rislam_rt.channel.traced.sequences import NO_WALL, turned_round
from rislam_rt.channel.traced.tracer_scene import TracerScene, as_points


def fill_buffer(tracer_scene: TracerScene, sequences: Integers, rows: CandidateIndices) -> PathsBuffer:
    """Fill Sionna's path buffer with candidates, from far ends (sources) to devices (targets) over wall sequences (N,
    D), in reverse.

    Its vertices are any point of each wall's plane, which the image method needs, from the tracer scene's origin.
    """
    count, depth = sequences.shape
    buffer = PathsBuffer(count, max(depth, 1), False)  # at depth 0 the image method counts down from 0 without end
    walls = turned_round(sequences)
    for column, (wall, point) in enumerate(zip(walls.T, np.moveaxis(tracer_scene.corner[walls], 1, 0), strict=True)):
        real = wall != NO_WALL
        event = np.where(real, rt.InteractionType.SPECULAR, rt.InteractionType.NONE)
        at, here = dr.full(mi.UInt, column + 1, count), mi.Bool(real)
        buffer.set_interaction_type(at, as_indices(event), mi.Bool(True))
        buffer.set_shape(at, as_indices(tracer_scene.shape[wall]), here)
        buffer.set_primitive(at, as_indices(tracer_scene.primitive[wall]), here)
        buffer.set_vertex(at, as_points(point), here)
        buffer.set_prob(at, mi.Float(1.0), here)
    buffer._src_indices = as_indices(rows.far)
    buffer._tgt_indices = as_indices(rows.device)
    return buffer


def read_vertices(tracer_scene: TracerScene, buffer: PathsBuffer, keep: Integers, sequences: Integers) -> Floats:
    """Bounce points (N, D, 3) [m] read from the tracer's buffer for the paths `keep`, from device to far end."""
    columns = [np.array(getattr(buffer, f"vertices_{axis}"), dtype=np.float64) for axis in "xyz"]
    return turned_vertices(np.stack(columns, axis=-1)[keep, : sequences.shape[1]] + tracer_scene.origin, sequences)


def as_indices(values: Integers) -> mi.UInt:
    """Convert numbers (N,) to unsigned integers of the tracer's backend."""
    return mi.UInt(np.ascontiguousarray(values, dtype=np.uint32))


def turned_vertices(vertices: Floats, sequences: Integers) -> Floats:
    """Bounce points (N, D, 3) of the tracer's buffer in opposite order, zero where there is no wall."""
    index = (sequences != NO_WALL).sum(axis=1)[:, None] - 1 - np.arange(sequences.shape[1])
    turned = np.take_along_axis(vertices, np.maximum(index, 0)[..., None], axis=1)
    return np.where((index >= 0)[..., None], turned, 0.0)
