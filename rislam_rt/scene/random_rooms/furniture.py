"""Random furniture: boxes that reflect and hide, turned anyhow, clear of each other and of the agent's path."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.scene.meshes import Mesh
from rislam_rt.scene.random_rooms.random_floor_plan import depth_inside
from rislam_rt.scene.random_rooms.shell import Roof
from rislam_rt.scene.shapes import block

KINDS = {
    "cabinet": ((0.5, 1.6), (0.35, 0.7), (0.6, 2.2)),
    "screen": ((1.0, 3.0), (0.04, 0.08), (1.2, 2.2)),
    "table": ((0.8, 2.0), (0.5, 0.9), (0.65, 0.8)),
    "crate": ((0.3, 1.2), (0.3, 1.2), (0.3, 1.2)),
}
"""Ranges [m] of length, width and height of each kind of furniture; a table is a top of `TABLE_TOP` without legs."""
TABLE_TOP = 0.05
"""Thickness [m] of a table top."""
OFF_WAY, OFF_WALLS, APART = 0.55, 0.1, 0.15
"""Least distances [m] of furniture from the agent's path (where heights meet), from walls, from another piece."""
HEADROOM = 0.4
"""[m] above and below the agent's path within which a piece counts as on its height, and below the ceiling."""
_TRIES = 40


class FurniturePiece(NamedTuple):
    """A piece of furniture: a box on the floor, or a table top."""

    kind: str
    center: Floats
    """(2,) [m]."""
    half: Floats
    """(2,) half length and half width [m]."""
    yaw: float
    """Angle [rad] of its length from x."""
    bottom: float
    """Height [m] of its lower face."""
    top: float
    """Height [m] of its upper face."""

    @property
    def turn(self) -> Floats:
        """Rotation (2, 2) from the axes of a piece of furniture to the room's."""
        return np.asarray(rotation_z(np.array(self.yaw))[:2, :2])

    def rim(self) -> Floats:
        """Points (16, 2) [m] around the outline of a piece of furniture."""
        share = np.array([-1.0, -0.5, 0.0, 0.5])
        one = np.ones(4)
        sides = ((share, -one), (one, share), (-share, one), (-one, -share))
        square = np.concatenate([np.stack(side, axis=-1) for side in sides])
        return np.asarray(self.center + (square * self.half) @ self.turn.T)

    def distance(self, points: Floats) -> Floats:
        """Horizontal distance (...,) [m] of points (..., 2) from a piece of furniture, zero inside."""
        local = np.abs((points - self.center) @ self.turn) - self.half
        return np.asarray(np.linalg.norm(np.maximum(local, 0.0), axis=-1))

    def holds(self, points: Floats, margin: float) -> Booleans:
        """Whether (...,) points (..., 3) lie in a piece of furniture or within a margin [m] of it."""
        near = self.distance(points[..., :2]) < margin
        return np.asarray(near & (points[..., 2] > self.bottom - margin) & (points[..., 2] < self.top + margin))

    def mesh(self) -> Mesh:
        """Mesh of a piece of furniture without the face on the floor, so that no two faces coincide."""
        without = ("floor",) if self.bottom == 0.0 else ()
        solid = block([*-self.half, self.bottom], [*self.half, self.top], without=without)
        vertices = solid.vertices.copy()
        vertices[:, :2] = vertices[:, :2] @ self.turn.T + self.center
        return Mesh(vertices, solid.faces)


class PlacementLimits(NamedTuple):
    """What furniture and landmarks of a random room must fit into: its floor plan, its roof, and the agent's path."""

    outline: Floats
    roof: Roof
    way: Floats
    """(K, 3) [m] positions of the agent."""


def draw_pieces(ground: PlacementLimits, count: int, *, rng: np.random.Generator) -> list[FurniturePiece]:
    """Draw up to `count` pieces of furniture in a random room: fewer where there is no room."""
    pieces: list[FurniturePiece] = []
    low, high = ground.outline.min(axis=0), ground.outline.max(axis=0)
    for _ in range(count):
        kind = str(rng.choice(sorted(KINDS)))
        for _ in range(_TRIES):
            piece = draw_piece(kind, rng.uniform(low, high), float(rng.uniform(-np.pi, np.pi)), rng=rng)
            if fits(piece, ground, pieces):
                pieces.append(piece)
                break
    return pieces


def draw_piece(kind: str, center: Floats, yaw: float, *, rng: np.random.Generator) -> FurniturePiece:
    """Draw a piece of furniture of one kind and random size at a place (2,) [m] and yaw [rad]."""
    length, width, height = (float(rng.uniform(*limits)) for limits in KINDS[kind])
    bottom = height - TABLE_TOP if kind == "table" else 0.0
    return FurniturePiece(kind, center, np.array([0.5 * length, 0.5 * width]), yaw, bottom, height)


def fits(piece: FurniturePiece, ground: PlacementLimits, others: list[FurniturePiece]) -> bool:
    """Whether a piece of furniture fits the floor plan, is below the ceiling, off the agent's path and other pieces."""
    rim = piece.rim()
    if depth_inside(ground.outline, rim).min() < OFF_WALLS or ground.roof.height(rim).min() < piece.top + HEADROOM:
        return False
    if piece.distance(ground.outline).min() == 0.0:
        return False
    meets = (ground.way[:, 2] > piece.bottom - HEADROOM) & (ground.way[:, 2] < piece.top + HEADROOM)
    if meets.any() and piece.distance(ground.way[meets, :2]).min() < OFF_WAY:
        return False
    return all(
        min(piece.distance(other.rim()).min(), other.distance(rim).min()) >= APART
        and piece.distance(other.center) > 0.0
        for other in others
    )
