"""Plan of a room as SVG text, a small view from above that a notebook shows of a scene or a result."""

from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, cross

WIDTH, MARGIN = 300.0, 12.0
"""Width and margin [px] of a plan's picture."""
MOST_LINES = 4000
"""Most edges of a room's outline that a plan draws; of a mesh with more it draws none, or a notebook would crawl."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Colours of the trajectories in a plan, one after the other (Okabe and Ito's)."""


class PlanView(NamedTuple):
    """Content of a room's plan, seen from above: outline, named points and named trajectories, all in metres."""

    bounds: Floats
    """(2, 3) lowest and highest corner of the room."""
    outline: Floats
    """(E, 2, 3) line segments."""
    points: Sequence[tuple[str, Floats]]
    """Names and positions (3,) of landmarks."""
    ways: Sequence[tuple[str, Floats]]
    """Names and positions (K, 3) of trajectories."""


def plan_svg(plan: PlanView) -> str:
    """Draw a room's plan as an SVG element; names appear on hovering."""
    low = plan.bounds[0, :2]
    size = np.maximum(plan.bounds[1, :2] - low, 1e-9)
    scale = (WIDTH - 2 * MARGIN) / size.max()
    width, height = size * scale + 2 * MARGIN

    def place(points: Floats) -> str:
        flat = np.atleast_2d(points)[:, :2]
        x, y = MARGIN + (flat[:, 0] - low[0]) * scale, height - MARGIN - (flat[:, 1] - low[1]) * scale
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))

    lines = [f'<polyline points="{place(one)}" stroke="#444" fill="none"/>' for one in plan.outline]
    for number, (name, course) in enumerate(plan.ways):
        shown = course[:: max(1, len(course) // 200)]
        colour = COLOURS[number % len(COLOURS)]
        lines.append(
            f'<polyline points="{place(shown)}" stroke="{colour}" stroke-width="2" fill="none">'
            f"<title>{escape(name)}</title></polyline>"
        )
    for name, point in plan.points:
        x, y = place(point).split(",")
        lines.append(f'<circle cx="{x}" cy="{y}" r="4" fill="#d55e00"><title>{escape(name)}</title></circle>')
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.1f} {height:.1f}" style="background:white">{"".join(lines)}</svg>'
    )


def outline(meshes: Iterable[tuple[Floats, Integers]]) -> Floats:
    """Edges (E, 2, 3) [m] of meshes (vertices and faces) to draw in a plan view: open ones, and those between faces
    that are not in one plane; none if they are more than `MOST_LINES`."""
    found = [_open_edges(vertices, faces) for vertices, faces in meshes]
    edges = np.concatenate(found) if found else np.zeros((0, 2, 3))
    return edges if len(edges) <= MOST_LINES else np.zeros((0, 2, 3))


def _open_edges(vertices: Floats, faces: Integers) -> Floats:
    """Edges (E, 2, 3) of a mesh to draw in a plan view: of one face alone, or between faces not in one plane."""
    points, same = np.unique(np.round(vertices, 6), axis=0, return_inverse=True)
    corners = same.reshape(-1)[faces]
    ends = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, edge = np.unique(ends, axis=0, return_inverse=True)
    first, second, third = (points[corners[:, number]] for number in range(3))
    normal = cross(second - first, third - first)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    normal *= np.where(normal @ (1.0, 1e-3, 1e-6) < 0.0, -1.0, 1.0)[:, None]  # which side is the front does not matter
    total, count = np.zeros((len(edges), 3)), np.bincount(edge.reshape(-1), minlength=len(edges))
    np.add.at(total, edge.reshape(-1), np.repeat(normal, 3, axis=0))
    flat = (count > 1) & (np.linalg.norm(total, axis=1) > 0.9999 * count)
    return np.asarray(points[edges[~flat]], dtype=np.float64)


def html_with(text: str, plan: PlanView) -> str:
    """HTML of a line of text above a room's plan, as a notebook shows it."""
    return f"<div><code>{escape(text)}</code><br>{plan_svg(plan)}</div>"
