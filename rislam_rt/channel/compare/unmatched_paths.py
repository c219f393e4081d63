"""Explanations why a channel lacks a path that the other has, from mirror images in float64, without either channel's
own visibility tests."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.image_source.wall_facets import WallFacets, build_facets
from rislam_rt.channel.occluders import ALONE
from rislam_rt.channel.walls import build_walls
from rislam_rt.constants import RAY_OFFSET
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.plane_segmentation import FLOAT32_ROUNDING
from rislam_rt.geometry.planes import mirror
from rislam_rt.geometry.triangles import distance_to_edges, outline_edges
from rislam_rt.model import PathKind, Scene, Trajectory

Identity = tuple[int, str, tuple[str, ...], tuple[str, ...]]
"""Identity of a path by names: kind, landmark, Tx walls, Rx walls."""
SHORTEST_SEGMENT = 10.07e-3
"""[m] Sionna RT drops a path with a segment below 1 cm; in float32 the limit bites up to this length."""
HIDDEN = ("occluded", "close surfaces")
"""Reasons of failure by something in the way, rather than by a missing reflection."""
ROUNDINGS = 8.0
"""Number of float32 roundings between the coordinates and a mirror image or a hit."""


class Explanation(NamedTuple):
    """Explanation of a missing path: reason (empty if none was found), what was computed, length [m] it rests on."""

    reason: str
    text: str
    size: float = 0.0


class ExistenceCondition(NamedTuple):
    """Condition for a path to exist: it holds where `margin` [m] is positive. `reason` names its failure.

    Where the margin is smaller than `reach` [m], float32 cannot tell.
    """

    reason: str
    text: str
    margin: float
    reach: float


class UnfoldedLeg(NamedTuple):
    """One specular leg constructed on the walls' unbounded planes, without visibility tests."""

    points: Floats
    """(d + 2, 3) [m] device, bounces, far end."""
    walls: Integers
    """(d,) numbers of the walls."""
    clearance: float
    """[m] smallest distance of a segment's ends from the plane it bounces on, negative where the two neighbours of a
    bounce do not lie on the same side: then there is no such reflection."""
    shift: Floats
    """(d + 1,) [m] largest lateral error of the tracer's float32 ray along each segment."""
    panel: int
    """Number of the panel at its end, -1 for none."""


