"""Suggested motion of the agent for a room without one: through an open place, along the longest free line."""

from typing import Any

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.scene.check.mesh_queries import free_ways, sphere_directions
from rislam_rt.scene.findings import Fault

BASELINE = {"tx_offset_m": [-0.04388, -0.02397, 0.0], "rx_offset_m": [0.04388, 0.02397, 0.0]}
"""Offsets [m] of Tx and Rx in the scene file: 0.1 m apart, turned 0.5 rad, parallel to no edge and no diagonal."""

NUM_PLACES, NUM_RAYS, NUM_WAYS = 120, 64, 24
"""Places tried for a suggested motion (a fifth with many faces), rays cast from each, and directions."""
MANY_FACES = 5000
"""Faces of a room from which on fewer places are tried."""
HEADROOM = 1.0
"""[m] Free height above what counts as a floor, where there is such a place."""
CARRIED = 1.5
"""[m] Height at which a person carries a radio, that of the suggested motion; half of the free height, if less."""
CLEAR, LEAST_CLEAR = 0.5, 0.02
"""[m] Distance that the suggested motion keeps from all surfaces, and the least it makes do with in a tight room."""
SPEED, CYCLE, CYCLES = 0.1, 0.1, 600
"""Suggested speed [m/s], the paper's (slower on a short line), time between cycles [s], and number of cycles."""


def suggest_agent(triangles: Floats) -> dict[str, Any]:
    """Suggest the `[agent]` table of a scene file for a room of triangles (T, 3, 3) [m].

    It starts above a floor, where the mean of the free ways in all directions is largest (the hall and not the
    cupboard), in the open if there is ground under the sky (the street and not the house behind it), and goes straight
    along the longest free line through that place.

    Raises
    ------
    Fault
        No place keeps clear of the surfaces, or the agent would stand still.
    """
    box = np.stack([triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))])
    places, is_open = _places(triangles, box)
    clear = distance_to_triangles(places, triangles) if len(places) else np.zeros(0)
    keep = min(CLEAR, float(clear.max(initial=0.0)) / 2.0)
    if keep < LEAST_CLEAR:
        raise Fault("no free place for the agent found", "give a room with a floor, in metres")
    good = clear > keep
    places = places[good & is_open] if (good & is_open).any() else places[good]
    rays = sphere_directions(NUM_RAYS)
    place = places[int(np.argmax([free_ways(place, rays, triangles, box).mean() for place in places]))]
    turn = np.arange(NUM_WAYS) * np.pi / NUM_WAYS + 0.1  # along no wall of a room that is parallel to the axes
    ways = np.stack([np.cos(turn), np.sin(turn), np.zeros(NUM_WAYS)], axis=-1)
    ahead, behind = (free_ways(place, sign * ways, triangles, box) - keep for sign in (1.0, -1.0))
    return _motion(place, ways, ahead, behind, keep, triangles)


def _places(triangles: Floats, box: Floats) -> tuple[Floats, Booleans]:
    """Places (N, 3) [m] for a suggested motion, carried above the lowest surface; whether (N,) each is in the open."""
    count = NUM_PLACES if len(triangles) < MANY_FACES else NUM_PLACES // 5
    k = np.arange(count) + 0.5
    share = np.stack([k / count, (k * 0.5 * (np.sqrt(5.0) - 1.0)) % 1.0], axis=-1)  # Fibonacci lattice
    found, sky = [], []
    for plan in box[0, :2] + share * (box[1] - box[0])[:2]:
        levels = _levels(plan, triangles)
        roofs = np.append(levels[1:], max(box[1, 2], levels[-1] + 1e-9 if len(levels) else 0.0))
        free = roofs - levels
        if len(levels):
            floor = int(np.argmax(free >= HEADROOM)) if (free >= HEADROOM).any() else int(np.argmax(free))
            found.append([*plan, levels[floor] + min(CARRIED, 0.5 * free[floor])])
            sky.append(floor == len(levels) - 1)
    return np.array(found).reshape(-1, 3), np.array(sky, dtype=np.bool_)


def _levels(plan: Floats, triangles: Floats) -> Floats:
    """Heights [m] for a suggested motion, ascending, at which a vertical line through a point (2,) meets triangles."""
    corners = triangles[:, :, :2] - plan
    after = np.roll(corners, -1, axis=1)
    turn = corners[..., 0] * after[..., 1] - corners[..., 1] * after[..., 0]
    double_area = turn.sum(axis=1)
    hit = ((turn >= 0.0).all(axis=1) | (turn <= 0.0).all(axis=1)) & (double_area != 0.0)
    weight = np.roll(turn[hit], -1, axis=1) / double_area[hit, None]  # the edge opposite to each corner
    return np.unique(np.round((weight * triangles[hit, :, 2]).sum(axis=1), 6))


def _motion(
    place: Floats, ways: Floats, ahead: Floats, behind: Floats, keep: float, triangles: Floats
) -> dict[str, Any]:
    """Suggested `[agent]` table: the longest straight line through a place that keeps clear, of limited length."""
    wanted = SPEED * CYCLE * (CYCLES - 1)
    for row in np.argsort(-np.minimum(ahead + behind, wanted), kind="stable"):
        length = min(wanted, float(ahead[row] + behind[row]))
        before = max(length - float(ahead[row]), min(float(behind[row]), 0.5 * length))
        start = place - ways[row] * before
        line = start + np.linspace(0.0, length, 25)[:, None] * ways[row]
        if length > 0.0 and distance_to_triangles(line, triangles).min() >= 0.5 * keep:
            velocity = length / (CYCLE * (CYCLES - 1)) * ways[row]
            start, velocity = np.round(start, 6), np.round(velocity, 6)
            motion = {"start": start.tolist(), "velocity": velocity.tolist(), "cycles": CYCLES, "cycle_s": CYCLE}
            return motion | BASELINE
    raise Fault("no free way for the agent found", "give a room with some free space")
