"""A hall of thousands of triangles and hundreds of planes."""

from itertools import pairwise

import numpy as np

from built_in_rooms.parts import grid, refined, sphere
from built_in_rooms.paths import curved_agent
from rislam_rt.arrays import Floats
from rislam_rt.scene.meshes import Mesh, joined
from rislam_rt.scene.room_files import RoomFiles, panel, reflector
from rislam_rt.scene.shapes import block

LENGTH, WIDTH, EAVES, RIDGE = 40.0, 25.0, 6.0, 8.0
"""[m]: the vault rises from the eaves to the ridge, so the hall is 8 m high."""

VAULT_STRIPS = 25
PILLARS = [[10.0, 6.0], [20.0, 6.0], [30.0, 6.0], [10.0, 19.0], [20.0, 19.0], [30.0, 19.0]]
CRATES = [[4, 4], [5, 9], [5, 15], [7, 20], [12, 3], [14, 21], [25, 4], [26, 20], [33, 10], [34, 15], [36, 4], [37, 20]]
PILLAR_RADIUS, PILLAR_SIDES = 0.4, 16


def large_hall() -> RoomFiles:
    """40 x 25 x 8 m: subdivided floor and walls, a barrel vault, round pillars, crates."""
    arch = _arch()
    meshes = {
        "floor": grid([0.0, 0.0, 0.0], [LENGTH, 0.0, 0.0], [0.0, WIDTH, 0.0], 32, 20),
        "vault": _vault(arch),
        "wall_x0": _gable(0.0, arch),
        "wall_x40": _gable(LENGTH, arch),
        "wall_y0": grid([0.0, 0.0, 0.0], [LENGTH, 0.0, 0.0], [0.0, 0.0, EAVES], 40, 6),
        "wall_y25": grid([0.0, WIDTH, 0.0], [LENGTH, 0.0, 0.0], [0.0, 0.0, EAVES], 40, 6),
        "pillars": joined([_pillar(*foot) for foot in PILLARS]),
        "crates": _crates(),
    }
    agent, files = curved_agent(
        [[14.1, 9.2, 1.1], [16.0, 10.1, 1.1], [18.2, 11.9, 1.1], [20.4, 12.3, 1.1], [22.0, 13.8, 1.1]]
    )
    strip = VAULT_STRIPS // 2 + 2
    low, high = arch[strip], arch[strip + 1]
    along = np.array([0.0, *(high - low)]) / np.linalg.norm(high - low)
    normal = np.cross(along, [1.0, 0.0, 0.0])
    middle = (low + high) / 2.0
    table = {
        "name": "large_hall",
        "reflector": [reflector(name, {"reflection": 0.6} if name == "crates" else None) for name in meshes],
        "scatterer": [sphere("sphere", [17.2, 13.6, 2.3], 0.15), sphere("hook", [21.7, 10.4, 3.1], 0.2)],
        "ris": panel([18.9, *middle.tolist()], normal.tolist(), along.tolist(), "vault", 10),
        "agent": agent,
    }
    readme = (
        "A hall of 40 x 25 m under a barrel vault of 25 strips (6 m at the eaves, 8 m at the ridge), six round "
        "pillars of 16 sides and a dozen crates: 4296 triangles in 186 planes. The 10 x 10 panel lies "
        "in a tilted strip."
    )
    return RoomFiles(table, meshes, readme, files)


def _arch() -> Floats:
    """Corners (VAULT_STRIPS + 1, 2) of the vault's cross-section (y, z): chords of a circle from eaves to eaves."""
    rise, half = RIDGE - EAVES, WIDTH / 2.0
    radius = (half**2 + rise**2) / (2.0 * rise)
    angle = np.linspace(-1.0, 1.0, VAULT_STRIPS + 1) * np.arcsin(half / radius)
    arch = np.stack([half + radius * np.sin(angle), RIDGE - radius * (1.0 - np.cos(angle))], axis=-1)
    arch[[0, -1]] = [[0.0, EAVES], [WIDTH, EAVES]]
    return arch


def _vault(arch: Floats) -> Mesh:
    strips = []
    for low, high in pairwise(arch):
        strips.append(grid([0.0, *low], [LENGTH, 0.0, 0.0], [0.0, *(high - low)], 16, 1))
    return joined(strips)


def _gable(x: float, arch: Floats) -> Mesh:
    """An end wall: one column of triangles below each strip of the vault."""
    foot = np.stack([arch[:, 0], np.zeros(len(arch))], axis=-1)
    middle = np.stack([arch[:, 0], np.full(len(arch), EAVES / 2.0)], axis=-1)
    rows = np.stack([foot, middle, arch])
    vertices = np.concatenate([np.full((*rows.shape[:2], 1), x), rows], axis=-1).reshape(-1, 3)
    width = len(arch)
    first = (np.arange(2)[:, None] * width + np.arange(width - 1)).reshape(-1, 1)
    quads = np.concatenate([first, first + 1, first + width + 1, first + width], axis=1)
    return Mesh(vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


def _pillar(x: float, y: float) -> Mesh:
    """Sides of a prism from the floor to below the vault; its first corner is turned off the axes."""
    angle = 2.0 * np.pi * (np.arange(PILLAR_SIDES) + 0.37) / PILLAR_SIDES
    ring = np.stack([x + PILLAR_RADIUS * np.cos(angle), y + PILLAR_RADIUS * np.sin(angle)], axis=-1)
    sides = []
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        sides.append(grid([*a, 0.0], [*(b - a), 0.0], [0.0, 0.0, EAVES], 1, 3))
    return joined(sides)


def _crates() -> Mesh:
    """A dozen crates on the floor, turned against the walls, without bottom faces."""
    rng = np.random.default_rng(7)
    crates = []
    for place in CRATES:
        size = np.array([0.8, 0.8, 0.6]) + rng.uniform(0.0, 1.0, 3)
        mesh = block((-size / 2.0 * [1, 1, 0]).tolist(), (size * [0.5, 0.5, 1.0]).tolist(), without=("floor",))
        angle = rng.uniform(0.2, 1.3)
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        crates.append(refined(Mesh(mesh.vertices @ turn.T + [*place, 0.0], mesh.faces)))
    return joined(crates)