@dataclass(frozen=True, slots=True, eq=False)
class DifferenceExplainer:
    """Explains paths that only one of two compared channels has, by conditions computed from scene and poses."""

    scene: Scene
    trajectory: Trajectory
    depth: int
    """Number of bounces up to which both channels search."""
    shortest: float
    """[m] length below which the tracer loses segments."""
    names: tuple[str, ...]
    facets: WallFacets
    edges: Floats
    """(E, 2, 3) [m] outline edges of all walls."""
    wall_of_edge: Integers
    """(E,) wall of each edge."""
    tilt: Floats
    """(W,) [rad] error by float32 rounding of the normal of each wall's largest triangle, which the tracer mirrors
    in."""
    center: Floats
    """(3,) [m] middle of the room, the origin of the tracer's coordinates."""
    hosts: tuple[int, ...]
    """The wall behind each panel, -1 without one."""

    @classmethod
    def of(cls, scene: Scene, trajectory: Trajectory, depth: int, shortest: float) -> "DifferenceExplainer":
        """Prepare the explanation of differences between two channels of a scene at the poses of a trajectory."""
        walls = build_walls(scene)
        facets = build_facets(walls)
        outlines = [outline_edges(facets.corners[a:b]) for a, b in zip(facets.first, facets.first[1:], strict=False)]
        owner = np.repeat(np.arange(len(walls)), [len(o) for o in outlines])
        edges = np.concatenate([np.zeros((0, 2, 3)), *outlines])
        center = scene.bounds.mean(axis=0)
        largest, altitude = walls.largest_triangles()
        extent = np.abs(walls.triangles[largest] - center).max(axis=(1, 2), initial=0.0)
        tilt = 2.0 * FLOAT32_ROUNDING * extent / np.maximum(altitude, np.finfo(np.float64).tiny)
        return cls(scene, trajectory, depth, shortest, walls.names, facets, edges, owner, tilt, center, walls.hosts)

    def label(self, identity: Identity) -> str:
        """Identity of an unmatched path in words, Rx walls after the bar."""
        kind, landmark, tx, rx = identity
        text = " ".join([PathKind(kind).name, *tx, *([landmark] if landmark else [])])
        return f"{text} | {' '.join(rx)}" if rx else text

    def explain(self, identity: Identity, cycle: int, side: str) -> Explanation:
        """Explain why a path that `side` has in a cycle is missing in the other channel.

        A path exists where all its conditions hold. It is proved absent by an object that stands clearly in the way
        of reflections in order, undecidable where a margin is below what float32 leaves open there
        (`UnfoldedLeg.shift`) and no other condition clearly fails, and cut by the tracer where it exists with too short
        a segment. All else is no proof.
        """
        bounces = len(identity[2]) + len(identity[3])
        if bounces > self.depth:
            return Explanation("beyond depth", f"{bounces} bounces, depth {self.depth}")
        legs = self._legs(identity, cycle)
        conditions = [condition for leg in legs for condition in self._conditions(leg)]
        broken = [c for c in conditions if c.margin <= -c.reach]
        close = [c for c in conditions if abs(c.margin) < c.reach]
        shortest = min(float(np.linalg.norm(np.diff(leg.points, axis=0), axis=1).min()) for leg in legs)
        if broken:
            only_hidden = all(c.reason in HIDDEN for c in broken)
            return Explanation("occluded" if only_hidden else "", broken[0].text, -broken[0].margin)
        if side == "analytic" and shortest < self.shortest:
            return Explanation("short segment", f"segment of {1e3 * shortest:.4f} mm", shortest)
        if close:
            closest = min(close, key=lambda c: abs(c.margin) / c.reach)
            text = f"{closest.text}; float32 leaves {closest.reach:.2e} m"
            return Explanation("edge" if closest.reason == "occluded" else closest.reason, text, abs(closest.margin))
        return Explanation("", f"all its conditions hold, shortest segment {1e3 * shortest:.4f} mm")

    def _legs(self, identity: Identity, cycle: int) -> list[UnfoldedLeg]:
        """Legs of an unmatched path, on the walls' unbounded planes, each from its device to the far end."""
        _, landmark, tx_names, rx_names = identity
        tx_walls, rx_walls = ([self.names.index(n) for n in names] for names in (tx_names, rx_names))
        tx, rx = self.trajectory.tx[cycle], self.trajectory.rx[cycle]
        if not landmark:
            return [self._unfolded(tx_walls, tx, rx)]
        number = self.scene.landmarks.index(landmark)
        point, panel = self.scene.landmark_positions[number], self.scene.panel_number(number)
        return [self._unfolded(tx_walls, tx, point, panel), self._unfolded(rx_walls[::-1], rx, point, panel)]

    def _unfolded(self, walls: list[int], device: Floats, far: Floats, panel: int = -1) -> UnfoldedLeg:
        """Construct a leg of an unmatched path on the walls' unbounded planes by mirroring the far end."""
        facets, images = self.facets, [far]
        for wall in walls[::-1]:
            images.append(mirror(images[-1], facets.normal[wall], facets.offset[wall]))
        points, clearance = [device], np.inf
        for wall, image in zip(walls, images[:0:-1], strict=True):
            a = float(facets.normal[wall] @ points[-1] - facets.offset[wall])
            b = float(facets.normal[wall] @ image - facets.offset[wall])
            clearance = min(clearance, np.copysign(min(abs(a), abs(b)), -a * b))
            fraction = a / (a - b) if a != b else 0.5
            points.append(points[-1] + fraction * (image - points[-1]))
        drawn = np.array([*points, far])
        shift = self._shifts(drawn, np.array(images[::-1]), walls)
        return UnfoldedLeg(drawn, np.array(walls, dtype=np.int64), float(clearance), shift, panel)

    def _shifts(self, points: Floats, images: Floats, walls: list[int]) -> Floats:
        """Lateral errors (d + 1,) [m] of a float32 ray along a leg, for which the tracer may lack an unmatched path."""
        # The image method sends a ray from the last point found, moved off its surface by `RAY_OFFSET` of (1 m + its
        # largest coordinate), to the image, moved alike. In between, the ray is off by at most the weighted mean of
        # what its ends are off. An image adds the rounding of its own coordinates and the tilt of the planes it came
        # about by.
        size = [1.0 + np.abs(p - self.center).max(axis=-1) for p in (points, images)]
        rounding = ROUNDINGS * FLOAT32_ROUNDING
        shift, off = np.zeros(len(images)), rounding * float(size[0][0])
        for segment, image in enumerate(images):
            run = np.linalg.norm(points[segment : segment + 2] - image, axis=-1)
            tilted = sum(self.tilt[wall] for wall in walls[segment:]) * 2.0 * float(run[0])
            start = off + RAY_OFFSET * float(size[0][segment]) * (segment > 0)
            moved = RAY_OFFSET * (segment < len(walls))  # the far end itself is not moved
            end = (moved + rounding) * float(size[1][segment]) + tilted
            share = float(run[1] / run[0]) if run[0] > 0.0 else 0.0
            off = share * start + (1.0 - share) * end
            shift[segment] = max(start, off)
        return shift

    def _conditions(self, leg: UnfoldedLeg) -> list[ExistenceCondition]:
        """All conditions for a leg of an unmatched path to exist, with margins from the geometry."""
        reach = float(leg.shift.max())
        found = [
            ExistenceCondition(
                "in a face", f"{abs(leg.clearance):.2e} m off the plane of a bounce", leg.clearance, reach
            )
        ]
        for number in range(len(leg.walls)):
            found += self._on_wall(leg, number)
        for number in range(len(leg.points) - 1):
            found += self._free(leg, number)
        if leg.panel >= 0:
            panel = self.scene.panels[leg.panel]
            height = float((leg.points[-2] - leg.points[-1]) @ panel.spec.normal)
            found.append(
                ExistenceCondition("in a face", f"{height:.2e} m in front of the panel's plane", height, reach)
            )
        return found

    def _on_wall(self, leg: UnfoldedLeg, number: int) -> list[ExistenceCondition]:
        """Conditions of an unmatched path: bounce `number` of a leg is on its wall, and on none that covers it."""
        wall, bounce = int(leg.walls[number]), leg.points[number + 1]
        found = []
        for surface, sign in ((wall, 1.0), *((int(upper), -1.0) for upper in self.facets.over[wall])):
            inside = self._inside(bounce, bounce - leg.points[number], surface)
            where = "inside" if inside > 0.0 else "outside"
            text = f"ray to the bounce {abs(inside):.2e} m {where} the outline of {self.names[surface]}"
            found.append(ExistenceCondition("edge", text, sign * inside, float(leg.shift[number])))
        return found

    def _free(self, leg: UnfoldedLeg, number: int) -> list[ExistenceCondition]:
        """Conditions of an unmatched path: no wall or occluder stands across segment `number` of a leg."""
        # Walls that the segment bounces on, and those in one plane with them, do not stand in its way, nor does the
        # host wall before its own panel. A wall that is solid where a segment ends within float32 of it is too close to
        # tell.
        start, end, reach = leg.points[number], leg.points[number + 1], float(leg.shift[number])
        a, b = self.facets.distance(np.stack([start, end]))
        least = np.minimum(np.abs(a), np.abs(b))
        own = {int(self.facets.plane[w]) for w in leg.walls[max(number - 1, 0) : number + 1]}
        if number == len(leg.walls) and leg.panel >= 0 and self.hosts[leg.panel] >= 0:
            own.add(int(self.facets.plane[self.hosts[leg.panel]]))
        found = []
        for wall in np.flatnonzero((a * b < 0.0) | (least < reach)):
            if int(self.facets.plane[wall]) in own:
                continue
            slope = a[wall] - b[wall]
            point = start + (np.clip(a[wall] / slope, 0.0, 1.0) if slope else 0.0) * (end - start)
            solid = self._inside(point, end - start, int(wall))
            crossed = float(np.copysign(least[wall], -a[wall] * b[wall]))
            where = "inside" if solid > 0.0 else "outside"
            text = f"{self.names[wall]} across a segment, {abs(solid):.2e} m {where} its outline"
            if solid >= reach and abs(crossed) < reach:
                text = f"{self.names[wall]} {abs(crossed):.2e} m off a segment's end"
                found.append(ExistenceCondition("close surfaces", text, -crossed, reach))
            else:
                found.append(ExistenceCondition("occluded", text, -min(solid, crossed), reach))
        return found + self._unoccluded(leg, number)

    def _unoccluded(self, leg: UnfoldedLeg, number: int) -> list[ExistenceCondition]:
        """Conditions of an unmatched path: no occluder, the far end's own apart, across segment `number`."""
        occluders, found = self.facets.occluders, []
        for shade, landmark in enumerate(occluders.landmark):
            last = number == len(leg.walls) and landmark != ALONE
            if last and np.array_equal(leg.points[-1], self.scene.landmark_positions[landmark]):
                continue
            margin = occluders.margin(leg.points[number], leg.points[number + 1], shade)
            text = f"shade of {occluders.names[shade]}, {abs(margin):.2e} m {'in' if margin < 0 else 'out'}side"
            found.append(ExistenceCondition("occluded", text, margin, float(leg.shift[number])))
        return found

    def _inside(self, point: Floats, ray: Floats, wall: int) -> float:
        """Distance [m] of an unmatched path's `ray` (3,) through a point (3,) of a wall from the wall's outline,
        negative outside."""
        # It is measured across the ray, as are a ray's errors.
        inside = bool(self.facets.contains(point[None], np.array([wall]))[0])
        along = unit(ray)
        edges = self.edges[self.wall_of_edge == wall] - point
        seen = edges - (edges @ along)[..., None] * along
        distance = float(distance_to_edges(np.zeros((1, 3)), seen)[0])
        return distance if inside else -distance
