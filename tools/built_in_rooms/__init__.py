"""The rooms under `scenes/`, each as a function that returns all its files' content."""

from collections.abc import Callable

from built_in_rooms.angled import l_room, tilted_room
from built_in_rooms.furnished import imported_glb, office
from built_in_rooms.hall import large_hall
from built_in_rooms.plain import empty_box, itu_room, paper_room, two_panels, two_scatterers
from built_in_rooms.shaded import shaded_room
from rislam_rt.scene.room_files import RoomFiles

ROOMS: dict[str, Callable[[], RoomFiles]] = {
    room.__name__: room
    for room in (
        paper_room, empty_box, l_room, tilted_room, office, two_scatterers, two_panels, itu_room, large_hall,
        imported_glb, shaded_room,
    )
}  # fmt: skip
"""Name of the template -> its builder."""

__all__ = ["ROOMS", "RoomFiles"]
