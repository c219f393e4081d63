"""Figure of a run's map from above: room, trajectory, landmarks and walls, true and estimated, for each scheme."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rislam_rt.arrays import Floats
from rislam_rt.channel.walls import build_walls
from rislam_rt.constants import COPLANAR_OFFSET
from rislam_rt.evaluate import match_planes
from rislam_rt.geometry.triangles import triangle_cross
from rislam_rt.model import Scene, SchemeResult, SlamResult
from rislam_rt.pipeline.scores.summary import landmark_track
from rislam_rt.pipeline.scores.wall_scores import coplanar, wall_surfaces
from rislam_rt.report.drawing_geometry import ellipse, plane_trace, section, wall_edges
from rislam_rt.report.style import TRUTH, WALL, close_up, fix_layout, legend_below, scheme_styles, styled

ABREAST = 3
"""Most maps in a row: more would be wider than a page."""
ZOOM = 0.25
"""Half the width [m] of the close-up of the trajectory's end, unless the error is larger."""
INSET, LEAST_ZOOM = 0.36, 2.0
"""Width of the close-up in the map, as a share of the room's narrower side, and how much a wider one enlarges at
least: an end further off is seen in the map itself."""
PANE, CAPTION = 270.0, 72.0
"""[pt] About the width of a room in the figure, and the least of a close-up with a caption of words below it."""

SHADE = "#d9cdb8"
"""Colour of occluders."""

WALL_NAME, MOST_NAMES = "#54606e", 40
"""Colour of the walls' names, and the largest number of names written."""


