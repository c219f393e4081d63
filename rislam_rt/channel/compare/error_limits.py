"""Error limits between ray-traced and image-source paths, path by path: what rounding in float32 or float64 explains.

Rounding is half a unit in the last place, `u = 2^-24` in float32, of the numbers rounded: coordinates up to the room's
extent E about the tracer's zero, and up to E + L for the images of a leg of length L. With b bounces one end of the
leg, seen from the other, is displaced by at most

    delta = 2 u (E + L) + b STEPS u (E + L) + sum over its walls of 2 a (1 + 2 (E + L) / h),

`a = u E + flatness` being how far a wall's mesh may lie off its plane, and h the altitude of its largest triangle,
whose tilt the mirror image magnifies. The tracer's rays besides start and end `RAY_OFFSET` (1 m + E + L) off their
surfaces: that moves bounces along their walls, so that directions suffer as from delta, but lengths only to the second
order. From the two follow limits of length, directions, phase and the part of the gain that they decide; what the
tracer's float32 materials add to the gain is the same for both kinds of numbers.
"""

from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, cross
from rislam_rt.channel.cross_section import cross_section
from rislam_rt.channel.walls import build_walls
from rislam_rt.constants import RAY_OFFSET
from rislam_rt.geometry.angles import unit
from rislam_rt.model import Material, Paths, RadioConfig, Scene, Trajectory
from rislam_rt.model.slab import slab_coefficients, slab_permittivity

SINGLE, DOUBLE = 2.0**-24, 2.0**-53
"""Unit roundoff of float32 and float64."""
STEPS = 8.0
"""Number of roundings of a coordinate at a bounce: the image (distance from the plane, product, difference), the ray
towards it (difference, normalisation) and its hit (distance, product, sum)."""
FIELD_STEPS = 4.0
"""Number of roundings of a field at a bounce or an antenna: coefficient, its real and its imaginary part, product."""
SLAB_STEPS = 8.0
"""Number of roundings in a slab's reflection coefficient, each worth u of it and of the phase across the slab."""


class ErrorLimits(NamedTuple):
    """Largest errors (M,) of matched paths that numerical precision and geometry explain."""

    length: Floats
    """[m] path length."""
    gain: Floats
    """Magnitude of the gain, relative to the coherent scale (`coherent_scale`)."""
    phase: Floats
    """[rad] phase of the gain; pi where the gain vanishes in its own uncertainty."""
    aod: Floats
    """[rad] direction of departure."""
    aoa: Floats
    """[rad] direction of arrival."""


class PathLegs(NamedTuple):
    """Lengths, segments and walls of the two legs (M, 2) of matched paths; the second is zero without a landmark."""

    length: Floats
    """[m]."""
    bounces: Integers
    """Number of wall bounces."""
    at_device: Floats
    """[m] length of the segment at the agent's end; without a landmark the second entry is the segment at the Rx."""
    at_landmark: Floats
    """[m] length of the segment next to the landmark."""
    segments: list[Floats]
    """Two of (M, V): all segments [m] of the leg, 0 beyond the last."""
    walls: list[Integers]
    """Two of (M, D): walls of the leg, -1 beyond the last."""


