"""Random rooms and motions, each drawn from one integer seed: what a filter has never seen."""

from rislam_rt.scene.random_rooms.random_floor_plan import SHAPES
from rislam_rt.scene.random_rooms.random_motion import CYCLES, MOTIONS, Ways
from rislam_rt.scene.random_rooms.room import RandomRoom, draw_room

__all__ = ["CYCLES", "MOTIONS", "SHAPES", "RandomRoom", "Ways", "draw_room"]
