"""Sionna's image method and field computation on chosen wall sequences: one source and one target a row.

`PathSolver` finds its candidates by shooting rays, for all pairs of sources and targets. Here the candidates are
given (`sequences.py`), each row naming one far end, one device and one wall sequence, so that a whole trajectory is
one solve and no candidate depends on luck. Everything else is the tracer's own: the images in its meshes, the rays
back through the scene with occlusion and the primitives hit, and the field over the walls' radio materials.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import drjit as dr
import mitsuba as mi
import numpy as np
import sionna.rt as rt
from sionna.rt.antenna_pattern import PolarizedAntennaPattern, v_iso_pattern
from sionna.rt.path_solvers import image_method
from sionna.rt.path_solvers.field_calculator import FieldCalculator
from sionna.rt.path_solvers.image_method import ImageMethod
from sionna.rt.path_solvers.paths_buffer import PathsBuffer

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.channel.traced.rows import Found, Rows
from rislam_rt.channel.traced.sequences import NO_WALL, turned_round
from rislam_rt.channel.traced.stage import Stage
from rislam_rt.constants import SPEED_OF_LIGHT

SHORTEST_SEGMENT = 1e-5
"""[m] Segments below this are dropped. Sionna's own 1 cm loses double bounces near a corner; below a tenth of a
millimetre its ray offsets (6e-6 of the coordinates) take over."""


def trace_rows(stage: Stage, walls: Integers, far: Floats, device: Floats, rows: Rows) -> Found:
    """Trace candidates: wall sequences `walls` (S, D), from device to far end, padded.

    Parameters
    ----------
    far, device
        Positions (F, 3) and (N, 3) [m]; legs are traced back from the device to the far end, which may lie on a face.
    """
    sources, targets = _points(far), _points(device)
    candidates = _buffer(stage, walls[rows.sequence], rows)
    with _short_segments():
        traced = ImageMethod()(
            scene=stage.scene.mi_scene, paths=candidates, diffraction=False, diffraction_lit_region=False,
            src_positions=sources, tgt_positions=targets,
        )  # fmt: skip
    keep = _confirmed(stage, walls[rows.sequence], traced)
    rows = rows.only(keep)
    sequences = walls[rows.sequence]
    vertices = np.stack([_table(getattr(traced, f"vertices_{axis}"), np.float64)[keep] for axis in "xyz"], axis=-1)
    if not len(keep):
        return Found(rows, vertices, np.zeros(0), np.zeros(0, dtype=np.complex128))
    length, coefficient = _fields(stage, sequences, rows, vertices, sources, targets)
    return Found(rows, _from_device(vertices, sequences), length, coefficient)


def _buffer(stage: Stage, walls: Integers, rows: Rows, vertices: Floats | None = None) -> PathsBuffer:
    """A path buffer whose row i runs from far end over `walls[i]` (N, D), backwards, to the device.

    Without vertices, any point of each wall's plane serves the image method.
    """
    count, depth = walls.shape
    buffer = PathsBuffer(count, depth, False)
    backwards = turned_round(walls)
    real = backwards != NO_WALL
    points = stage.corner[np.where(real, backwards, 0)] if vertices is None else vertices
    everywhere = mi.Bool(True)
    for column in range(depth):
        wall, here = np.where(real[:, column], backwards[:, column], 0), mi.Bool(real[:, column])
        at = dr.full(mi.UInt, column + 1, count)
        specular = np.where(real[:, column], rt.InteractionType.SPECULAR, rt.InteractionType.NONE)
        buffer.set_interaction_type(at, mi.UInt(specular.astype(np.uint32)), everywhere)
        buffer.set_shape(at, mi.UInt(stage.shape[wall].astype(np.uint32)), here)
        buffer.set_primitive(at, mi.UInt(stage.primitive[wall].astype(np.uint32)), here)
        buffer.set_vertex(at, _points(points[:, column]), here)
        buffer.set_prob(at, mi.Float(1.0), everywhere)
    buffer._src_indices = mi.UInt(rows.far.astype(np.uint32))
    buffer._tgt_indices = mi.UInt(rows.device.astype(np.uint32))
    return buffer


def _confirmed(stage: Stage, walls: Integers, traced: PathsBuffer) -> Integers:
    """Rows that the tracer found visible with every bounce on the wall asked for.

    The image method also accepts a hit on another wall in the same plane; that is another path's business.
    """
    valid = np.array(traced.valid, dtype=np.bool_)
    hit = stage.wall_hit(_table(traced.shapes, np.int64), _table(traced.primitives, np.int64))
    wanted = turned_round(walls)
    return np.flatnonzero(valid & ((hit == wanted) | (wanted == NO_WALL)).all(axis=1))


def _fields(
    stage: Stage, walls: Integers, rows: Rows, vertices: Floats, sources: mi.Point3f, targets: mi.Point3f
) -> tuple[Floats, Complexes]:
    """Length [m] and coefficient of traced paths, between vertically polarised isotropic antennas."""
    buffer = _buffer(stage, walls, rows, vertices)
    buffer.valid = dr.full(mi.Bool, True, len(walls))
    no_turn = [dr.zeros(mi.Point3f, dr.width(points)) for points in (sources, targets)]
    patterns = PolarizedAntennaPattern(v_pattern=v_iso_pattern, polarization="V").patterns
    wavelength = float(stage.scene.wavelength[0])
    solved = FieldCalculator()(
        wavelength=stage.scene.wavelength, paths=buffer, samples_per_src=1, diffraction=False,
        src_positions=sources, tgt_positions=targets, src_orientations=no_turn[0], tgt_orientations=no_turn[1],
        src_antenna_patterns=patterns, tgt_antenna_patterns=patterns,
    )  # fmt: skip
    length = np.array(solved.tau, dtype=np.float64) * SPEED_OF_LIGHT
    coefficient = np.empty(len(length), dtype=np.complex128)
    coefficient.real, coefficient.imag = np.array(solved.a[0][0].real), np.array(solved.a[0][0].imag)
    return length, coefficient * (4.0 * np.pi / wavelength) * length


@contextmanager
def _short_segments() -> Iterator[None]:
    """Let the image method keep short segments while this lasts."""
    own = image_method.MIN_SEGMENT_LENGTH
    image_method.MIN_SEGMENT_LENGTH = SHORTEST_SEGMENT
    try:
        yield
    finally:
        image_method.MIN_SEGMENT_LENGTH = own


def _points(points: Floats) -> mi.Point3f:
    """Positions (N, 3) on the device."""
    return mi.Point3f(*(mi.Float(np.ascontiguousarray(column, dtype=np.float32)) for column in points.T))


def _table(tensor: mi.TensorXf, dtype: type) -> np.ndarray:
    """A buffer's tensor (N, D) as an array."""
    return np.array(tensor, dtype=dtype)


def _from_device(vertices: Floats, sequences: Integers) -> Floats:
    """Bounce points (N, D, 3) turned round, zero where the sequences (N, D) have no wall."""
    index = (sequences != NO_WALL).sum(axis=1)[:, None] - 1 - np.arange(sequences.shape[1])
    turned = np.take_along_axis(vertices, np.maximum(index, 0)[..., None], axis=1)
    return np.where((index >= 0)[..., None], turned, 0.0)