def draw_above(result: SlamResult) -> Figure:
    """Draw a run's true and estimated trajectory, landmarks and walls from above, for each scheme, `ABREAST` in a row.

    Each has a close-up of the trajectory's end, but for estimates that end too far off for one.
    """
    schemes = list(result.schemes.values())
    low, high = result.scene.bounds
    aspect = (high[1] - low[1]) / (high[0] - low[0])
    styles = scheme_styles(result.schemes)
    rows = 2 if len(schemes) > 1 else 4  # of the legend, which is wider than one map
    high_up, across = -(-len(schemes) // ABREAST), min(len(schemes), ABREAST)
    with styled():
        figure = Figure(figsize=(5.4 * across, (5.4 * aspect + 0.6) * high_up + 0.4 + 0.2 * rows))
        places = figure.subplots(high_up, across, squeeze=False, sharex=True, sharey=True)
        axes, spare = places.flat[: len(schemes)], places.flat[len(schemes) :]
        final = [scheme.position[-1, :2] - result.scene.agent.position[-1, :2] for scheme in schemes]
        need = 2.5 * np.linalg.norm(final, axis=1)
        near = need <= max(ZOOM, 0.5 * INSET * float(np.min(high[:2] - low[:2])) / LEAST_ZOOM)
        half = max(ZOOM, float(need[near].max(initial=0.0)))
        for axis, scheme, close in zip(axes, schemes, near.tolist(), strict=True):
            draw_plan(axis, result.scene)
            colour = styles[scheme.scheme].colour
            _draw_estimate(axis, result.scene, scheme, colour)
            if close:
                _draw_close_up(axis, result.scene, scheme, half, colour)
            error = float(np.sqrt(np.mean(np.sum((scheme.position - result.scene.agent.position) ** 2, axis=1))))
            length = f"{100.0 * error:.1f} cm" if error < 1.0 else f"{error:.2f} m"
            axis.set_title(f"{scheme.scheme}: agent RMSE {length}", weight="bold")
        for axis in axes[-across:]:
            axis.set_xlabel("x [m]")
            axis.tick_params(labelbottom=True)
        for axis in places[:, 0]:
            axis.set_ylabel("y [m]")
        for axis in spare:
            axis.remove()
        legend_below(figure, _legend(), columns=8 // rows)
        fix_layout(figure)
    return figure


def draw_plan(axis: Axes, scene: Scene) -> None:
    """Draw the plan of a scene from above: walls (thick at the agent's height), occluders, trajectory, landmarks."""
    walls, path = build_walls(scene), scene.agent.position
    cuts = section(walls.triangles, float(path[-1, 2]))
    axis.add_collection(PolyCollection(list(walls.occluders.triangles[..., :2]), color=SHADE, lw=0.5, zorder=0))
    axis.add_collection(LineCollection(list(wall_edges(walls)[..., :2]), colors="#dddddd", lw=0.8, zorder=0))
    axis.add_collection(LineCollection(list(cuts), colors=WALL, lw=3.0, capstyle="round", zorder=1))
    axis.plot(path[:, 0], path[:, 1], color=TRUTH, lw=4.0, alpha=0.25, zorder=2)
    axis.plot(path[0, 0], path[0, 1], "o", color=TRUTH, ms=5, zorder=3)
    axis.annotate("start", (path[0, 0], path[0, 1]), (6, -10), textcoords="offset points", fontsize=9)
    for scatterer in scene.scatterers:
        _mark(axis, scatterer.position, scatterer.name, "o")
    for panel in scene.panels:
        _mark(axis, panel.center, panel.name, "s")
    axis.set_aspect("equal")
    axis.grid(False)


def wall_places(scene: Scene) -> list[tuple[str, Floats]]:
    """Where the map from above names walls: names of a scene's reflectors and the centroid (3,) [m] of the largest wall
    of each."""
    named = [(reflector.name, largest_middle(reflector.triangles)) for reflector in scene.reflectors]
    return named[:MOST_NAMES]


def largest_middle(triangles: Floats) -> Floats:
    """Where the map from above names a wall: centroid (3,) [m] of the largest triangle's plane, of (T, 3, 3)."""
    across = triangle_cross(triangles)
    area = np.linalg.norm(across, axis=1)
    normal = across[np.argmax(area)] / max(float(area.max()), 1e-300)
    height = (triangles - triangles[np.argmax(area), 0]) @ normal
    same = np.abs(height).max(axis=1) < COPLANAR_OFFSET
    return np.asarray(np.average(triangles[same].mean(axis=1), axis=0, weights=area[same]))


def name_walls(axis: Axes, scene: Scene) -> None:
    """Write the names of upright walls beside them in a map from above; floors and ceilings have none."""
    paper = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.8}
    for (name, point), reflector in zip(wall_places(scene), scene.reflectors, strict=False):
        extent = np.ptp(reflector.vertices, axis=0)
        if extent[2] < 0.2 * extent[:2].max():
            continue
        turn = 90.0 if extent[1] > 2.0 * extent[0] else 0.0
        x, y, _ = point.tolist()
        axis.text(
            x, y, name, fontsize=7, color=WALL_NAME, ha="center", va="center", rotation=turn, zorder=3, bbox=paper
        )


def _mark(axis: Axes, point: Floats, name: str, marker: str) -> None:
    """Draw a true landmark in the map from above, its name and height beside it."""
    axis.plot(point[0], point[1], marker, ms=13, mfc="none", mec=TRUTH, mew=1.6, zorder=5)
    paper = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1.0}
    axis.annotate(f"{name}\nz = {point[2]:.1f} m", (point[0], point[1]), (12, 0), textcoords="offset points",
                  va="center", fontsize=9, zorder=7, bbox=paper)  # fmt: skip


