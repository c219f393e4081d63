"""Limits of the tracer's float32 arithmetic: lengths below which its rays are not reliable."""

from rislam_rt.arrays import Floats
from rislam_rt.geometry.coplanar import tracer_gap
from rislam_rt.model import Scene

SEGMENT_LIMIT = 1e-5
"""[m] Shortest path segment that Sionna RT is told to keep, instead of its own 1 cm, which loses double bounces near a
corner; below `shortest_segment` the rays' offsets take over anyway."""
LIFT = 2e-6
"""[m] Distance in front of its host wall at which a panel's centre is traced, so that the float32 rounding of the
wall's mesh cannot hide it."""


def room_center(scene: Scene) -> Floats:
    """Middle (3,) [m] of the room's bounds, the origin of the tracer's coordinates, where float32 is finest."""
    return scene.bounds.mean(axis=0)


def shortest_segment(scene: Scene) -> float:
    """Length [m] below which the tracer may drop a segment of a path for being short.

    The tracer's own limit, and by how much it may see the segment shortened, whose start and whose end it moves off
    their surfaces: 0.06 mm in a room of 6 m, 0.6 mm in one of 100 m. Longer ones are lost to float32 as well, where
    they run along a surface or end close to a corner: the path certificate computes that path by path.
    """
    return SEGMENT_LIMIT + 2.0 * tracer_gap(scene.bounds)