@dataclass(frozen=True, slots=True, eq=False)
class RoomPrecision:
    """Numerical precision of paths in one room, which sets their error limits: rounding and flatness of walls."""

    scene: Scene
    radio: RadioConfig
    roundoff: float
    """Unit roundoff of the numbers that are judged: `SINGLE` or `DOUBLE`."""
    extent: float
    """[m] largest coordinate."""
    offset_rays: float
    """Distance at which rays start off their surfaces, relative to 1 m + the largest coordinate."""
    offset: Floats
    """(W,) [m] twice the distance by which a wall's mesh may be off its plane: a mirror image moves by that."""
    tilt: Floats
    """(W,) [rad] twice the angle by which a wall's mesh may be tilted."""
    field: Floats
    """(W,) error of the field at a bounce, relative to the incident field."""

    @classmethod
    def of(cls, scene: Scene, radio: RadioConfig, *, single: bool) -> "RoomPrecision":
        """Precision of paths in a scene: of the tracer's float32 numbers about the room's middle, or of float64."""
        walls = build_walls(scene)
        u = SINGLE if single else DOUBLE
        extent = float(np.abs(scene.bounds - (scene.bounds.mean(axis=0) if single else 0.0)).max())
        corners, owner, altitude = walls.triangles, walls.wall_of_triangle, walls.largest_triangles()[1]
        height = np.abs(np.einsum("tci,ti->tc", corners, walls.normal[owner]) - walls.offset[owner][:, None])
        flatness = np.zeros(len(walls))
        np.maximum.at(flatness, owner, height.max(axis=1, initial=0.0))
        off = u * extent + flatness * single
        field = np.array([field_error(m, radio.carrier) for m in walls.material])
        return cls(scene, radio, u, extent, RAY_OFFSET if single else 0.0, 2.0 * off, 4.0 * off / altitude, field)

    def limits(
        self, paths: Paths, cycle: Integers, path: Integers, trajectory: Trajectory, scale: Floats
    ) -> ErrorLimits:
        """Error limits of the image-source channel's paths (cycle[i], path[i]), of coherent scale `scale` (M,)."""
        shape = _shape(paths, cycle, path, trajectory, build_walls(self.scene).names)
        reach = self.extent + shape.length
        shift = (2.0 + STEPS * shape.bounces) * self.roundoff * reach * (shape.length > 0.0)
        gain = np.full(len(shift), 4.0 * FIELD_STEPS * SINGLE)  # rounding in materials and antennas
        for leg, walls in enumerate(shape.walls):
            there = walls >= 0
            gain += np.where(there, self.field[walls], 0.0).sum(axis=1)
            shift[:, leg] += np.where(there, self.offset[walls], 0.0).sum(axis=1)
            shift[:, leg] += np.where(there, self.tilt[walls], 0.0).sum(axis=1) * reach[:, leg]
        beside = shift + self.offset_rays * (1.0 + reach) * (shape.bounces > 0)
        bend = [_bend(segments, beside[:, leg]) for leg, segments in enumerate(shape.segments)]
        leg_length = 2.0 * shift + np.stack(bend, axis=-1)
        length = leg_length.sum(axis=1)
        direct = paths.landmark[path] < 0
        ends = np.where(direct[:, None], beside[:, :1], beside)
        angle = np.minimum(_ratio(ends, shape.at_device) + 8.0 * self.roundoff, np.pi)
        turn = _ratio(beside, shape.at_landmark) + 8.0 * self.roundoff
        gain += _ratio(leg_length, shape.length).sum(axis=1)
        gain += self._landmark(paths, cycle, path, trajectory, turn) + self._patterns(paths, cycle, path)
        share = np.minimum(gain * scale / np.maximum(np.abs(paths.gain[cycle, path]), np.finfo(np.float64).tiny), 1.0)
        phase = 2.0 * np.pi / self.radio.wavelength * length + np.where(share < 1.0, np.arcsin(share), np.pi)
        return ErrorLimits(length, gain, np.minimum(phase, np.pi), angle[:, 0], angle[:, 1])

    def _patterns(self, paths: Paths, cycle: Integers, path: Integers) -> Floats:
        """Gain's error limit (M,) from antenna patterns: a half-wave dipole's is a small difference over a sine."""
        error, antennas = np.zeros(len(path)), self.radio.antennas
        for pattern, ray in ((antennas.tx, paths.departure), (antennas.rx, paths.arrival)):
            if pattern == "hw_dipole":
                sine = np.linalg.norm(ray[cycle, path, :2], axis=-1)
                error += np.minimum(_ratio(np.full(len(path), 0.5 * np.pi * FIELD_STEPS * SINGLE), sine), 1.0)
        return error

    def _landmark(self, paths: Paths, cycle: Integers, path: Integers, trajectory: Trajectory, turn: Floats) -> Floats:
        """Gain's error limit (M,) from turning both directions at a panel or cylinder by `turn` (M, 2) [rad]."""
        error = np.zeros(len(path))
        wavenumber = 2.0 * np.pi / self.radio.wavelength
        for number, scatterer in enumerate(self.scene.scatterers):
            if scatterer.law == "cylinder" and scatterer.height is not None:
                rows = paths.landmark[path] == number
                error[rows] = wavenumber * scatterer.height * turn[rows].sum(axis=1)
        for number, panel in enumerate(self.scene.panels):
            rows = np.flatnonzero(paths.panel[path] == number)
            for leg, toward in enumerate(_landmark_directions(paths, cycle[rows], path[rows], trajectory)):
                error[rows] += 0.5 * wavenumber * panel.spec.diagonal * turn[rows, leg]
                # the element's pattern, at most cos^(3/2) in amplitude
                error[rows] += (1.0 + _ratio(turn[rows, leg], np.abs(toward @ panel.spec.normal))) ** 2 - 1.0
        return error


