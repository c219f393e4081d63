"""Lengths below which the tracer's float32 rays say nothing."""

from rislam_rt.arrays import Floats
from rislam_rt.geometry.coplanar import tracer_gap
from rislam_rt.model import Scene

SEGMENT_LIMIT = 1e-5
"""[m] What Sionna RT's limit of 1 cm on segments is lowered to: that limit loses double bounces near a corner, and
below `shortest_segment` the rays' offsets take over anyway."""

LIFT = 2e-6
"""[m] While tracing, a panel's centre is kept this far in front of its host wall, so that the float32 rounding of the
wall's mesh cannot hide it."""


def room_center(scene: Scene) -> Floats:
    """(3,) [m] middle of the room's bounds: the tracer works about it, where float32 is finest."""
    return scene.bounds.mean(axis=0)


def shortest_segment(scene: Scene) -> float:
    """[m] Below this a segment may be dropped for its length: the tracer's own limit, and by how much it may see the
    segment shortened, whose start and whose end it moves off their surfaces. 0.06 mm in a room of 6 m, 0.6 mm in one of
    100 m. Longer ones are lost to float32 as well, where they run along a surface or end close to a corner: the path
    certificate computes that path by path."""
    return SEGMENT_LIMIT + 2.0 * tracer_gap(scene.bounds)
