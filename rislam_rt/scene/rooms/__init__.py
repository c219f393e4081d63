"""The rooms under `scenes/`, each as a function that returns all its files' content."""

from collections.abc import Callable

from rislam_rt.scene.rooms.plain import paper_room
from rislam_rt.scene.rooms.room import Room

ROOMS: dict[str, Callable[[], Room]] = {
    "paper_room": paper_room,
}
"""Name of the template -> its builder."""

__all__ = ["ROOMS", "Room"]
