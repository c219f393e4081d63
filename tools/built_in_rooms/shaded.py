"""A room with round objects that hide things."""

from built_in_rooms.parts import box_walls, sphere
from built_in_rooms.paths import curved_agent
from rislam_rt.scene.room_files import RoomFiles, panel, reflector


def shaded_room() -> RoomFiles:
    """A box with a ball and a column that shade, and a rod whose cross-section depends on directions."""
    meshes = box_walls(7.0, 5.0, 3.0)
    agent, files = curved_agent([[1.0, 0.9, 0.6], [3.1, 0.8, 0.6], [5.5, 1.2, 0.6], [6.1, 2.8, 0.6], [4.9, 4.2, 0.6]])
    table = {
        "name": "shaded_room",
        "reflector": [reflector(name) for name in meshes],
        "scatterer": [
            sphere("ball", [2.4, 3.2, 1.3], 0.25) | {"mie": True, "shadow": True},
            {"name": "column", "position": [4.2, 2.2, 1.1], "radius": 0.2, "height_m": 2.2, "rcs_m2": 0.05}
            | {"shadow": True},
            {"name": "rod", "position": [1.2, 4.1, 1.6], "radius": 0.03, "height_m": 0.1, "axis": [0.3, -0.2, 1.0]},
        ],
        "ris": panel([3.3, 2.7, 3.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]),
        "agent": agent,
    }
    readme = (
        "A box of 7 x 5 x 3 m with a ball (25 cm, exact Mie cross-section), a column on the floor (20 cm, 2.2 m high) "
        "and a rod (3 cm, 10 cm long; physical optics, direction by direction). Ball and column hide what lies behind "
        "them and reflect nothing: the agent loses the ball behind the column and finds it again, and its wall returns "
        "come and go."
    )
    return RoomFiles(table, meshes, readme, files)
