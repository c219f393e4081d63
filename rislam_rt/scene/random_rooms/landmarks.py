"""Random landmarks of a room: scatterers in the open, below the agent or hidden; a RIS panel on wall or ceiling."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import unit
from rislam_rt.model import RisPanel, RisSpec
from rislam_rt.model.ris import ElementPattern
from rislam_rt.scene.check.mesh_queries import is_blocked
from rislam_rt.scene.random_rooms.furniture import FurniturePiece, PlacementLimits, draw_piece, fits
from rislam_rt.scene.random_rooms.random_floor_plan import depth_inside
from rislam_rt.scene.random_rooms.shell import ceiling_normal, wall_normal

PLACES = ("open", "below", "hidden")
"""Where a random scatterer is: anywhere, below the whole motion, or behind a screen for most of it."""
SHARES = (0.6, 0.2, 0.2)
"""Shares of the random scatterers that each of `PLACES` is asked for."""
OFF_SURFACES, OFF_WAY, APART = 0.2, 0.45, 0.5
"""Least distances [m] of a random scatterer from surfaces, from the agent's path and from other landmarks."""
BELOW = 0.15
"""[m] by which a random scatterer at `below` lies below all of the motion."""
BEHIND, TALLER = (0.35, 0.7), 0.4
"""Range [m] of a screen's distance from the scatterer that it hides, and by how much it is taller."""
MOST = 0.6
"""Least share of the agent's path from which a hidden scatterer is not seen over the straight line."""
ELEMENTS = (4, 16)
"""Range of a random RIS panel's elements along one side."""
SQUARE = 0.6
"""Share of random RIS panels that are square."""
LEVELS = (2, 4, 8)
PATTERNS: tuple[ElementPattern, ...] = ("tang", "energy")
"""Phase levels and element patterns of random RIS panels, each as often."""
SPACING = 0.015
"""Distance [m] between the elements of a random RIS panel: half a wavelength at 10 GHz."""
EDGE = 0.4
"""Least distance [m] of a RIS panel's centre from the edges of its wall or ceiling."""
ABOVE = 0.3
"""Least height [m] of a RIS panel on a wall above the start: an array that looks up hears nothing from below."""
_TRIES = 60


def draw_scatterer(
    place: str, ground: PlacementLimits, pieces: list[FurniturePiece], landmarks: Floats, *, rng: np.random.Generator
) -> tuple[Floats, list[FurniturePiece]] | None:
    """Draw a random scatterer's position (3,) at one of `PLACES`, and a screen if it has one; None if none fits."""
    low, high = ground.outline.min(axis=0), ground.outline.max(axis=0)
    lowest = float(ground.way[:, 2].min())
    for _ in range(_TRIES):
        flat = rng.uniform(low, high)
        roof = float(ground.roof.height(flat)) - OFF_SURFACES
        bottom, top = (OFF_SURFACES, lowest - BELOW) if place == "below" else (OFF_SURFACES, roof)
        if place == "hidden":
            bottom, top = lowest + BELOW, min(roof, lowest + 1.2)
        if top < bottom:
            continue
        point = np.array([*flat, rng.uniform(bottom, top)])
        if not _is_free(point, ground, pieces, landmarks):
            continue
        if place != "hidden":
            return point, []
        screen = _screen_before(point, ground, rng)
        clear = not any(screen.holds(mark, OFF_SURFACES) for mark in [*landmarks, point])
        if clear and fits(screen, ground, pieces) and hidden_share(point, ground.way, [*pieces, screen]) >= MOST:
            return point, [screen]
    return None


def hidden_share(point: Floats, way: Floats, pieces: list[FurniturePiece]) -> float:
    """Share of the agent's path (K, 3) from which furniture hides a random landmark (3,), at every tenth position."""
    seen_from = way[::10]
    triangles = [piece.mesh().triangles for piece in pieces]
    if not triangles:
        return 0.0
    return float(np.mean(is_blocked(seen_from, point, np.concatenate(triangles))))


