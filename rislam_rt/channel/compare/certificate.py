"""Proofs: why one side lacks a path, recomputed from mirror images in float64 without either channel's own tests."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.image_source.facets import Facets, build_facets
from rislam_rt.channel.walls import build_walls
from rislam_rt.geometry.planes import mirror
from rislam_rt.geometry.triangles import distance_to_edges, outline_edges
from rislam_rt.model import PathKind, Scene, Trajectory

Identity = tuple[int, str, tuple[str, ...], tuple[str, ...]]
"""Kind, landmark, Tx walls, Rx walls, by name."""

SHORTEST_SEGMENT = 10.07e-3
"""[m] Sionna RT drops a path with a segment below 1 cm; in float32 the limit bites up to this length."""

EDGE_TOLERANCE = 1e-4
"""[m] How far from an outline a bounce or a passing ray may be decided either way: vertices, images and directions in
float32 carry about 1e-6 of the coordinates, and a slanting bounce multiplies that."""


class Proof(NamedTuple):
    """Reason (empty: none found), what was computed, and the length [m] on which it rests."""

    reason: str
    text: str
    size: float = 0.0


class Condition(NamedTuple):
    """One thing that a path needs: it holds where `margin` [m] is positive. `reason` names its failure."""

    reason: str
    text: str
    margin: float


class Leg(NamedTuple):
    """One leg drawn on unbounded planes: device, bounces, far end (d + 2, 3), its walls (d,), and the least clearance.

    `clearance` [m] is the smallest distance of a segment's ends from the plane it bounces on, negative where the two
    neighbours of a bounce do not lie on the same side: then there is no such reflection.
    """

    points: Floats
    walls: Integers
    clearance: float


@dataclass(frozen=True, slots=True, eq=False)
class Certifier:
    """Scene, poses and the outlines of all walls."""

    scene: Scene
    trajectory: Trajectory
    depth: int
    """Bounces up to which both sides looked."""
    shortest: float
    """[m] Segments below this are lost by the tracer."""
    names: tuple[str, ...]
    facets: Facets
    edges: Floats
    """(E, 2, 3) [m] outline edges of all walls."""
    wall_of_edge: Integers
    """(E,)."""
    host: int

    @classmethod
    def of(cls, scene: Scene, trajectory: Trajectory, depth: int, shortest: float) -> "Certifier":
        """Prepare a scene and its poses."""
        walls = build_walls(scene)
        facets = build_facets(walls)
        outlines = [outline_edges(facets.corners[a:b]) for a, b in zip(facets.first, facets.first[1:], strict=False)]
        owner = np.repeat(np.arange(len(walls)), [len(o) for o in outlines])
        edges = np.concatenate([np.zeros((0, 2, 3)), *outlines])
        return cls(scene, trajectory, depth, shortest, walls.names, facets, edges, owner, walls.host)

    def label(self, identity: Identity) -> str:
        """An identity for people; Rx walls after the bar."""
        kind, landmark, tx, rx = identity
        text = " ".join([PathKind(kind).name, *tx, *([landmark] if landmark else [])])
        return f"{text} | {' '.join(rx)}" if rx else text

    def explain(self, identity: Identity, cycle: int, side: str) -> Proof:
        """The proof for a path that only `side` has.

        A path exists where all its conditions hold. It is proved absent by an object that stands clearly in the way
        of reflections in order, undecidable where some margin is within `EDGE_TOLERANCE` of zero and no other
        condition clearly fails, and cut by the tracer where it exists with too short a segment. All else is no proof.
        """
        bounces = len(identity[2]) + len(identity[3])
        if bounces > self.depth:
            return Proof("beyond depth", f"{bounces} bounces, depth {self.depth}")
        legs = self._legs(identity, cycle)
        conditions = [condition for leg in legs for condition in self._conditions(leg)]
        broken = [c for c in conditions if c.margin <= -EDGE_TOLERANCE]
        close = [c for c in conditions if abs(c.margin) < EDGE_TOLERANCE]
        shortest = min(float(np.linalg.norm(np.diff(leg.points, axis=0), axis=1).min()) for leg in legs)
        if broken:
            only_hidden = all(c.reason == "occluded" for c in broken)
            return Proof("occluded" if only_hidden else "", broken[0].text, -broken[0].margin)
        if side == "analytic" and shortest < self.shortest:
            return Proof("short segment", f"segment of {1e3 * shortest:.4f} mm", shortest)
        if close:
            closest = min(close, key=lambda c: abs(c.margin))
            reason = "in a face" if closest.reason == "in a face" else "edge"
            return Proof(reason, closest.text, abs(closest.margin))
        return Proof("", f"all its conditions hold, shortest segment {1e3 * shortest:.4f} mm")

    def _legs(self, identity: Identity, cycle: int) -> list[Leg]:
        """The path's legs on unbounded planes, each from its device to the far end."""
        _, landmark, tx_names, rx_names = identity
        tx_walls, rx_walls = ([self.names.index(n) for n in names] for names in (tx_names, rx_names))
        tx, rx = self.trajectory.tx[cycle], self.trajectory.rx[cycle]
        if not landmark:
            return [unfolded(self.facets, tx_walls, tx, rx)]
        point = self.scene.landmark_positions[self.scene.landmarks.index(landmark)]
        return [unfolded(self.facets, tx_walls, tx, point), unfolded(self.facets, rx_walls[::-1], rx, point)]

    def _conditions(self, leg: Leg) -> list[Condition]:
        """All that a leg needs, with margins from the geometry."""
        found = [Condition("in a face", f"{abs(leg.clearance):.2e} m off the plane of a bounce", leg.clearance)]
        found += [self._on_wall(bounce, int(wall)) for bounce, wall in zip(leg.points[1:-1], leg.walls, strict=True)]
        for number in range(len(leg.points) - 1):
            found += self._free(leg, number)
        panel = self.scene.ris
        if panel is not None and np.array_equal(leg.points[-1], panel.center):
            height = float((leg.points[-2] - leg.points[-1]) @ panel.spec.normal)
            found.append(Condition("in a face", f"{height:.2e} m in front of the panel's plane", height))
        return found

    def _on_wall(self, bounce: Floats, wall: int) -> Condition:
        """The bounce point lies on the wall's triangles, not only in its plane."""
        inside = bool(self.facets.contains(bounce[None], np.array([wall]))[0])
        distance = self._outline_distance(bounce, wall)
        text = f"bounce {distance:.2e} m {'inside' if inside else 'outside'} the outline of {self.names[wall]}"
        return Condition("edge", text, distance if inside else -distance)

    def _free(self, leg: Leg, number: int) -> list[Condition]:
        """No other wall stands across segment `number`: it would have to be crossed, and where it is solid.

        Walls that the segment bounces on do not stand in its way, nor does the host wall before its own panel.
        """
        start, end = leg.points[number], leg.points[number + 1]
        a, b = self.facets.distance(np.stack([start, end]))
        least = np.minimum(np.abs(a), np.abs(b))
        own = {int(w) for w in leg.walls[max(number - 1, 0) : number + 1]}
        own |= {self.host} if number == len(leg.walls) else set()
        found = []
        for wall in set(np.flatnonzero((a * b < 0.0) | (least < EDGE_TOLERANCE))) - own:
            slope = a[wall] - b[wall]
            point = start + (np.clip(a[wall] / slope, 0.0, 1.0) if slope else 0.0) * (end - start)
            solid = self._on_wall(point, int(wall)).margin
            crossed = np.copysign(least[wall], -a[wall] * b[wall])
            where = "inside" if solid > 0.0 else "outside"
            text = f"{self.names[wall]} across a segment, {abs(solid):.2e} m {where} its outline"
            found.append(Condition("occluded", text, -min(solid, float(crossed))))
        return found + self._unshaded(leg, number)

    def _unshaded(self, leg: Leg, number: int) -> list[Condition]:
        """No scatterer's shade stands across segment `number`; the far end's own does not hide it."""
        shades, found = self.facets.shades, []
        for shade, landmark in enumerate(shades.landmark):
            if number == len(leg.walls) and np.array_equal(leg.points[-1], self.scene.landmark_positions[landmark]):
                continue
            margin = shades.margin(leg.points[number], leg.points[number + 1], shade)
            text = f"shade of {self.scene.landmarks[landmark]}, {abs(margin):.2e} m {'in' if margin < 0 else 'out'}side"
            found.append(Condition("occluded", text, margin))
        return found

    def _outline_distance(self, point: Floats, wall: int) -> float:
        """Distance [m] of a point (3,) from a wall's outline."""
        return float(distance_to_edges(point[None], self.edges[self.wall_of_edge == wall])[0])


def unfolded(facets: Facets, walls: list[int], device: Floats, far: Floats) -> Leg:
    """Draw a leg on unbounded planes by mirroring the far end."""
    images = [far]
    for wall in walls[::-1]:
        images.append(mirror(images[-1], facets.normal[wall], facets.offset[wall]))
    points, clearance = [device], np.inf
    for wall, image in zip(walls, images[:0:-1], strict=True):
        a = float(facets.normal[wall] @ points[-1] - facets.offset[wall])
        b = float(facets.normal[wall] @ image - facets.offset[wall])
        clearance = min(clearance, np.copysign(min(abs(a), abs(b)), -a * b))
        fraction = a / (a - b) if a != b else 0.5
        points.append(points[-1] + fraction * (image - points[-1]))
    return Leg(np.array([*points, far]), np.array(walls, dtype=np.int64), float(clearance))
