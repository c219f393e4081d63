"""Rooms that are no boxes: an L, and one without two parallel faces."""

import numpy as np

from built_in_rooms.parts import sphere
from built_in_rooms.paths import curved_agent
from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import unit
from rislam_rt.scene.meshes import Mesh
from rislam_rt.scene.room_files import RoomFiles, panel, reflector
from rislam_rt.scene.shapes import hexahedron, quad

TILTED_PLANES: dict[str, tuple[list[float], list[float]]] = {
    "floor": ([0.021, -0.034, 1.0], [3.0, 2.5, 0.0]),
    "ceiling": ([-0.06, 0.045, -1.0], [3.0, 2.5, 3.0]),
    "wall_x0": ([1.0, 0.07, 0.035], [0.0, 2.5, 1.5]),
    "wall_x1": ([-1.0, 0.11, -0.05], [6.0, 2.5, 1.5]),
    "wall_y0": ([-0.09, 1.0, 0.025], [3.0, 0.0, 1.5]),
    "wall_y1": ([0.13, -1.0, 0.06], [3.0, 5.0, 1.5]),
}
"""Inward direction and a point of each face: no two parallel, none along an axis."""


def l_room() -> RoomFiles:
    """An L-shaped room; the panel hangs at the bend, the scatterer in one arm."""
    outline = [[0.0, 0.0], [7.0, 0.0], [7.0, 3.0], [3.0, 3.0], [3.0, 6.0], [0.0, 6.0]]
    names = ["wall_y0", "wall_x7", "wall_y3", "wall_x3", "wall_y6", "wall_x0"]
    height = 2.8
    # The inner corner (3, 3) sees the whole outline, so a fan around it triangulates floor and ceiling.
    fan = np.array([[3, 0, 1], [3, 1, 2], [3, 4, 5], [3, 5, 0]])
    level = [np.array([[x, y, z] for x, y in outline]) for z in (0.0, height)]
    meshes = {"floor": Mesh(level[0], fan), "ceiling": Mesh(level[1], fan[:, ::-1])}
    for number, name in enumerate(names):
        after = (number + 1) % len(outline)
        meshes[name] = quad([level[0][after], level[0][number], level[1][number], level[1][after]])
    agent, files = curved_agent(
        [[5.9, 1.9, 0.6], [4.4, 1.3, 0.6], [2.6, 1.2, 0.6], [1.4, 2.2, 0.6], [1.2, 3.8, 0.6], [1.5, 5.3, 0.6]],
        speed=0.135,
    )
    table = {
        "name": "l_room",
        "reflector": [reflector(name) for name in meshes],
        "scatterer": [sphere("sphere", [6.3, 2.4, 1.5])],
        "ris": panel([1.7, 1.8, height], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]),
        "agent": agent,
    }
    readme = (
        "An L of 7 x 6 m with arms 3 m wide, 2.8 m high: not convex, so walls hide walls. The panel hangs over the "
        "bend. The agent walks from the arm with the sphere into the other one, where it sees the sphere no more."
    )
    return RoomFiles(table, meshes, readme, files)


def tilted_room() -> RoomFiles:
    """Six faces, no two parallel and none along an axis; the panel lies in the tilted ceiling."""
    meshes = hexahedron(_corners())
    normal, point = (np.array(value) for value in TILTED_PLANES["ceiling"])
    normal = unit(normal)
    center = np.array([2.8, 2.6, 3.0])
    center += ((point - center) @ normal) * normal
    up = unit(np.array([0.3, 1.0, 0.0]) - (np.array([0.3, 1.0, 0.0]) @ normal) * normal)
    agent, files = curved_agent(
        [[0.9, 0.8, 0.7], [2.6, 0.9, 0.72], [4.6, 1.7, 0.75], [4.5, 3.4, 0.8], [2.4, 3.9, 0.85]]
    )
    table = {
        "name": "tilted_room",
        "reflector": [reflector(name) for name in meshes],
        "scatterer": [sphere("sphere", [1.6, 2.9, 1.45])],
        "ris": panel(center.tolist(), normal.tolist(), up.tolist()),
        "agent": agent,
    }
    readme = (
        "About 6 x 5 x 3 m; floor, ceiling and walls are tilted by 2 to 9 degrees, no two of them parallel and "
        "none along an axis. The panel lies in the ceiling, turned against the walls."
    )
    return RoomFiles(table, meshes, readme, files)


def _corners() -> Floats:
    """Corners (2, 2, 2, 3) of the tilted room: each the common point of three planes."""
    corners = np.empty((2, 2, 2, 3))
    for index in np.ndindex(2, 2, 2):
        names = (f"wall_x{index[0]}", f"wall_y{index[1]}", ("floor", "ceiling")[index[2]])
        normals = np.array([TILTED_PLANES[name][0] for name in names])
        offsets = [np.dot(*TILTED_PLANES[name]) for name in names]
        corners[index] = np.linalg.solve(normals, offsets)
    return corners