def draw_panel(
    side: str, ground: PlacementLimits, pieces: list[FurniturePiece], landmarks: Floats, *, rng: np.random.Generator
) -> RisPanel | None:
    """Draw a RIS panel on a `wall` or in the `ceiling` of a random room; None where there is no room for its centre."""
    for _ in range(_TRIES):
        found = _on_wall(ground, rng) if side == "wall" else _in_ceiling(ground, rng)
        if found is None:
            continue
        host, center, normal, up = found
        apart = np.linalg.norm(landmarks - center, axis=1).min(initial=np.inf) >= APART
        if apart and not any(piece.holds(center, OFF_SURFACES) for piece in pieces):
            rows, cols = rng.integers(ELEMENTS[0], ELEMENTS[1] + 1, size=2)
            cols = rows if rng.uniform() < SQUARE else cols
            levels, element = int(rng.choice(LEVELS)), PATTERNS[rng.choice(len(PATTERNS))]
            spec = RisSpec(int(rows), int(cols), np.array([SPACING, SPACING]), normal, up, levels, element)
            return RisPanel(spec, center, host)
    return None


def _on_wall(ground: PlacementLimits, rng: np.random.Generator) -> tuple[str, Floats, Floats, Floats] | None:
    """Draw a random RIS panel's place on a wall, above the start: host, centre, normal, up; None if it does not fit."""
    outline = ground.outline
    along = np.roll(outline, -1, axis=0) - outline
    length = np.linalg.norm(along, axis=1)
    number = int(rng.choice(len(outline), p=length / length.sum()))
    share = rng.uniform()
    if min(share, 1.0 - share) * length[number] < EDGE:
        return None
    foot = outline[number] + share * along[number]
    ends = np.array([outline[number], foot, outline[(number + 1) % len(outline)]])
    low, high = float(ground.way[0, 2]) + ABOVE, float(ground.roof.height(ends).min()) - EDGE
    if high < low:
        return None
    return f"wall_{number}", np.array([*foot, rng.uniform(low, high)]), wall_normal(outline, number), np.eye(3)[2]


def _in_ceiling(ground: PlacementLimits, rng: np.random.Generator) -> tuple[str, Floats, Floats, Floats] | None:
    """Draw the place of a random RIS panel in the ceiling: host, centre, normal and up; None where it does not fit."""
    outline, roof = ground.outline, ground.roof
    flat = rng.uniform(outline.min(axis=0), outline.max(axis=0))
    ridge = (flat - roof.point) @ roof.axis
    if depth_inside(outline, flat) < EDGE or (roof.form == "gable" and abs(ridge) < EDGE):
        return None
    host = "ceiling" if roof.form != "gable" else "ceiling_a" if ridge > 0.0 else "ceiling_b"
    normal = ceiling_normal(roof, flat)
    angle = rng.uniform(-np.pi, np.pi)
    level = np.array([np.cos(angle), np.sin(angle), 0.0])
    up = unit(level - (level @ normal) * normal)
    return host, np.array([*flat, roof.height(flat)]), normal, unit(up - (up @ normal) * normal)


def _screen_before(point: Floats, ground: PlacementLimits, rng: np.random.Generator) -> FurniturePiece:
    """Draw a screen that hides a random scatterer: across the line from it to the middle of the agent's path."""
    toward = unit(ground.way[len(ground.way) // 2, :2] - point[:2])
    center = point[:2] + rng.uniform(*BEHIND) * toward
    screen = draw_piece("screen", center, float(np.arctan2(toward[1], toward[0]) + np.pi / 2.0), rng=rng)
    return screen._replace(top=max(screen.top, float(point[2]) + TALLER))


def _is_free(point: Floats, ground: PlacementLimits, pieces: list[FurniturePiece], landmarks: Floats) -> bool:
    """Whether the position of a random scatterer is off walls, furniture, other landmarks and the agent's path."""
    if float(depth_inside(ground.outline, point[:2])) < OFF_SURFACES:
        return False
    if any(piece.holds(point, OFF_SURFACES) for piece in pieces):
        return False
    if np.linalg.norm(landmarks - point, axis=1).min(initial=np.inf) < APART:
        return False
    return bool(np.linalg.norm(ground.way - point, axis=1).min() >= OFF_WAY)
