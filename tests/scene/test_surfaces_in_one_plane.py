"""A window within its wall is as meant; what overlaps a wall in part, or is as large as it, is warned of."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_in_rooms.parts import grid

from rislam_rt.geometry.coplanar import lies_within
from rislam_rt.model import Reflector
from rislam_rt.scene import check_scene, load_scene

ROOM = Path(__file__).parents[2] / "scenes/paper_room"


def said(**meshes):
    """Severity and message of the findings on surfaces in one plane, in the paper's room with these in it."""
    room = load_scene(ROOM)
    more = tuple(Reflector(name, m.vertices, m.faces, room.reflectors[0].material) for name, m in meshes.items())
    found = check_scene(replace(room, reflectors=room.reflectors + more))
    return [(f.severity, f.message) for f in found if "plane of" in f.message]


def plate(y, z, width, height, steps=1):
    """On the wall x = 0 of the room, which is 6 m wide and 3 m high."""
    return grid([0.0, y, z], [0.0, width, 0.0], [0.0, 0.0, height], steps, steps)


def corners(mesh):
    return mesh.vertices[mesh.faces]


def test_windows_and_doors_within_their_wall_are_one_note():
    (one,) = said(window=plate(1, 1, 1, 1), door=plate(4, 0, 0.9, 2.1, 3), pane=plate(1.2, 1.2, 0.5, 0.5))
    assert one == ("note", "'window' lies in the plane of 'wall_x0', 0 mm apart, and 3 other pairs likewise")


@pytest.mark.parametrize(
    ("second", "lower"),
    [
        (plate(1.5, 1, 0.9, 0.9), "window"),  # over its edge, and within the wall
        (plate(1, 1, 1, 1), "again"),  # as large as the window: the file does not say which was meant
    ],
)
def test_what_is_not_within_or_not_smaller_is_warned_of(second, lower):
    (line,) = (message for severity, message in said(window=plate(1, 1, 1, 1), again=second) if severity == "warning")
    assert f"in the plane of '{lower}'" in line


def test_what_spans_a_slot_is_not_within():
    """Also where no corner of the slot lies on the window, nor one of the window in the slot."""
    window = corners(plate(1.1, 1, 2, 1))
    parts = [corners(plate(*part)) for part in ((0, 0, 2, 3), (2.2, 0, 3, 3), (2, 0, 0.2, 0.5))]
    assert not lies_within(window, np.concatenate(parts), 1e-5)
    assert lies_within(corners(plate(0.1, 1, 1.9, 1)), np.concatenate(parts), 1e-5)  # up to the slot
    assert lies_within(window, corners(plate(0, 0, 6, 3, 7)), 1e-5)  # over the seams of a wall of many triangles
