"""The room as a scene of the tracer (Sionna RT): one mesh a material, so that every ray's hit names its wall."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
import sionna.rt as rt
from numpy.typing import NDArray

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.occluders import ALONE
from rislam_rt.channel.specular_legs import NO_WALL
from rislam_rt.channel.traced.radio_materials import specular_material
from rislam_rt.channel.walls import Walls
from rislam_rt.constants import SURFACE_TOLERANCE
from rislam_rt.errors import SceneError
from rislam_rt.geometry.triangles import inside_any

ALIGNMENT = 64
"""Bytes of the longest vector of a processor; memory that begins at a multiple of it counts as aligned."""

NO_OCCLUDER = -1
"""Key of `TracerScene.views` for the room with all its occluders."""


class WallBoxes(NamedTuple):
    """Planes and bounding boxes of the walls in the tracer's float32 arrays, about its origin."""

    normal: mi.Vector3f
    """(W,) unit normals."""
    offset: mi.Float
    """(W,) [m]: `normal . x = offset`."""
    center: mi.Point3f
    """(W,) [m] middle of each wall's bounds."""
    half: mi.Vector3f
    """(W,) [m] half the size of each wall's bounds."""
    extent: float
    """[m] Largest coordinate of a wall about the origin: half the longest side of a room about its middle."""
    margin: mi.Float
    """[m] A thousandth of the room, hundreds of times what float32 leaves uncertain; no constant of a kernel, which
    every room would compile anew."""


@dataclass(frozen=True, slots=True, eq=False)
class TracerScene:
    """A Sionna RT scene and the correspondence of its (shape, primitive) pairs with walls."""

    scene: rt.Scene
    walls: Walls
    origin: Floats
    """(3,) [m] point of the room that is the tracer's zero."""
    shape: Integers
    """(W,) number of the shape (mesh) that holds each wall's largest triangle."""
    primitive: Integers
    """(W,) that triangle's number in its shape."""
    corner: Floats
    """(W, 3) [m] one of that triangle's corners, from `origin`."""
    shapes: Integers
    """(M,) numbers of all shapes, ascending."""
    first: Integers
    """(M,) where each shape's triangles begin in `wall_of_primitive`."""
    wall_of_primitive: Integers
    """(T,) wall of each triangle, shape by shape."""
    materials: tuple[rt.RadioMaterialBase, ...]
    """All radio materials of walls."""
    material_of_wall: Integers
    """(W,) index into `materials`."""
    wall_boxes: WallBoxes
    views: dict[int, mi.Scene]
    """The whole room (`NO_OCCLUDER`), and by number of each scatterer with an occluding mesh the room without that."""
    occluders: dict[int, mi.Scene]
    """The occluding mesh of each scatterer that has one, alone; those of no scatterer together (`ALONE`)."""

    def wall_hit(self, shape: Integers, primitive: Integers) -> Integers:
        """Walls (...,) that the tracer's rays hit, by shape and primitive (...,); `NO_WALL` where no wall was hit."""
        place = np.searchsorted(self.shapes, shape)
        known = (place < len(self.shapes)) & np.isin(shape, self.shapes)
        index = np.where(known, self.first[np.where(known, place, 0)] + primitive, 0)
        return np.where(known, self.wall_of_primitive[index], NO_WALL)

    def is_stacked(self, wall: Integers) -> Booleans:
        """Whether each of the tracer scene's walls (...,) overlaps another wall in its plane."""
        sharing = np.bincount(self.walls.plane, minlength=len(self.walls)) > 1
        return (wall != NO_WALL) & sharing[self.walls.plane[wall]] if len(self.walls) else wall != NO_WALL

    def share_plane(self, a: Integers, b: Integers) -> Booleans:
        """Whether walls `a` and `b` (...,) of the tracer's scene are in one plane by lying on each other."""
        return (a != NO_WALL) & (b != NO_WALL) & (self.walls.plane[a] == self.walls.plane[b])

    def on_top(self, wall: Integers, points: Floats) -> Booleans:
        """Whether overlapping walls (N, D) of the tracer's scene are what reflects at points (N, D, 3) [m]: solid there
        and not covered; true for all other walls."""
        top = np.ones(wall.shape, dtype=np.bool_)
        for number in np.unique(wall[self.is_stacked(wall)]):
            here = wall == number
            top[here] = self._has(number, points[here])
            for upper in self.walls.over[number]:
                top[here] &= ~self._has(upper, points[here])
        return top

    def _has(self, wall: int, points: Floats) -> Booleans:
        """Which points (N, 3) of its plane are on a wall of the tracer's scene, as far as float32 vertices tell."""
        return inside_any(points, self.walls.triangles[self.walls.wall_of_triangle == wall], SURFACE_TOLERANCE)


