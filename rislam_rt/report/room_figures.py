"""Figures of a room in three dimensions, with the paths of one cycle, or beside its plan from above."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rislam_rt.arrays import Floats
from rislam_rt.channel.walls import build_walls
from rislam_rt.model import PathKind, Paths, Scene
from rislam_rt.report.drawing_geometry import wall_edges
from rislam_rt.report.map_from_above import SHADE, WALL_NAME, draw_plan, name_walls, wall_places
from rislam_rt.report.style import KIND, TRUTH, WALL, fix_layout, save_figure, styled

LABEL = np.array([0.02, 0.0, 0.014])
"""Offset of an object's name in the three-dimensional figure, relative to the room's size."""
ZOOMS = (0.9, 0.8, 0.7, 0.6)
"""Scales of the three-dimensional view beside a plan, of which the first is taken whose axis labels have room."""


def draw_paths(scene: Scene, paths: Paths, gain: Floats, cycle: int, title: str) -> Figure:
    """Draw a room in three dimensions with the paths of one cycle that have at most one wall bounce.

    `gain` (P,) are the magnitudes of the path gains in that cycle.
    """
    with styled():
        figure = Figure(figsize=(9.0, 6.4))
        figure.set_layout_engine("none")
        axis: Any = figure.add_axes((-0.12, 0.0, 1.24, 1.08), projection="3d", computed_zorder=False)
        _draw_room_3d(axis, scene)
        handles = [_draw_class(axis, scene, paths, gain, cycle, kind) for kind in PathKind]
        _draw_objects_3d(axis, scene, cycle)
        figure.text(0.02, 0.955, title, weight="bold", size=11)
        shown = [handle for handle in handles if handle is not None]
        figure.legend(handles=shown, loc="lower center", ncols=2, fontsize=9)
    return figure


def draw_scene(scene: Scene, path: Path) -> Path:
    """Draw a scene from above and in three dimensions to a file, and return the file's path."""
    with styled():
        figure = Figure(figsize=(11.0, 5.0))
        flat = figure.add_subplot(1, 2, 1)
        draw_plan(flat, scene)
        name_walls(flat, scene)
        flat.set(xlabel="x [m]", ylabel="y [m]")
        flat.set_title(f"{scene.name} from above", weight="bold")
        axis: Any = figure.add_subplot(1, 2, 2, projection="3d", computed_zorder=False)
        _draw_room_3d(axis, scene)
        for name, point in wall_places(scene):
            axis.text(*point, name, fontsize=7, color=WALL_NAME, ha="center", zorder=4)
        _draw_objects_3d(axis, scene, 0)
        for zoom in ZOOMS:
            axis.set_box_aspect(scene.bounds[1] - scene.bounds[0], zoom=zoom)
            fix_layout(figure)
            if axis.get_tightbbox().x1 <= figure.bbox.x1:
                break
        return save_figure(figure, path)


def _draw_room_3d(axis: Any, scene: Scene) -> None:
    """Draw walls, floor and occluders of a room in three dimensions."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    walls = build_walls(scene)
    low, high = scene.bounds
    floor = walls.triangles[np.abs(walls.triangles[:, :, 2] - low[2]).max(axis=1) < 1e-6]
    if len(floor):
        axis.add_collection3d(Poly3DCollection(list(floor), facecolor="#f1f1f1", edgecolor="none", zorder=0))
    axis.add_collection3d(Line3DCollection(list(wall_edges(walls)), colors=WALL, lw=1.0, zorder=1))
    axis.add_collection3d(Poly3DCollection(list(walls.occluders.triangles), facecolor=SHADE, alpha=0.3, zorder=1))
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axis.set_box_aspect(high - low, zoom=1.0)
    axis.view_init(elev=24.0, azim=-62.0)
    axis.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axis.grid(False)
    for side in (axis.xaxis, axis.yaxis, axis.zaxis):
        side.set_pane_color((1.0, 1.0, 1.0, 0.0))
        side.line.set_color((0.0, 0.0, 0.0, 0.0))


def _draw_objects_3d(axis: Any, scene: Scene, cycle: int) -> None:
    """Draw trajectory, agent, scatterers and panels in three dimensions."""
    path = scene.agent.position
    label = LABEL * float(np.max(scene.bounds[1] - scene.bounds[0]))
    axis.plot(*path.T, color=TRUTH, lw=2.0, alpha=0.3, zorder=3)
    axis.plot(*path[cycle], "o", color=TRUTH, ms=7, zorder=9)
    axis.text(*(path[cycle] - 3.0 * label * np.array([0.0, 0.0, 1.0])), "agent", fontsize=9, zorder=10)
    for scatterer in scene.scatterers:
        axis.plot(*scatterer.position, "o", color=KIND[PathKind.PS], mec=TRUTH, ms=9, zorder=9)
        axis.text(*(scatterer.position + label), scatterer.name, fontsize=9, zorder=10)
    for panel in scene.panels:
        axis.plot(*panel.center, "s", color=KIND[PathKind.RIS], mec=TRUTH, ms=10, zorder=9)
        axis.text(*(panel.center + label), panel.name, fontsize=9, zorder=10)


def _draw_class(axis: Any, scene: Scene, paths: Paths, gain: Floats, cycle: int, kind: PathKind) -> Line2D | None:
    """Draw the paths of one class with at most one wall bounce in a room's figure; return its legend entry."""
    columns = np.flatnonzero((paths.kind == kind) & paths.valid[cycle])
    if not len(columns):
        return None
    walls = np.sum(paths.tx_walls[columns] >= 0, axis=1) + np.sum(paths.rx_walls[columns] >= 0, axis=1)
    shown = columns[walls <= 1]
    strong = kind in (PathKind.PS, PathKind.RIS)
    for path in shown:
        line = path_points(scene, paths, cycle, int(path))
        axis.plot(*line.T, color=KIND[kind], lw=2.4 if strong else 1.1, alpha=0.95 if strong else 0.7,
                  zorder=7 if strong else 5)  # fmt: skip
    level = 20.0 * np.log10(max(float(gain[columns].max()), 1e-20))
    label = f"{kind.name}: {len(shown)} of {len(columns)} shown, strongest {level:.0f} dB"
    return Line2D([], [], color=KIND[kind], lw=2.4 if strong else 1.4, label=label)


def path_points(scene: Scene, paths: Paths, cycle: int, path: int) -> Floats:
    """Points (V + 2, 3) [m] of one path in a cycle, for drawing it in a room: Tx, interaction points, Rx."""
    count = int(paths.num_vertices[path])
    inner = paths.vertices[cycle, path, :count]
    return np.concatenate([scene.agent.tx[cycle][None], inner, scene.agent.rx[cycle][None]])
