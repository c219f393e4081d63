"""Box-shaped rooms: the paper's, and its variants."""

from rislam_rt.scene.rooms.room import BASELINE, CYCLES, Room, panel, reflector, sphere
from rislam_rt.scene.rooms.shapes import box_walls


def paper_room() -> Room:
    """The paper's room: 6 x 6 x 3 m, a panel amid the ceiling, a sphere of 5 cm, the agent on a straight line."""
    meshes = box_walls(6.0, 6.0, 3.0)
    table = {
        "name": "paper_room",
        "reflector": [reflector(name) for name in meshes],
        "scatterer": [sphere("sphere", [2.0, 1.0, 1.0])],
        "ris": panel([3.0, 3.0, 3.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], "ceiling"),
        "agent": {"start": [0.5, 0.7, 0.5], "velocity": [0.0707, 0.0707, 0.0]} | CYCLES | BASELINE,
    }
    readme = (
        "The room of the paper: 6 x 6 x 3 m, every face |R| = 0.85, a 6 x 6 panel amid the ceiling, a sphere of 5 cm.\n"
        "The agent starts at (0.5, 0.7, 0.5) instead of the paper's (0, 0, 0), which lies on three faces at once; its\n"
        "baseline is turned 0.5 rad against its heading, because a parallel one makes paths hit edges exactly."
    )
    return Room(table, meshes, readme)
