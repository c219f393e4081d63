"""Shell of a random room: floor, walls and ceiling over a floor plan."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import unit
from rislam_rt.scene.meshes import Mesh
from rislam_rt.scene.random_rooms.random_floor_plan import extent, halve, triangulate

CEILINGS = ("flat", "shed", "gable")
"""Forms of a random room's ceiling: level, one slope, two slopes (over convex plans)."""
LOWEST = (2.2, 6.0)
"""Range [m] of a random room's lowest wall, log-uniform; at most `SLENDER` times the width of a small room."""
SLENDER, RISE, STEEPEST = 1.3, (0.3, 5.0), 0.5
"""Largest height over width of a small random room; range [m] of a ceiling's rise, log-uniform; largest slope."""


class Roof(NamedTuple):
    """Ceiling of a random room by its height: `top - slope * |axis . (x - point)|` for a gable, `low + slope * ...` for
    a shed."""

    form: str
    """One of `CEILINGS`."""
    lowest: float
    """Height [m] at the lowest wall."""
    slope: float
    """Rise over run."""
    axis: Floats
    """(2,) horizontal unit vector along which it rises."""
    point: Floats
    """(2,) on the line where a gable is highest and a shed lowest."""
    highest: float
    """Height [m] at the highest line."""

    def height(self, points: Floats) -> Floats:
        """Height (...,) [m] of a random room's ceiling over points (..., 2)."""
        along = (points - self.point) @ self.axis
        if self.form == "gable":
            return np.asarray(self.highest - self.slope * np.abs(along))
        return np.asarray(self.lowest + self.slope * along)


def draw_roof(outline: Floats, form: str, *, rng: np.random.Generator) -> Roof:
    """Draw the ceiling of a random room, of one of `CEILINGS`, over its floor plan."""
    width = extent(outline)
    lowest = min(float(np.exp(rng.uniform(*np.log(LOWEST)))), max(LOWEST[0], SLENDER * width))
    angle = rng.uniform(-np.pi, np.pi)
    axis = np.array([np.cos(angle), np.sin(angle)])
    along = outline @ axis
    rise = 0.0 if form == "flat" else float(np.exp(rng.uniform(*np.log(RISE))))
    run = np.ptp(along)
    if form == "gable":
        share = rng.uniform(0.35, 0.65)
        point = axis * (along.min() + share * run)
        run = max(share, 1.0 - share) * run
    else:
        point = axis * along.min()
    slope = min(rise / run, STEEPEST)
    return Roof(form, lowest, float(slope), axis, point, lowest + float(slope * run))


def build_shell(outline: Floats, roof: Roof) -> dict[str, Mesh]:
    """Meshes of a random room's shell, normals inwards: `floor`, `ceiling` (a gable: `_a`, `_b`), `wall_0`, ..."""
    faces = triangulate(outline)
    meshes = {"floor": Mesh(np.column_stack([outline, np.zeros(len(outline))]), faces)}
    if roof.form == "gable":
        for name, side in (("ceiling_a", 1.0), ("ceiling_b", -1.0)):
            part = halve(outline, roof.point, side * roof.axis)
            meshes[name] = Mesh(np.column_stack([part, roof.height(part)]), triangulate(part)[:, ::-1])
    else:
        meshes["ceiling"] = Mesh(np.column_stack([outline, roof.height(outline)]), faces[:, ::-1])
    for number, (a, b) in enumerate(zip(outline, np.roll(outline, -1, axis=0), strict=True)):
        meshes[f"wall_{number}"] = _wall(a, b, roof)
    return meshes


def wall_normal(outline: Floats, number: int) -> Floats:
    """Unit normal (3,) of a random room's wall, into the room."""
    along = outline[(number + 1) % len(outline)] - outline[number]
    return unit(np.array([-along[1], along[0], 0.0]))


def ceiling_normal(roof: Roof, point: Floats) -> Floats:
    """Unit normal (3,) of a random room's ceiling over a point (2,), downwards."""
    rising = -np.sign((point - roof.point) @ roof.axis) if roof.form == "gable" else 1.0
    return unit(np.array([*(rising * roof.slope * roof.axis), -1.0]))


def _wall(a: Floats, b: Floats, roof: Roof) -> Mesh:
    """Mesh of a random room's wall, from floor to ceiling, with a corner more where a ridge meets it."""
    feet = [a, b]
    near, far = ((p - roof.point) @ roof.axis for p in (a, b))
    if roof.form == "gable" and near * far < 0.0:
        feet.insert(1, a + near / (near - far) * (b - a))
    foot = np.array(feet)
    count = len(foot)
    vertices = np.concatenate([np.column_stack([foot, np.zeros(count)]), np.column_stack([foot, roof.height(foot)])])
    k = np.arange(count - 1)
    low = np.stack([k + 1, k, k + count], axis=-1)
    high = np.stack([k + 1, k + count, k + count + 1], axis=-1)
    return Mesh(vertices, np.concatenate([low, high]))
