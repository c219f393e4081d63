"""Cones that rule out wall sequences by where a leg's ends are, for rooms with too many sequences to trace them all.

Seen from the far end's image, whatever comes after a bounce lies in the cone over a ball about the wall. A next wall,
or a device, outside all these cones is never met. Positions come in balls, so that one test serves all near each other;
walls are balls too. It errs towards keeping: nothing that exists is ruled out.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.traced.tracer_scene import as_indices

if TYPE_CHECKING:
    from rislam_rt.channel.traced.tracer_scene import TracerScene

NEAR = 0.02
"""Side of the cells by which positions are grouped into balls, as a share of the room's longest side."""


class PositionBall(NamedTuple):
    """Bounding ball of some positions, centre and radius [m] in the tracer's frame."""

    center: tuple[float, float, float]
    radius: float


class Cones(NamedTuple):
    """Test of wall sequences by the cones from their far ends' balls over balls about the walls (a `Narrowing`)."""

    tracer_scene: "TracerScene"
    far: list[PositionBall]
    device: list[tuple[PositionBall, PositionBall]]
    """Each device ball with its far ball."""

    def lead_on(self, walls: Integers) -> Booleans:
        """Which wall sequences (N, d) a far end leaves possible: the first wall reaches into the others' cones."""
        keep = np.zeros(len(walls), dtype=np.bool_)
        columns = _columns(walls)
        target, size = _wall_ball(self.tracer_scene, columns[0])
        for ball in self.far:
            keep |= np.array(self._in_cones(columns[1:], ball, target, size), dtype=np.bool_)
        return keep

    def reach(self, walls: Integers) -> Booleans:
        """Which wall sequences (N, d) both ends leave possible: a device ball reaches into its far ball's cones."""
        keep = np.zeros(len(walls), dtype=np.bool_)
        columns = _columns(walls)
        for device, ball in self.device:
            target = mi.Point3f(*(dr.opaque(mi.Float, x) for x in device.center))
            keep |= np.array(self._in_cones(columns, ball, target, dr.opaque(mi.Float, device.radius)), dtype=np.bool_)
        return keep

    def _in_cones(self, columns: list[Any], far: PositionBall, target: Any, size: Any) -> Any:
        """Whether a target ball meets the cones from a far ball over all the walls, the last being the first met."""
        wall_boxes = self.tracer_scene.wall_boxes
        image: Any = mi.Point3f(*(dr.opaque(mi.Float, x) for x in far.center))
        radius = dr.opaque(mi.Float, far.radius)
        passed: list[tuple[Any, Any]] = []
        for wall in columns[::-1]:
            normal, offset = (
                dr.gather(mi.Vector3f, wall_boxes.normal, wall),
                dr.gather(mi.Float, wall_boxes.offset, wall),
            )
            passed = [(_mirrored(center, normal, offset), half) for center, half in passed]
            passed.append(_wall_ball(self.tracer_scene, wall))
            image = _mirrored(image, normal, offset)
        keep = dr.full(mi.Bool, True, dr.width(columns[0]))
        for center, half in passed:
            keep &= _meets(target - image, center - image, size + wall_boxes.margin, radius, half + wall_boxes.margin)
        return keep


def build_cones(tracer_scene: "TracerScene", device: Floats, far: Floats) -> Cones:
    """Group devices (N, 3) [m] and far ends (N, 3), or the single one (1, 3), into the balls that cones start from."""
    device, far = device - tracer_scene.origin, far - tracer_scene.origin
    cell = NEAR * 2.0 * tracer_scene.wall_boxes.extent
    _, group = np.unique(np.floor(device / cell), axis=0, return_inverse=True)
    group = group.ravel()
    members = [np.flatnonzero(group == g) for g in range(group.max(initial=-1) + 1)]
    devices = [_ball(device[rows]) for rows in members]
    if len(far) == 1:
        only = _ball(far)
        return Cones(tracer_scene, [only], [(ball, only) for ball in devices])
    fars = [_ball(far[rows]) for rows in members]
    return Cones(tracer_scene, fars, list(zip(devices, fars, strict=True)))


def _ball(points: Floats) -> PositionBall:
    """Bounding ball of some points (N, 3) [m], from which cones start, about the middle of their bounds."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    x, y, z = middle.tolist()
    return PositionBall((x, y, z), float(np.linalg.norm(points - middle, axis=-1).max()))


def _columns(walls: Integers) -> list[Any]:
    """Convert wall sequences (N, d), to be tested by cones, to index arrays of the tracer's backend, one a column."""
    columns = [as_indices(wall) for wall in walls.T]
    dr.eval(columns)
    return columns


def _wall_ball(tracer_scene: "TracerScene", wall: Any) -> tuple[Any, Any]:
    """Centres and radii [m] of the bounding balls of walls (N,), over which cones open."""
    half = dr.gather(mi.Vector3f, tracer_scene.wall_boxes.half, wall)
    return dr.gather(mi.Point3f, tracer_scene.wall_boxes.center, wall), dr.norm(half)


def _mirrored(point: Any, normal: Any, offset: Any) -> Any:
    """Mirror points in planes, to unfold a cone, on the tracer's backend."""
    return point - 2.0 * (dr.dot(normal, point) - offset) * normal


def _meets(target: Any, axis: Any, size: Any, source: Any, half: Any) -> Any:
    """Whether the cone from a ball about 0 of radius `source` over one at `axis` of radius `half` meets a third."""
    # A ray through both runs, at t times the way to the second, within `source (t - 1) + half t` of `t axis`. So the
    # ball of radius `size` at `target` is met only if `|target - t axis| <= a + b t` for some t >= 1, with a = size -
    # source and b = source + half: a quadratic inequality, its discriminant written without a difference of large
    # numbers.
    a, b = size - source, source + half
    square = dr.squared_norm(axis) - b * b
    room = dr.squared_norm(a * axis + b * target) - dr.squared_norm(dr.cross(target, axis))
    later = dr.dot(target, axis) + a * b + dr.sqrt(dr.maximum(room, 0.0))
    return (square <= 0.0) | ((room >= 0.0) & (later >= square * (1.0 - 1e-3)))