def build_tracer_scene(walls: Walls, carrier: float, origin: Floats, occluders: Mapping[int, Floats]) -> TracerScene:
    """Build the tracer's scene of walls and occluders at the carrier [Hz]: meshes about `origin`, faces in order.

    Parameters
    ----------
    occluders
        Triangles (T, 3, 3) [m] of what hides and reflects nothing, by the number of its scatterer, or `ALONE`.

    Raises
    ------
    SceneError
        Sionna does not know a material at this carrier.
    """
    scene = rt.load_scene()
    scene.frequency = carrier
    materials = list(dict.fromkeys(walls.material))
    radio_materials = tuple(specular_material(material, m) for m, material in enumerate(materials))
    material_of_wall = np.array([materials.index(m) for m in walls.material], dtype=np.int64)
    members = [np.flatnonzero(material_of_wall[walls.wall_of_triangle] == m) for m in range(len(materials))]
    objects = [
        rt.SceneObject(build_mesh(f"walls-{m}", walls.triangles[rows] - origin), f"walls-{m}", radio_material=material)
        for m, (material, rows) in enumerate(zip(radio_materials, members, strict=True))
    ]
    absorber = rt.AbsorberRadioMaterial("shade")
    dark = {
        number: rt.SceneObject(build_mesh(f"shade-{number}", part - origin), f"shade-{number}", radio_material=absorber)
        for number, part in occluders.items()
    }
    try:
        scene.add([*objects, *dark.values()])
    except ValueError as error:
        raise SceneError(f"material: {error}; give an ITU material that is specified at {carrier:g} Hz") from None
    for material in radio_materials:  # in memory, not in the code of kernels: every room would compile its own
        dr.make_opaque([value for _, value in mi.traverse(material)])
    ids = np.array([int(o.object_id) for o in objects], dtype=np.int64)
    removable = [number for number in dark if number != ALONE]  # the others are nobody's own
    views = {number: _part([*objects, *(o for n, o in dark.items() if n != number)]) for number in removable}
    alone = {number: _part([shade]) for number, shade in dark.items()}
    # the triangles of all shapes, in their order, and where each wall's largest is among them
    order = np.argsort(ids)
    rows = np.concatenate([members[m] for m in order] or [np.zeros(0, dtype=np.int64)])
    sizes = [len(members[m]) for m in order]
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64) if sizes else np.zeros(0, dtype=np.int64)
    place = np.argsort(rows)
    shape_of = np.repeat(ids[order], sizes)[place]
    primitive_of = (np.arange(len(rows)) - np.repeat(first, sizes))[place]
    largest, _ = walls.largest_triangles()
    return TracerScene(
        scene, walls, origin, shape_of[largest], primitive_of[largest], walls.triangles[largest, 0] - origin,
        ids[order], first, walls.wall_of_triangle[rows], radio_materials, material_of_wall,
        _wall_boxes(walls, origin), {NO_OCCLUDER: scene.mi_scene} | views, alone,
    )  # fmt: skip


def _part(objects: list[rt.SceneObject]) -> mi.Scene:
    """Mitsuba scene of some of the tracer's meshes."""
    return mi.load_dict({"type": "scene"} | {o.name: o.mi_mesh for o in objects})


def _wall_boxes(walls: Walls, origin: Floats) -> WallBoxes:
    """Planes and bounding boxes of the walls in the tracer's scene, about `origin`."""
    low, high = np.full((len(walls), 3), np.inf), np.full((len(walls), 3), -np.inf)
    np.minimum.at(low, walls.wall_of_triangle, walls.triangles.min(axis=1) - origin)
    np.maximum.at(high, walls.wall_of_triangle, walls.triangles.max(axis=1) - origin)
    extent = float(np.abs([low, high]).max(initial=0.0))
    offset = as_floats(walls.offset - walls.normal @ origin)
    return WallBoxes(
        mi.Vector3f(as_points(walls.normal)), offset, as_points(0.5 * (low + high)),
        mi.Vector3f(as_points(0.5 * (high - low))), extent, dr.opaque(mi.Float, 1e-3 * (1.0 + extent)),
    )  # fmt: skip


def as_points(points: Floats) -> mi.Point3f:
    """Convert positions (N, 3) [m] for the tracer's scene to float32 points of its backend."""
    return mi.Point3f(*map(as_floats, points.T))


def as_floats(values: Floats) -> mi.Float:
    """Convert values (N,) for the tracer's scene to float32 numbers of its backend."""
    return mi.Float(_aligned(values, np.float32))


def as_indices(values: Integers) -> mi.UInt:
    """Convert numbers (N,) for the tracer's scene to unsigned integers of its backend."""
    return mi.UInt(_aligned(values, np.uint32))


def as_mask(values: Booleans) -> mi.Bool:
    """Convert flags (N,) for the tracer's scene to a mask of its backend."""
    return mi.Bool(_aligned(values, np.bool_))


def _aligned(values: NDArray[Any], dtype: type) -> NDArray[Any]:
    """Copy an array (N,) for the tracer's scene to memory that begins at a multiple of `ALIGNMENT`."""
    # Dr.Jit reads the array where it is, and compiles one kernel for aligned memory and another for any other, for each
    # argument anew: left to chance, hardly any kernel is found in its cache again.
    size = len(values) * np.dtype(dtype).itemsize
    room = np.empty(size + ALIGNMENT, dtype=np.uint8)
    begin = -room.ctypes.data % ALIGNMENT
    copy: NDArray[Any] = room[begin : begin + size].view(dtype)
    copy[:] = values
    return copy


def build_mesh(name: str, triangles: Floats) -> mi.Mesh:
    """Mitsuba mesh for the tracer's scene, of separate triangles (T, 3, 3) [m], in their order."""
    mesh = mi.Mesh(
        name, vertex_count=3 * len(triangles), face_count=len(triangles), has_vertex_normals=False,
        has_vertex_texcoords=False,
    )  # fmt: skip
    params = mi.traverse(mesh)
    params["vertex_positions"] = mi.Float(triangles.astype(np.float32).ravel())
    params["faces"] = mi.UInt(np.arange(3 * len(triangles), dtype=np.uint32))
    params.update()
    return mesh
