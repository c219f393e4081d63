"""Random box rooms, drawn in memory: what a classifier learns from, so that every named room stays unseen."""

import numpy as np

from rislam_rt.arrays import Floats, cross
from rislam_rt.geometry.angles import unit
from rislam_rt.model import Material, Occluder, Reflector, RisPanel, RisSpec, Scatterer, Scene, Trajectory
from rislam_rt.scene.shapes import block, hexahedron, sphere_mesh

SIZE, HEIGHT = (3.5, 9.0), (2.3, 4.0)
"""Ranges [m] of a random box room's sides and height."""
TILTED, TILT = 0.4, 0.08
"""Share of rooms whose planes all lean, and the standard deviation of their normals then."""
FURNISHED = 0.4
"""Share of random box rooms with a reflecting block on the floor."""
REFLECTION, RADIUS = (0.3, 0.95), (0.03, 0.3)
"""Ranges of a random box room's reflection coefficients, and of its scatterers' radii [m] (log-uniform)."""
ALIKE, SLABS = 0.35, 0.35
"""Shares of random box rooms of one reflection coefficient, and of slabs; in the others every wall has its own."""
THICKNESS = {"concrete": 0.2, "brick": 0.12, "plasterboard": 0.025, "chipboard": 0.02, "marble": 0.03, "glass": 0.008,
             "plywood": 0.02, "wood": 0.03, "metal": 0.005}  # fmt: skip
"""ITU materials of random box rooms and their thicknesses [m], which vary by a factor of 0.6 to 1.6."""
SHADING = 0.5
"""Share of a random box room's scatterers above 0.1 m of radius that hide what lies behind them."""
PANEL, CEILING_PANEL, ELEMENTS = 0.8, 0.5, (4, 16)
"""Share of random box rooms with a RIS panel, of panels in the ceiling, not on a wall; range of elements a side."""
MAX_SCATTERERS = 4
"""Most scatterers of a random box room."""
MARGIN = 0.5
"""Least distance [m] of a scatterer's or the panel's centre from the walls of an upright room."""


def random_room(name: str, *, rng: np.random.Generator) -> Scene:
    """Draw a random box room: walls, perhaps a block, spheres, perhaps a RIS panel; the agent is at a corner."""
    size = np.array([*rng.uniform(*SIZE, size=2), rng.uniform(*HEIGHT)])
    corners = _corners(size, TILT if rng.uniform() < TILTED else 0.0, rng)
    meshes = hexahedron(corners)
    if rng.uniform() < FURNISHED:
        low = rng.uniform(0.45, 0.7, size=2) * size[:2]
        high = np.minimum(low + rng.uniform(0.4, 1.5, size=2), 0.88 * size[:2])
        meshes["block"] = block([*low, 0.03 * size[2]], [*high, rng.uniform(0.3, 0.6) * size[2]])
    materials = _materials(len(meshes), rng)
    reflectors = tuple(Reflector(key, *meshes[key], material) for key, material in zip(meshes, materials, strict=True))
    spheres = tuple(_sphere(f"sphere_{k}", size, rng) for k in range(rng.integers(1, MAX_SCATTERERS + 1)))
    panel = _panel(corners, size, rng) if rng.uniform() < PANEL else None
    start = np.array([0.18, 0.18, 0.35]) * size
    agent = Trajectory(np.zeros(1), start[None], np.zeros((1, 3)), np.zeros(1))
    return Scene(name, reflectors, spheres, panel, agent)


def _corners(size: Floats, tilt: float, rng: np.random.Generator) -> Floats:
    """Corners (2, 2, 2, 3) of a random box room: each the common point of three planes, so that faces are flat."""
    normal = np.concatenate([np.eye(3), np.eye(3)]).reshape(2, 3, 3)
    normal = unit(normal + tilt * rng.standard_normal((2, 3, 3)))
    point = np.stack([0.5 * size * (1.0 - np.eye(3)), 0.5 * size * (1.0 + np.eye(3))])
    corners = np.empty((2, 2, 2, 3))
    axes = np.arange(3)
    for index in np.ndindex(2, 2, 2):
        planes = normal[list(index), axes]
        corners[index] = np.linalg.solve(planes, np.sum(planes * point[list(index), axes], axis=1))
    return corners


def _materials(count: int, rng: np.random.Generator) -> list[Material]:
    """Draw the materials of a random box room's walls and block."""
    kind = rng.uniform()
    if kind < ALIKE:
        return count * [Material(reflection=float(rng.uniform(*REFLECTION)))]
    if kind < ALIKE + SLABS:
        names = rng.choice(sorted(THICKNESS), size=count)
        return [Material(itu=str(n), thickness=THICKNESS[str(n)] * float(rng.uniform(0.6, 1.6))) for n in names]
    return [Material(reflection=float(rng.uniform(*REFLECTION))) for _ in range(count)]


def _sphere(name: str, size: Floats, rng: np.random.Generator) -> Scatterer:
    """Draw a spherical scatterer in a random box room."""
    radius = float(np.exp(rng.uniform(*np.log(RADIUS))))
    center = rng.uniform([MARGIN, MARGIN, 0.15 * size[2]], [*(size[:2] - MARGIN), 0.8 * size[2]])
    hides = radius > 0.1 and rng.uniform() < SHADING
    shade = Occluder(*sphere_mesh(center, radius)) if hides else None
    return Scatterer(name, center, float(np.pi * radius**2), radius, shade=shade)


def _panel(corners: Floats, size: Floats, rng: np.random.Generator) -> RisPanel:
    """Draw a RIS panel in the ceiling of a random box room or in the upper half of a wall, its front into the room."""
    host, (a, b, c) = "ceiling", (corners[0, 0, 1], corners[1, 0, 1], corners[0, 1, 1])
    share = rng.uniform(0.25, 0.75, size=2)
    if rng.uniform() >= CEILING_PANEL:
        axis, side = rng.integers(2, size=2)
        wall, share[1] = np.moveaxis(corners, axis, 0)[side], rng.uniform(0.5, 0.85)
        host, (a, b, c) = f"wall_{'xy'[axis]}{side}", (wall[0, 0], wall[1, 0], wall[0, 1])
    normal = unit(cross(c - a, b - a))
    center = a + share[0] * (b - a) + share[1] * (c - a)
    normal = normal if (0.5 * size - center) @ normal > 0.0 else -normal
    elements = int(rng.integers(ELEMENTS[0], ELEMENTS[1] + 1))
    spec = RisSpec(elements, elements, np.array([0.015, 0.015]), normal, unit(c - a - ((c - a) @ normal) * normal))
    return RisPanel(spec, center, host)
