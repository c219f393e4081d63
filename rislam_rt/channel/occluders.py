"""Occluders: meshes, of scatterers or alone, that hide what lies behind them and reflect nothing."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, cross, distinct_rows
from rislam_rt.geometry.triangles import edge_ends, triangle_edges, triangle_planes
from rislam_rt.model import Scene

ALONE = -2
"""Landmark number of an occluder that belongs to no scatterer (-1 stands for a leg without landmark)."""
SEAM = 1e-9
"""[m] Triangles reach this far over their edges, so that no ray slips between two that share one (float64 rounding)."""
_BLOCK = 1_000_000
"""Segment-triangle pairs tested at once: bounds the memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Occluders:
    """Meshes of S occluders, which hide paths and reflect nothing: T triangles, one occluder after the other."""

    names: tuple[str, ...]
    """(S,) names of the occluders."""
    landmark: Integers
    """(S,) number of the scatterer in the order of `scene.landmarks`, `ALONE` without one."""
    first: Integers
    """(S + 1,) triangles of occluder s are first[s] : first[s + 1]."""
    triangles: Floats
    """(T, 3, 3) [m] corners of the triangles."""
    center: Floats
    """(S, 3) [m] middle of a ball around each occluder."""
    radius: Floats
    """(S,) [m] of that ball."""

    def __len__(self) -> int:
        return len(self.landmark)

    def of(self, shade: int) -> Floats:
        """Triangles (t, 3, 3) [m] of one occluder."""
        return self.triangles[self.first[shade] : self.first[shade + 1]]

    def hides(self, start: Floats, end: Floats, spared: int = -1) -> Booleans:
        """Which segments from `start` to `end` (N, 3) [m] an occluder hides, but for `spared`'s own."""
        hidden = np.zeros(len(start), dtype=np.bool_)
        for shade in np.flatnonzero(self.landmark != spared):
            near = _distance_to_segments(self.center[shade], start, end) <= self.radius[shade]
            rows = np.flatnonzero(near & ~hidden)
            triangles = self.of(int(shade)) - self.center[shade]  # about its middle: finest rounding
            step = max(1, _BLOCK // len(triangles))
            for part in (rows[i : i + step] for i in range(0, len(rows), step)):
                hidden[part] = _crosses(start[part] - self.center[shade], end[part] - self.center[shade], triangles)
        return hidden

    def margin(self, start: Floats, end: Floats, shade: int) -> float:
        """Distance [m] of a segment (3,) to (3,) from an occluder's silhouette, negative if the occluder hides it.

        The silhouette: edges of one triangle alone, and of two of which only one faces the segment's start.
        """
        middle = self.center[shade]
        triangles, start, end = self.of(shade) - middle, start - middle, end - middle
        distance = _distance_between(start, end, _outline(triangles, end - start))
        return -distance if _crosses(start[None], end[None], triangles)[0] else distance


def build_occluders(scene: Scene) -> Occluders:
    """Collect the occluding meshes of a scene's scatterers, and those that stand alone."""
    owners = [n for n, scatterer in enumerate(scene.scatterers) if scatterer.shade is not None]
    meshes = [s.shade.triangles for s in scene.scatterers if s.shade is not None]
    names = [scene.scatterers[n].name for n in owners] + [shade.name for shade in scene.occluders]
    owners += [ALONE] * len(scene.occluders)
    meshes += [shade.triangles for shade in scene.occluders]
    center = np.array([(m.min(axis=(0, 1)) + m.max(axis=(0, 1))) / 2.0 for m in meshes]).reshape(-1, 3)
    reach = [np.linalg.norm(m - c, axis=-1).max() for m, c in zip(meshes, center, strict=True)]
    return Occluders(
        tuple(names), np.array(owners, dtype=np.int64), np.cumsum([0] + [len(m) for m in meshes]),
        np.concatenate([np.zeros((0, 3, 3)), *meshes]), center, np.array(reach, dtype=np.float64) + SEAM,
    )  # fmt: skip


def _crosses(start: Floats, end: Floats, triangles: Floats) -> Booleans:
    """Which segments (N, 3) pass through any of an occluder's triangles (T, 3, 3)."""
    # Side of a line against the three edges by Pluecker coordinates: the products of an edge that two triangles share
    # differ in sign alone.
    normal, offset = triangle_planes(triangles)
    a, b = start @ normal.T - offset, end @ normal.T - offset
    direction, moment = end - start, cross(start, end)
    length = np.linalg.norm(direction, axis=-1)[:, None]
    least, most = np.full(a.shape, np.inf), np.full(a.shape, -np.inf)
    for corner in range(3):
        tail, head = triangles[:, corner], triangles[:, (corner + 1) % 3]
        edge = head - tail
        side = direction @ cross(tail, head).T + moment @ edge.T
        side /= np.maximum(length * np.linalg.norm(edge, axis=-1), np.finfo(np.float64).tiny)
        least, most = np.minimum(least, side), np.maximum(most, side)
    inside: Booleans = (least >= -SEAM) | (most <= SEAM)
    return np.logical_or.reduce((a * b < 0.0) & inside, axis=1)


def _distance_to_segments(point: Floats, start: Floats, end: Floats) -> Floats:
    """Distance (N,) [m] of an occluder's point (3,) from segments `start` to `end` (N, 3)."""
    along = end - start
    square = np.einsum("ni,ni->n", along, along)
    fraction = np.einsum("ni,ni->n", point - start, along) / np.where(square > 0.0, square, 1.0)
    return np.linalg.norm(start + np.clip(fraction, 0.0, 1.0)[:, None] * along - point, axis=-1)


def _outline(triangles: Floats, direction: Floats) -> Floats:
    """Silhouette edges (E, 2, 3) [m] of an occluder's triangles (T, 3, 3) along a direction, and its open edges."""
    normal, _ = triangle_planes(triangles)
    ahead = np.repeat(normal @ direction > 0.0, 3)
    edges = triangle_edges(triangles)
    ends = edge_ends(edges)
    first, which, count = distinct_rows(ends)
    turned = np.bincount(which, weights=ahead)
    return edges[first[(count == 1) | ((turned > 0) & (turned < count))]]


def _distance_between(start: Floats, end: Floats, edges: Floats) -> float:
    """Least distance [m] of a segment (3,) to (3,) from an occluder's edges (E, 2, 3), infinite without any."""
    along, across, gap = end - start, edges[:, 1] - edges[:, 0], start - edges[:, 0]
    aa, ee = along @ along, np.einsum("ei,ei->e", across, across)
    ae, ag, eg = across @ along, gap @ along, np.einsum("ei,ei->e", across, gap)
    skew = aa * ee - ae**2
    best = np.full(len(edges), np.inf)
    # where both lines come closest, and each end against the other line: the least of them is the distance
    starts = [np.where(skew > 0.0, (ae * eg - ee * ag) / np.where(skew > 0.0, skew, 1.0), 0.0)]
    starts += [np.zeros(len(edges)), np.ones(len(edges)), -ag / (aa or 1.0), (ae - ag) / (aa or 1.0)]
    for s in starts:
        s = np.clip(s, 0.0, 1.0)
        t = np.clip((ae * s + eg) / np.where(ee > 0.0, ee, 1.0), 0.0, 1.0)
        apart = gap + s[:, None] * along - t[:, None] * across
        best = np.minimum(best, np.linalg.norm(apart, axis=-1))
    return float(best.min(initial=np.inf))
