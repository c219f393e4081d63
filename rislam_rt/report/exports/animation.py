"""Animation of a run as a GIF: the room from above, and beside it a close-up of the agent."""

import io
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rislam_rt.arrays import Floats
from rislam_rt.model import SchemeResult, SlamResult
from rislam_rt.progress import Tell, tell_nobody
from rislam_rt.report.drawing_geometry import ellipse
from rislam_rt.report.map_from_above import draw_plan
from rislam_rt.report.style import TRUTH, SchemeStyle, close_up, fix_layout, scheme_styles, styled
from rislam_rt.report.view.room_data import spread
from rislam_rt.report.view.run_data import KNOWN
from rislam_rt.storage.files import MARK

FRAMES = 80
"""Number of frames of an animation."""
FRAME_MS, LAST_MS = 100, 2500
"""[ms] Duration of a frame, and of the last one."""
WIDTH, DPI = 8.0, 80
"""Width of a frame [inch], and dots per inch."""
LEAST_HALF = 0.05
"""[m] Least half width of the close-up."""
HALVES = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
"""[m] Half widths of the close-up, of which the least is taken that holds 95 % of the errors."""


def gif_bytes(result: SlamResult, tell: Tell = tell_nobody) -> bytes:
    """Draw the animation of a run and encode it as GIF; `tell` reports progress after every frame."""
    from PIL import Image

    rows = spread(len(result.scene.agent), FRAMES)
    pictures = []
    with styled():
        figure, room, near = _empty_frame(result)
        canvas: Any = FigureCanvasAgg(figure)
        for number, cycle in enumerate(rows):
            moving = _draw_moment(room, near, result, int(cycle))
            canvas.draw()
            pixels = np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
            pictures.append(Image.fromarray(pixels).quantize(256))
            for artist in moving:
                artist.remove()
            tell("frames", number + 1, len(rows))
    target = io.BytesIO()
    durations = [FRAME_MS] * (len(pictures) - 1) + [LAST_MS]
    pictures[0].save(
        target, format="GIF", save_all=True, append_images=pictures[1:], duration=durations, loop=0, optimize=True,
        comment=MARK,
    )  # fmt: skip
    return target.getvalue()


def _empty_frame(result: SlamResult) -> tuple[Figure, Axes, Axes]:
    """Draw all of the animation that does not move; return figure, map axis and close-up axis."""
    low, high = result.scene.bounds
    aspect = float(np.clip((high[1] - low[1]) / (high[0] - low[0]), 0.35, 1.6))
    figure = Figure(figsize=(WIDTH, 0.6 * WIDTH * aspect + 0.9), dpi=DPI)
    room, near = figure.subplots(1, 2, width_ratios=(2.0, 1.0))
    draw_plan(room, result.scene)
    room.set(xlabel="x [m]", ylabel="y [m]")
    room.set_title(result.scene.name, weight="bold")
    styles = scheme_styles(result.schemes)
    for name in result.schemes:
        near.plot([], [], color=styles[name].colour, marker=styles[name].marker, ms=5, lw=2.0, label=name)
    near.plot([], [], "o", color=TRUTH, ms=5, label="agent")
    half = _half_width(result)
    near.plot(*result.scene.agent.position[:, :2].T, color=TRUTH, lw=5.0, alpha=0.2)
    close_up(near, result.scene.agent.position[0, :2], half)
    near.grid(False)
    near.set_title(f"{200.0 * half:.0f} cm wide", fontsize=9)
    near.legend(loc="upper center", bbox_to_anchor=(0.5, -0.03), fontsize=9)
    fix_layout(figure)
    return figure, room, near


def _half_width(result: SlamResult) -> float:
    """Half width [m] of the animation's close-up, for the errors of a run."""
    truth = result.scene.agent.position
    errors = [np.linalg.norm(scheme.position - truth, axis=1) for scheme in result.schemes.values()]
    need = 1.3 * float(np.quantile(np.concatenate(errors), 0.95))
    return next((half for half in HALVES if half >= max(need, LEAST_HALF)), HALVES[-1])


def _draw_moment(room: Axes, near: Axes, result: SlamResult, cycle: int) -> list[Artist]:
    """Draw all that moves in one frame of the animation, and return it to be removed for the next."""
    scene, half = result.scene, _half_width(result)
    truth = scene.agent.position[cycle, :2]
    moving: list[Artist] = []
    for axis in (room, near):
        moving += axis.plot(*truth, "o", color=TRUTH, ms=6, zorder=8)
    styles = scheme_styles(result.schemes)
    for name, scheme in result.schemes.items():
        moving += _draw_belief(room, near, scheme, cycle, styles[name])
    near.set(xlim=(truth[0] - half, truth[0] + half), ylim=(truth[1] - half, truth[1] + half))
    room.set_title(f"{scene.name}, t = {scene.agent.elapsed[cycle]:.1f} s", weight="bold")
    return moving


def _draw_belief(room: Axes, near: Axes, scheme: SchemeResult, cycle: int, style: SchemeStyle) -> list[Artist]:
    """Frame of an animation: a scheme's estimated trajectory, 2 sigma ellipse and landmarks up to a cycle."""
    colour, done = style.colour, scheme.position[: cycle + 1, :2]
    ring = ellipse(done[-1], scheme.covariance[cycle, :2, :2])
    moving: list[Artist] = []
    for axis in (room, near):
        moving += axis.plot(*done.T, color=colour, lw=1.4, zorder=6)
        moving += axis.plot(*ring.T, color=colour, lw=1.0, zorder=6)
    moving += near.plot(*done[-1], style.marker, color=colour, ms=5, zorder=7)
    points = scheme.held[cycle] & (scheme.parent < 0)
    known = points & (scheme.ris_probability[cycle] > KNOWN)
    for shown, marker in ((known, "s"), (points & ~known, "x")):
        place: Floats = scheme.landmark_position[cycle, shown, :2]
        moving += room.plot(*place.T, marker, color=colour, mfc="none", ms=8, mew=1.8, zorder=7)
    return moving
