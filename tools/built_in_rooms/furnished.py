"""Rooms with objects in them: an office, and one imported from a GLB file."""

from typing import Any

import numpy as np

from built_in_rooms.parts import box_walls, sphere
from built_in_rooms.paths import curved_agent
from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.scene.meshes import Mesh, joined
from rislam_rt.scene.room_files import RoomFiles, panel, reflector
from rislam_rt.scene.shapes import block, quad

GLB_FILE = "room.glb"


def office() -> RoomFiles:
    """Two rooms with a doorway between them, desks, a cabinet and a screen."""
    height = 2.8
    meshes = box_walls(10.0, 7.0, height)
    meshes["partition"] = _partition(6.0, 7.0, height, door=(2.2, 3.2, 2.1))
    meshes["desk_a"] = block([1.2, 4.9, 0.70], [2.8, 5.7, 0.74])
    meshes["desk_b"] = block([3.4, 4.9, 0.70], [5.0, 5.7, 0.74])
    meshes["desk_c"] = block([7.9, 4.2, 0.70], [8.7, 5.8, 0.74])
    meshes["cabinet"] = block([6.6, 0.0, 0.0], [7.8, 0.45, 1.9], without=("floor", "wall_y0"))
    meshes["screen"] = block([2.1, 3.55, 0.0], [3.9, 3.61, 1.6], without=("floor",))
    agent, files = curved_agent(
        [[1.1, 1.1, 1.0], [2.6, 1.9, 1.0], [4.4, 2.5, 1.0], [6.0, 2.7, 1.0], [7.4, 2.9, 1.0], [8.3, 3.3, 1.0]],
        speed=0.125,
    )
    furniture = {"reflection": 0.6}
    names = {"partition": {"reflection": 0.7}} | dict.fromkeys(
        ("desk_a", "desk_b", "desk_c", "cabinet", "screen"), furniture
    )
    table = {
        "name": "office",
        "reflector": [reflector(name, names.get(name)) for name in meshes],
        "scatterer": [sphere("lamp", [1.9, 5.2, 1.6]), sphere("sensor", [8.4, 1.3, 1.9])],
        "ris": panel([3.6, 4.0, height], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]),
        "agent": agent,
    }
    readme = (
        "An office of 10 x 7 x 2.8 m: a partition with a doorway (1.0 x 2.1 m), desk tops, a cabinet and a screen "
        "that hide walls, landmarks and each other. The panel hangs in the left room; the agent walks through the "
        "doorway and loses it. Desks and screen are boxes whose faces are walls of their own (`desk_a#0` to "
        "`desk_a#5`); what stands on the floor has no bottom face, so that no two faces coincide."
    )
    return RoomFiles(table, meshes, readme, files)


def imported_glb() -> RoomFiles:
    """A room whose meshes are the named nodes of one GLB file, y axis up as the format wants it."""
    walls = box_walls(5.0, 6.0, 3.0)
    nodes = {"Floor": "floor", "Ceiling": "ceiling", "West": "wall_x0", "East": "wall_x5"}
    nodes |= {"South": "wall_y0", "North": "wall_y6"}
    names = {**{value: key for key, value in nodes.items()}, "table": "Table", "shelf": "Shelf"}
    agent, files = curved_agent([[0.9, 1.1, 0.5], [2.7, 1.3, 0.5], [4.1, 2.6, 0.5], [3.7, 4.5, 0.5], [1.5, 5.0, 0.5]])
    table = {
        "name": "imported_glb",
        "reflector": [
            {"name": name, "mesh": f"{GLB_FILE}#{node}", "up_axis": "y"}
            | {"material": {"reflection": 0.6 if name in ("table", "shelf") else 0.85}}
            for name, node in names.items()
        ],
        "scatterer": [sphere("sphere", [1.3, 2.4, 1.2])],
        "ris": panel([2.6, 3.3, 3.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]),
        "agent": agent,
    }
    readme = (
        "A room of 5 x 6 x 3 m out of one GLB file, as a modelling program exports it: named nodes, each with its "
        "own transform (the table is turned by 25 degrees, the shelf hangs on a parent node), y axis up. A "
        'reflector takes a node by `mesh = "room.glb#Table"`; `up_axis = "y"` turns it into the frame with z up.'
    )
    return RoomFiles(table, {}, readme, files | {GLB_FILE: _glb(walls, nodes)})


def _partition(x: float, width: float, height: float, door: tuple[float, float, float]) -> Mesh:
    """A thin wall across the room at `x`, with a doorway from door[0] to door[1] in y and door[2] high."""
    y0, y1, top = door
    corners = [[x, y, z] for y in (0.0, y0, y1, width) for z in (0.0, top, height)]
    cells = [(0, 0), (0, 1), (1, 1), (2, 0), (2, 1)]
    faces = [[3 * i + j, 3 * i + 3 + j, 3 * i + 4 + j, 3 * i + 1 + j] for i, j in cells]
    return joined([quad([corners[k] for k in face]) for face in faces])


def _glb(walls: dict[str, Mesh], nodes: dict[str, str]) -> bytes:
    """The GLB file: walls as they are, a turned table, and a shelf below a parent node."""
    import trimesh

    def add(node: str, mesh: Mesh, transform: Floats, **parent: str) -> None:
        solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        scene.add_geometry(solid, node_name=node, geom_name=node, transform=transform, **parent)

    scene: Any = trimesh.Scene()
    for node, wall in nodes.items():
        add(node, walls[wall], _Y_UP)
    add("Table", block([-0.6, -0.35, 0.72], [0.6, 0.35, 0.76]), _Y_UP @ _placed([4.15, 0.75, 0.0], np.radians(25.0)))
    mount = _Y_UP @ _placed([0.0, 4.0, 0.0], -np.pi / 2.0)
    scene.graph.update(frame_to="Furniture", frame_from=scene.graph.base_frame, matrix=mount)
    shelf = block([-0.5, 0.0, 0.0], [0.5, 0.3, 0.9])
    add("Shelf", shelf, _placed([0.0, 0.02, 1.2], 0.0), parent_node_name="Furniture")
    return bytes(scene.export(file_type="glb"))


_Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""From z up to y up, exactly."""


def _placed(at: list[float], heading: float) -> Floats:
    """Transform (4, 4): turned by `heading` [rad] about z, then moved."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_z(np.array(heading))
    matrix[:3, 3] = at
    return matrix
