"""A random walk of the agent through a room: waypoints drawn in turn, each as far from surfaces as is asked."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.scene.check.mesh_queries import crossings
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.motion.waypoints import RoundedPath, round_corners

WIDEST_TURN = np.radians(110.0)
"""Largest turn [rad] at a corner of a random walk."""
LEG = (0.5, 6.0)
"""Range [m] of the lengths drawn for a random walk's legs, log-uniform, besides what the arcs at both ends take."""
LOOK = 0.05
"""Spacing [m] at which a random walk's distance from surfaces is checked; a quarter of the clearance, if less."""
TRIES, STEPS_BACK = 40, 3
"""Draws of a random walk's next waypoint before the last few waypoints are given up, and how many those are."""
GIVE_UP = 400
"""Times that waypoints are given up before the random walk is."""


def draw_walk(
    start: Floats, length: float, radius: float, clearance: float, triangles: Floats, *, rng: np.random.Generator
) -> RoundedPath:
    """Draw a level random walk of at least `length` [m] from `start` (3,), with corners of `radius` [m], `clearance`
    [m] or more from all triangles (T, 3, 3).

    Raises
    ------
    Fault
        The start is nearer than that to a surface, or no way is found.
    """
    gap = float(distance_to_triangles(start[None], triangles).min())
    if gap < clearance + 0.5 * _check_step(clearance):
        raise Fault(f"the start is {gap:.3g} m from a surface", "move it, or lower agent.random_walk.clearance_m")
    points, given_up = [start], 0
    while True:
        for _ in range(TRIES):
            tried = [*points, _next(points, radius, rng)]
            if _is_clear(tried, radius, clearance, triangles):
                points = tried
                break
        else:
            points, given_up = points[: max(1, len(points) - STEPS_BACK)], given_up + 1
            if given_up > GIVE_UP:
                mend = "lower agent.random_walk.clearance_m or agent.speed_m_s, or start where there is room"
                raise Fault(f"no way of {length:.3g} m found that stays {clearance:g} m from all surfaces", mend)
        if len(points) > 2:
            way = round_corners(np.array(points), radius)
            # the last leg may be cut by the next corner: it does not count
            if way.total - float(way.length[-1]) >= length:
                return way


def _next(points: list[Floats], radius: float, rng: np.random.Generator) -> Floats:
    """Draw the next waypoint (3,) [m] of a random walk."""
    if len(points) > 1:
        last = points[-1] - points[-2]
        course = np.arctan2(last[1], last[0]) + rng.uniform(-WIDEST_TURN, WIDEST_TURN)
    else:
        course = rng.uniform(-np.pi, np.pi)
    reach = 2.0 * radius * np.tan(WIDEST_TURN / 2.0) + float(np.exp(rng.uniform(*np.log(LEG))))
    return points[-1] + reach * np.array([np.cos(course), np.sin(course), 0.0])


def _is_clear(points: list[Floats], radius: float, clearance: float, triangles: Floats) -> bool:
    """Whether the last two legs of a random walk and the corner between them keep their clearance from all surfaces."""
    corners = triangles.reshape(-1, 3)
    if (points[-1] < corners.min(axis=0)).any() or (points[-1] > corners.max(axis=0)).any():
        return False
    way = round_corners(np.array(points[-3:]), radius)
    count = int(np.ceil(way.total / _check_step(clearance))) + 1
    places, _ = way.at(np.linspace(0.0, way.total, count))
    if len(crossings(places[:-1], places[1:], triangles)[0]):
        return False
    return float(distance_to_triangles(places, triangles).min()) >= clearance + 0.5 * _check_step(clearance)


def _check_step(clearance: float) -> float:
    """Spacing [m] at which a random walk's clearance is checked: between, it comes nearer by half of it at most."""
    return min(LOOK, clearance / 4.0)
