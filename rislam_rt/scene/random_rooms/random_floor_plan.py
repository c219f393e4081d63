"""Random floor plans, and geometric queries to them: simple polygons, counter-clockwise."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.scene.polygons import inside_loop

SHAPES = ("convex", "l", "t", "u")
"""Shapes of a random floor plan."""
SIZE, SIZE_WITH_ARMS = (2.0, 30.0), (5.0, 30.0)
"""Ranges [m] of a plan's longer side, log-uniform; a plan with arms begins where an arm has room for an agent."""
ASPECT = (0.5, 1.0)
"""Shorter side of a random floor plan over the longer."""
RECTANGLES = 0.5
"""Share of the random convex floor plans that are rectangles; the others have 4 to 7 corners on an ellipse."""
ARM = (0.28, 0.48)
"""Width of an arm of a random floor plan as a share of the side that it stands on."""
OFFSET = 5.0
"""Largest distance [m] of a plan's middle from the origin along either axis, so that no coordinate means anything."""


def draw_plan(shape: str, *, rng: np.random.Generator) -> Floats:
    """Draw a random room's floor plan (E, 2) [m] of one of `SHAPES`, its size, turn and shift at random."""
    long = float(np.exp(rng.uniform(*np.log(SIZE if shape == "convex" else SIZE_WITH_ARMS))))
    sides = np.array([long, long * rng.uniform(*ASPECT)])
    outline = {"convex": _convex, "l": _ell, "t": _tee, "u": _horseshoe}[shape](sides, rng)
    middle = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    turn = rotation_z(np.array(rng.uniform(-np.pi, np.pi)))[:2, :2]
    return np.asarray((outline - middle) @ turn.T + rng.uniform(-OFFSET, OFFSET, size=2))


def extent(outline: Floats) -> float:
    """Largest distance [m] between two corners of a random room's floor plan."""
    return float(np.linalg.norm(outline[:, None] - outline, axis=-1).max())


def area(outline: Floats) -> float:
    """Area [m^2] of a random room's floor plan, positive where the corners run counter-clockwise.

    Its rounding decides which of two flat ears is cut off, and so the meshes of every room that was ever drawn.
    """
    x, y = outline.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def depth_inside(outline: Floats, points: Floats) -> Floats:
    """Distance (...,) [m] of points (..., 2) from the outline of a random room's floor plan, negative outside."""
    start, along = outline, np.roll(outline, -1, axis=0) - outline
    offset = points[..., None, :] - start
    share = np.clip(np.sum(offset * along, axis=-1) / np.sum(along**2, axis=-1), 0.0, 1.0)
    gap = np.linalg.norm(offset - share[..., None] * along, axis=-1).min(axis=-1)
    return np.where(inside_loop(outline, points), gap, -gap)


def triangulate(outline: Floats) -> Integers:
    """Triangulate a random room's floor plan, a simple polygon, by cutting off ears: (E - 2, 3), counter-clockwise."""
    left = list(range(len(outline)))
    faces = []
    while len(left) > 3:
        place = next(place for place in range(len(left)) if _is_ear(outline, left, place))
        faces.append([left[place - 1], left[place], left[(place + 1) % len(left)]])
        left.pop(place)
    return np.array([*faces, left], dtype=np.int64)


def halve(outline: Floats, point: Floats, normal: Floats) -> Floats:
    """Corners of the part of a convex floor plan where `normal . (x - point)` is not negative."""
    side = (outline - point) @ normal
    kept = []
    for a, b, near, far in zip(outline, np.roll(outline, -1, axis=0), side, np.roll(side, -1), strict=True):
        kept += [a] if near >= 0.0 else []
        kept += [a + near / (near - far) * (b - a)] if near * far < 0.0 else []
    return np.array(kept)


def _convex(sides: Floats, rng: np.random.Generator) -> Floats:
    """Draw the corners of a random convex floor plan of given sides: a rectangle, or 4 to 7 corners on an ellipse."""
    if rng.uniform() < RECTANGLES:
        return np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * sides
    count = int(rng.integers(4, 8))
    angle = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.22, 0.22, size=count)) / count
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    ring -= ring.min(axis=0)
    return np.asarray(ring / ring.max(axis=0) * sides)


def _ell(sides: Floats, rng: np.random.Generator) -> Floats:
    """Draw the corners of a random L-shaped floor plan of given sides."""
    (a, b), (u, v) = sides, rng.uniform(*ARM, size=2) * sides
    return np.array([[0, 0], [a, 0], [a, v], [u, v], [u, b], [0, b]], dtype=np.float64)


def _tee(sides: Floats, rng: np.random.Generator) -> Floats:
    """Draw the corners of a random T-shaped floor plan of given sides."""
    (a, b), (u, v) = sides, rng.uniform(*ARM, size=2) * sides
    left = rng.uniform(0.3, 0.7) * (a - u)
    right = left + u
    stem = [[left, b - v], [left, 0], [right, 0], [right, b - v]]
    return np.array([*stem[1:], [a, b - v], [a, b], [0, b], [0, b - v], stem[0]], dtype=np.float64)


def _horseshoe(sides: Floats, rng: np.random.Generator) -> Floats:
    """Draw the corners of a random U-shaped floor plan of given sides."""
    (a, b), floor = sides, rng.uniform(*ARM) * sides[1]
    left, right = rng.uniform(ARM[0], 0.38, size=2) * a
    arms = [[a - right, b], [a - right, floor], [left, floor], [left, b]]
    return np.array([[0, 0], [a, 0], [a, b], *arms, [0, b]], dtype=np.float64)


def _is_ear(outline: Floats, left: list[int], place: int) -> bool:
    """Whether a random floor plan's corner is an ear to cut off: convex, with no other corner in its triangle."""
    before, here, after = left[place - 1], left[place], left[(place + 1) % len(left)]
    corners = outline[[before, here, after]]
    if area(corners) <= 0.0:
        return False
    others = [corner for corner in left if corner not in (before, here, after)]
    edges = np.roll(corners, -1, axis=0) - corners
    offset = outline[others][:, None] - corners
    return not bool((edges[:, 0] * offset[..., 1] - edges[:, 1] * offset[..., 0] >= 0.0).all(axis=1).any())
