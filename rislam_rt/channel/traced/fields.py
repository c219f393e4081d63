"""Sionna's field computation along given courses: what the radio materials do to the signal."""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from sionna.rt import antenna_pattern
from sionna.rt.path_solvers.field_calculator import FieldCalculator

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.channel.traced.antennas import Antennas
from rislam_rt.channel.traced.buffer import fill_buffer
from rislam_rt.channel.traced.course import Course, polyline
from rislam_rt.channel.traced.problem import Ends
from rislam_rt.channel.traced.rows import Rows
from rislam_rt.channel.traced.stage import Stage, as_points


def leg_coefficients(stage: Stage, sequences: Integers, ends: Ends, course: Course, antennas: Antennas) -> Complexes:
    """Field (N,) of legs over `sequences` (N, D), without spreading loss and carrier phase.

    Both ends have the same linear polarisation. Between isotropic antennas what is left is the reflection: exactly the
    product of R for walls of constant R, and the part of the Fresnel-reflected field in that polarisation for slabs.

    Every leg is computed about the middle of its own shortest segment: float32 coordinates of the whole room would
    leave a segment of a millimetre no direction, and Fresnel's coefficients with it.
    """
    if len(sequences) == 0:
        return np.zeros(0, dtype=np.complex128)
    points = polyline(sequences, ends.device, ends.far, course.vertices)
    origin = _middle_of_shortest(points)
    index = np.arange(len(sequences))
    buffer = fill_buffer(stage, sequences, Rows(index, index, index), course.vertices - origin[:, None])
    buffer.valid = dr.full(mi.Bool, True, len(sequences))
    turned = mi.Point3f(mi.Float(ends.heading.astype(np.float32)), 0.0, 0.0)
    devices, far_ends = _patterns(antennas)
    solved = FieldCalculator()(
        wavelength=stage.scene.wavelength,
        paths=buffer,
        samples_per_src=1,
        diffraction=False,
        src_positions=as_points(ends.far - origin),
        tgt_positions=as_points(ends.device - origin),
        src_orientations=turned,
        tgt_orientations=turned,
        src_antenna_patterns=far_ends,
        tgt_antenna_patterns=devices,
    )
    gains = np.empty((len(devices), len(far_ends), len(sequences)), dtype=np.complex128)
    for device, row in enumerate(solved.a):
        for far, gain in enumerate(row):
            gains.real[device, far], gains.imag[device, far] = np.array(gain.real), np.array(gain.imag)
    chosen = gains[ends.from_rx * (len(devices) - 1), ends.to_rx * (len(far_ends) - 1), index]
    return chosen * (4.0 * np.pi / stage.wavelength * course.length)


def _patterns(antennas: Antennas) -> tuple[list[Any], list[Any]]:
    """Sionna's patterns of the devices (Tx, Rx) and of the far ends (landmark, Rx), one of each where all are alike."""

    def pattern(name: str) -> Any:
        shape = getattr(antenna_pattern, f"v_{name}_pattern")
        kind = antenna_pattern.PolarizedAntennaPattern(v_pattern=shape, polarization=antennas.polarization)
        return kind.patterns[0]

    if antennas.isotropic:
        return [pattern("iso")], [pattern("iso")]
    return [pattern(antennas.tx), pattern(antennas.rx)], [pattern("iso"), pattern(antennas.rx)]


def _middle_of_shortest(points: Floats) -> Floats:
    """Middle (N, 3) of each polyline's (N, V, 3) shortest segment; repeated points at the end are no segment."""
    segment = np.linalg.norm(np.diff(points, axis=1), axis=-1)
    shortest = np.argmin(np.where(segment > 0.0, segment, np.inf), axis=1)
    row = np.arange(len(points))
    return 0.5 * (points[row, shortest] + points[row, shortest + 1])
