"""Sionna's field computation along given courses: what the radio materials do to the signal."""

import drjit as dr
import mitsuba as mi
import numpy as np
from sionna.rt.antenna_pattern import PolarizedAntennaPattern, v_iso_pattern
from sionna.rt.path_solvers.field_calculator import FieldCalculator

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.channel.traced.buffer import fill_buffer
from rislam_rt.channel.traced.course import Course, polyline
from rislam_rt.channel.traced.rows import Rows
from rislam_rt.channel.traced.stage import Stage, as_points


def leg_coefficients(stage: Stage, sequences: Integers, device: Floats, far: Floats, course: Course) -> Complexes:
    """Field (N,) of legs over `sequences` (N, D), without spreading loss and carrier phase.

    Both ends are isotropic and vertically polarised (Sionna's `iso`, `V`): what is left is the reflection, exactly the
    product of R for walls of constant R, and the vertical part of the Fresnel-reflected field for slabs.

    Every leg is computed about the middle of its own shortest segment: float32 coordinates of the whole room would
    leave a segment of a millimetre no direction, and Fresnel's coefficients with it.
    """
    if len(sequences) == 0:
        return np.zeros(0, dtype=np.complex128)
    points = polyline(sequences, device, far, course.vertices)
    origin = _middle_of_shortest(points)
    index = np.arange(len(sequences))
    buffer = fill_buffer(stage, sequences, Rows(index, index, index), course.vertices - origin[:, None])
    buffer.valid = dr.full(mi.Bool, True, len(sequences))
    unturned = dr.zeros(mi.Point3f, len(sequences))
    patterns = PolarizedAntennaPattern(v_pattern=v_iso_pattern, polarization="V").patterns
    solved = FieldCalculator()(
        wavelength=stage.scene.wavelength,
        paths=buffer,
        samples_per_src=1,
        diffraction=False,
        src_positions=as_points(far - origin),
        tgt_positions=as_points(device - origin),
        src_orientations=unturned,
        tgt_orientations=unturned,
        src_antenna_patterns=patterns,
        tgt_antenna_patterns=patterns,
    )
    coefficient = np.empty(len(sequences), dtype=np.complex128)
    coefficient.real, coefficient.imag = np.array(solved.a[0][0].real), np.array(solved.a[0][0].imag)
    return coefficient * (4.0 * np.pi / stage.wavelength * course.length)


def _middle_of_shortest(points: Floats) -> Floats:
    """Middle (N, 3) of each polyline's (N, V, 3) shortest segment; repeated points at the end are no segment."""
    segment = np.linalg.norm(np.diff(points, axis=1), axis=-1)
    shortest = np.argmin(np.where(segment > 0.0, segment, np.inf), axis=1)
    row = np.arange(len(points))
    return 0.5 * (points[row, shortest] + points[row, shortest + 1])