def coherent_scale(
    paths: Paths, cycle: Integers, path: Integers, trajectory: Trajectory, precision: RoomPrecision
) -> Floats:
    """Scale (M,) of gains for the limits of their errors: the sum of the magnitudes of all contributions.

    Of a panel path, over its elements: a null is the difference of large numbers, and its own size says nothing about
    their error. Of a cylinder, its broadside. Of all others the gain itself. Where walls are slabs give `paths` with
    perfect mirrors in their place: a coefficient near zero (Brewster's angle) is such a difference too.
    """
    scale = np.abs(paths.gain[cycle, path])
    for number, scatterer in enumerate(precision.scene.scatterers):
        rows = np.flatnonzero(paths.landmark[path] == number)
        if scatterer.law == "cylinder" and len(rows):
            toward = _landmark_directions(paths, cycle[rows], path[rows], trajectory)
            rcs = cross_section(scatterer, precision.radio.wavelength, *toward)
            axis = scatterer.axis
            across = cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
            across = across / np.linalg.norm(across)
            broadside = cross_section(scatterer, precision.radio.wavelength, across, across)
            scale[rows] *= np.sqrt(broadside / np.maximum(rcs, np.finfo(np.float64).tiny))
    if paths.ris is not None:
        rows = np.flatnonzero(paths.ris.tx_leg[path] >= 0)
        for part in np.array_split(rows, max(1, len(rows) // 20_000)):
            tx = paths.ris.tx[cycle[part], paths.ris.tx_leg[path[part]]]
            rx = paths.ris.rx[cycle[part], paths.ris.rx_leg[path[part]]]
            scale[part] = np.abs(tx * rx).sum(axis=(1, 2))
    return scale


def with_perfect_mirrors(scene: Scene) -> Scene | None:
    """The scene with perfect mirrors in place of slabs, for the scale of gains in error limits; None without slabs."""
    if not any(reflector.material.is_slab for reflector in scene.reflectors):
        return None
    mirror = Material(reflection=1.0)
    return replace(
        scene, reflectors=tuple(replace(r, material=mirror) if r.material.is_slab else r for r in scene.reflectors)
    )


def _polyline(paths: Paths, cycle: Integers, path: Integers, trajectory: Trajectory) -> Floats:
    """Corners (M, V + 2, 3) [m] of compared paths, Tx to Rx (repeated), whose rounding sets the limits of errors."""
    tx, rx = trajectory.tx[cycle][:, None], trajectory.rx[cycle][:, None]
    there = np.arange(paths.vertices.shape[2]) < paths.num_vertices[path][:, None]
    return np.concatenate([tx, np.where(there[..., None], paths.vertices[cycle, path], rx), rx], axis=1)


def _shape(paths: Paths, cycle: Integers, path: Integers, trajectory: Trajectory, names: tuple[str, ...]) -> PathLegs:
    """Lengths, segments and walls of the legs of compared paths (cycle[i], path[i]), for their error limits."""
    segment = np.linalg.norm(np.diff(_polyline(paths, cycle, path, trajectory), axis=1), axis=-1)
    row, on_tx = np.arange(len(path)), (paths.tx_walls[path] >= 0).sum(axis=1)
    joined, last = paths.landmark[path] >= 0, paths.num_vertices[path]
    first_leg = np.where(joined[:, None], np.arange(segment.shape[1]) <= on_tx[:, None], True)
    length = np.stack([(segment * first_leg).sum(axis=1), (segment * ~first_leg).sum(axis=1)], axis=-1)
    at_device = np.stack([segment[:, 0], segment[row, last]], axis=-1)
    at_landmark = np.where(joined[:, None], np.stack([segment[row, on_tx], segment[row, on_tx + joined]], -1), np.inf)
    there = segment * (np.arange(segment.shape[1]) <= last[:, None])
    segments = [there * first_leg, there * ~first_leg]
    number = np.array([names.index(name) for name in paths.walls] + [-1])
    walls = [number[paths.tx_walls[path]], number[paths.rx_walls[path]]]
    return PathLegs(
        length, np.stack([(w >= 0).sum(axis=1) for w in walls], axis=-1), at_device, at_landmark, segments, walls
    )


def _landmark_directions(
    paths: Paths, cycle: Integers, path: Integers, trajectory: Trajectory
) -> tuple[Floats, Floats]:
    """Unit vectors (M, 3) from each compared path's landmark to the points beside it, for the gain's error limit."""
    points, row = _polyline(paths, cycle, path, trajectory), np.arange(len(path))
    at = (paths.tx_walls[path] >= 0).sum(axis=1) + 1
    return unit(points[row, at - 1] - points[row, at]), unit(points[row, at + 1] - points[row, at])


def _ratio(a: Floats, b: Floats) -> Floats:
    """Ratio of an error to its limit, 0 where the error is 0."""
    return np.where(a > 0.0, a / np.where(b > 0.0, b, np.finfo(np.float64).tiny), 0.0)


def _bend(segments: Floats, beside: Floats) -> Floats:
    """Error limit (M,) [m] of a compared path's length when corners move by `beside` (M,) [m] across segments (M,
    V)."""
    # A segment's ends then are up to twice that apart across it: `(2 d)^2 / (2 l)`, and never more than both moves.
    across = np.where(segments > 0.0, beside[:, None], 0.0)
    return np.minimum(_ratio(2.0 * across**2, segments), 2.0 * across).sum(axis=1)


@cache
def field_error(material: Material, carrier: float) -> float:
    """Error limit of the field reflected by a material in float32, relative to the incident field.

    A slab's coefficient follows its permittivity eps and the phase `k d sqrt(z)`, `z = eps - sin^2`, across it, which
    may be hundreds of radians: float32 keeps as many digits of it as of all else. The derivatives by ln d and ln eps
    are the measure, at the worst angle and polarisation. The root's imaginary part besides comes from `|z| - Re z`,
    which cancels in a slab of little loss: the root is off by `u |z| / (2 Im sqrt(z))`, at most by sqrt(u |z|).
    """
    if material.level is not None:
        return FIELD_STEPS * SINGLE
    cosine, step = np.linspace(1e-3, 1.0, 4001), 1e-6
    permittivity = slab_permittivity(material, carrier)

    def slope(by_depth: float, by_permittivity: float) -> Floats:
        sides = [
            np.stack(
                slab_coefficients(
                    cosine, np.array(permittivity * (1.0 + sign * by_permittivity)),
                    np.array(material.thickness * (1.0 + sign * by_depth)), carrier,
                )
            )
            for sign in (-1.0, 1.0)
        ]  # fmt: skip
        return np.abs(sides[1] - sides[0]).max(axis=0) / (2.0 * step)

    z = permittivity - (1.0 - cosine**2)
    root = np.sqrt(z)
    loss = np.maximum(np.abs(root.imag), np.finfo(np.float64).tiny)
    off = np.minimum(np.abs(z) / (2.0 * loss), np.sqrt(np.abs(z) / SINGLE))
    steps = SLAB_STEPS + 2.0 * np.abs(root) * off / abs(permittivity)
    worst = (slope(step, 0.0) * SLAB_STEPS + slope(0.0, step) * steps).max()
    return float((FIELD_STEPS + SLAB_STEPS + worst) * SINGLE)
