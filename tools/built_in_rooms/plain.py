"""Box-shaped rooms: the paper's, and its variants."""

from built_in_rooms.parts import box_walls, sphere
from built_in_rooms.paths import curved_agent
from rislam_rt.scene.motion.suggested_motion import BASELINE
from rislam_rt.scene.room_files import CYCLES, RoomFiles, panel, reflector

DOWN, NORTH = [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]


def paper_room() -> RoomFiles:
    """The paper's room: 6 x 6 x 3 m, a panel amid the ceiling, a sphere of 5 cm, the agent on a straight line."""
    meshes = box_walls(6.0, 6.0, 3.0)
    table = {
        "name": "paper_room",
        "reflector": [reflector(name) for name in meshes],
        "scatterer": [sphere("sphere", [2.0, 1.0, 1.0])],
        "ris": panel([3.0, 3.0, 3.0], DOWN, NORTH),
        "agent": {"start": [0.5, 0.7, 0.5], "velocity": [0.0707, 0.0707, 0.0]} | CYCLES | BASELINE,
    }
    readme = (
        "The room of the paper: 6 x 6 x 3 m, every face |R| = 0.85, a 6 x 6 panel amid the ceiling, a sphere of 5 "
        "cm. The agent starts at (0.5, 0.7, 0.5) instead of the paper's (0, 0, 0), which lies on three faces at "
        "once; its baseline is turned 0.5 rad against its heading, because a parallel one makes paths hit edges "
        "exactly."
    )
    return RoomFiles(table, meshes, readme)


def empty_box() -> RoomFiles:
    """Four walls, floor and ceiling, nothing to find: leakage and wall returns only."""
    meshes = box_walls(5.0, 4.0, 2.8)
    table = {
        "name": "empty_box",
        "reflector": [reflector(name) for name in meshes],
        "agent": {"start": [0.8, 0.9, 1.1], "velocity": [0.05, 0.035, 0.0]} | CYCLES | BASELINE,
    }
    readme = "A box of 5 x 4 x 2.8 m with neither scatterer nor panel: leakage (LOS) and wall returns (VT) only."
    return RoomFiles(table, meshes, readme)


def two_scatterers() -> RoomFiles:
    """A box with two spheres of different size and a panel off the middle; the agent walks a bow."""
    meshes = box_walls(7.0, 5.0, 3.0)
    agent, files = curved_agent([[1.0, 0.9, 0.6], [3.1, 1.2, 0.6], [5.3, 2.1, 0.6], [5.2, 3.6, 0.6], [3.5, 4.1, 0.6]])
    table = {
        "name": "two_scatterers",
        "reflector": [reflector(name) for name in meshes],
        "scatterer": [sphere("near", [2.2, 3.1, 1.3]), sphere("far", [4.3, 1.05, 1.7], 0.08)],
        "ris": panel([3.2, 2.3, 3.0], DOWN, NORTH),
        "agent": agent,
    }
    readme = (
        "A box of 7 x 5 x 3 m with two spheres (5 and 8 cm) and a panel off the middle of the ceiling. The agent "
        "walks a bow around the panel, so that every landmark is seen from several sides."
    )
    return RoomFiles(table, meshes, readme, files)


def two_panels() -> RoomFiles:
    """A box with a panel on the ceiling, a larger one on a wall, and a sphere; the agent walks a bow."""
    meshes = box_walls(7.0, 5.0, 3.0)
    agent, files = curved_agent([[1.2, 1.0, 0.6], [3.0, 1.3, 0.6], [4.9, 2.0, 0.6], [5.0, 3.4, 0.6], [3.6, 4.0, 0.6]])
    above = {"name": "above"} | panel([3.0, 2.6, 3.0], DOWN, NORTH)
    beside = {"name": "beside"} | panel([7.0, 2.9, 1.9], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], "wall_x7", 8)
    table = {
        "name": "two_panels",
        "reflector": [reflector(name) for name in meshes],
        "scatterer": [sphere("sphere", [2.4, 3.4, 1.4], 0.08)],
        "ris": [above, beside],
        "agent": agent,
    }
    readme = (
        "A box of 7 x 5 x 3 m with two panels of different size: 6 x 6 elements on the ceiling (`above`) and 8 x 8 on "
        "wall_x7 (`beside`), and a sphere of 8 cm. The agent walks a bow under the one and past the other. One "
        "controller sets both panels with one code; what the agent has to find out is which landmark is which of them."
    )
    return RoomFiles(table, meshes, readme, files)


def itu_room() -> RoomFiles:
    """A box of real materials, whose reflection depends on angle and polarisation."""
    meshes = box_walls(6.0, 5.0, 3.0)
    concrete = {"itu": "concrete", "thickness_m": 0.2}
    materials = {
        "wall_x0": {"itu": "glass", "thickness_m": 0.01},
        "wall_x6": {"itu": "metal", "thickness_m": 0.005},
        "wall_y0": {"itu": "wood", "thickness_m": 0.04},
    }
    agent, files = curved_agent([[1.1, 1.0, 0.7], [2.9, 1.3, 0.7], [4.6, 2.3, 0.7], [4.1, 3.7, 0.7], [1.9, 3.9, 0.7]])
    table = {
        "name": "itu_room",
        "reflector": [reflector(name, materials.get(name, concrete)) for name in meshes],
        "scatterer": [sphere("sphere", [1.7, 2.6, 1.4])],
        "ris": panel([3.4, 2.7, 3.0], DOWN, NORTH),
        "agent": agent,
    }
    readme = (
        "A box of 6 x 5 x 3 m of ITU-R P.2040 materials: concrete (floor, ceiling, wall_y5; 20 cm), glass "
        "(wall_x0; 1 cm), metal (wall_x6) and wood (wall_y0; 4 cm). Reflection depends on angle and polarisation "
        "(Fresnel slabs)."
    )
    return RoomFiles(table, meshes, readme, files)