def _draw_estimate(axis: Axes, scene: Scene, scheme: SchemeResult, colour: str) -> None:
    """Draw the estimated trajectory, and the walls and landmarks of a scheme's last map that match true ones."""
    axis.plot(scheme.position[:, 0], scheme.position[:, 1], color=colour, lw=1.4, zorder=4)
    walls = build_walls(scene)
    low, high = scene.bounds
    margin = 0.06 * (high - low)
    box = np.stack([low - margin, high + margin])
    surfaces = wall_surfaces(walls, coplanar(walls))
    matched = match_planes(surfaces, scheme.map.wall_normal, scheme.map.wall_offset)
    height = float(scene.agent.position[-1, 2])
    for row in matched[matched >= 0]:
        segment = plane_trace(scheme.map.wall_normal[row], scheme.map.wall_offset[row], height, box)
        if segment is not None:
            axis.plot(segment[:, 0], segment[:, 1], color=colour, lw=1.4, ls=(0, (5, 3)), zorder=4)
    columns = landmark_track(scene, scheme).column[-1]
    rows = [int(np.flatnonzero(scheme.map.ident == scheme.ident[c])[0]) for c in columns if c >= 0]
    for row in rows:
        point = scheme.map.position[row]
        axis.plot(point[0], point[1], "x", color=colour, ms=9, mew=2.2, zorder=6)
        ring = ellipse(point[:2], scheme.map.covariance[row, :2, :2])
        axis.plot(ring[:, 0], ring[:, 1], color=colour, lw=1.0, zorder=6)
    for number, panel in enumerate(scene.panels if len(scene.panels) > 1 else ()):  # of several: held for which
        row = scheme.map.panel_row(number)
        if row >= 0:
            point = scheme.map.position[row]
            axis.annotate(f"held for {panel.name}", (point[0], point[1]), (-8, -14), textcoords="offset points",
                          ha="right", fontsize=8, color=colour, zorder=7)  # fmt: skip


def _draw_close_up(axis: Axes, scene: Scene, scheme: SchemeResult, half: float, colour: str) -> None:
    """Draw a close-up of the trajectory's end beside the map, with the 2 sigma ellipse of the last position."""
    truth, estimate = scene.agent.position[-1, :2], scheme.position[-1, :2]
    low, high = scene.bounds[:, :2]
    # The corner of the room that is farthest from everything drawn holds the close-up.
    busy = np.concatenate([scene.agent.position[:, :2], scene.landmark_positions[:, :2]])
    side = INSET * float(np.min(high - low))
    corners = [np.array([x, y]) for x in (low[0] + 0.03 * side, high[0] - 1.03 * side)
               for y in (low[1] + 0.03 * side, high[1] - 1.03 * side)]  # fmt: skip
    free = [np.min(np.linalg.norm(busy - (corner + 0.5 * side), axis=1)) for corner in corners]
    x, y = corners[int(np.argmax(free))]
    inset = axis.inset_axes((float(x), float(y), side, side), transform=axis.transData, zorder=8)
    inset.plot(*scene.agent.position[:, :2].T, color=TRUTH, lw=4.0, alpha=0.25)
    inset.plot(*truth, "o", color=TRUTH, ms=5)
    inset.plot(*scheme.position[:, :2].T, color=colour, lw=1.4)
    inset.plot(*estimate, "o", color=colour, ms=5)
    inset.plot(*ellipse(estimate, scheme.covariance[-1, :2, :2]).T, color=colour, lw=1.0)
    close_up(inset, truth, half)
    width = f"{200.0 * half:.0f} cm" if half < 0.5 else f"{2.0 * half:.1f} m"
    words = f"end, {width} wide" if PANE * side / float(high[0] - low[0]) >= CAPTION else width
    inset.text(0.5, 0.03, words, fontsize=8.5, ha="center",
               transform=inset.transAxes)  # fmt: skip
    for spine in inset.spines.values():
        spine.set_color("#555555")
    axis.update_datalim([truth - half, truth + half])  # the frame is not cut off at the map's, and would cross it
    axis.autoscale_view()
    axis.indicate_inset_zoom(inset, edgecolor="#555555")


def _legend() -> list[Line2D]:
    """Legend entries of the map from above."""
    grey = "#555555"
    return [
        Line2D([], [], color=WALL, lw=3.0, label="true wall"),
        Line2D([], [], color=grey, lw=1.4, ls=(0, (5, 3)), label="estimated wall"),
        Line2D([], [], color=TRUTH, lw=4.0, alpha=0.25, label="true path"),
        Line2D([], [], color=grey, lw=1.4, label="estimated path"),
        Line2D([], [], ls="", marker="o", mfc="none", mec=TRUTH, ms=10, label="true scatterer"),
        Line2D([], [], ls="", marker="s", mfc="none", mec=TRUTH, ms=10, label="true RIS"),
        Line2D([], [], ls="", marker="x", color=grey, ms=8, mew=2.0, label="estimated landmark, 2σ"),
    ]
