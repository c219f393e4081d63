"""The page and figure of the channel validation: how traced and image-source paths agree, by room and pose."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rislam_rt.channel.compare import OneSidedPath, Validation
from rislam_rt.channel.walls import build_walls
from rislam_rt.model import PathKind, Paths
from rislam_rt.report.drawing_geometry import wall_edges
from rislam_rt.report.markdown import table_lines
from rislam_rt.report.room_figures import path_points
from rislam_rt.report.style import KIND, TRUTH, WALL, styled, to_png
from rislam_rt.storage.files import json_file, write_all
from rislam_rt.studies.channel_validation import Certificate, Comparison
from rislam_rt.studies.spec import CompareSpec

COMPARISON, CERTIFICATE = "channel_validation", "figures/path_certificate.png"

_HEAD = [
    "room", "depth", "numbers", "poses", "matched", "explained", "unexplained",
    "beyond limits", "length [m]", "gain [dB]", "phase [rad]", "AoD [rad]", "AoA [rad]", "share of the limit",
]  # fmt: skip

_TEXT = """\
# Channel validation

Every path of every room, traced (Sionna RT) against analytic (image sources, float64), matched by identity: class,
landmark, walls in the order of travel. Written by `rislam-rt` from one run; do not edit.

- *matched*: paths on both sides, counted per pose; *unexplained*: one-sided paths without a proof.
- *explained*: one-sided paths with the proof recomputed from the geometry (`channel/compare/unmatched_paths.py`);
  in brackets the weakest proof, the largest length or distance that any of them rests on.
- both sides look among all wall sequences that the walls' sides allow, except where a room allows more than 2000 on the
  analytic side (mirrored beams rule out the others) or 100 000 on the traced one (cones do); the JSON says which.
- errors are the largest of all matched paths, in brackets the 99th percentile; the panel at one random code. *traced*
  rows are the tracer's own float32 numbers: the independent evidence, and the verdict. In *refined* rows the tracer
  decides which paths exist and what its materials do to the field; lengths and directions are recomputed in float64 on
  the walls it named, by formulas that image sources share, so that their errors say little beyond rounding.
- every error is judged by a limit of its own path (`rislam_rt/channel/compare/error_limits.py`), which follows from the
  rounding of float32 (of float64 in refined rows), the room's size, the path's length, its bounces and the segments
  next to agent and landmark; none is fitted. *beyond limits* counts the errors that are larger: exit code 1.
- *share of the limit*: the path that comes nearest to its own, for length, gain, phase, departure and arrival.
- gains are judged against the sum of the magnitudes that make them up: over a panel's elements, and with slabs taken
  for mirrors. A null of the panel, or a slab at Brewster's angle, is a difference of large numbers: its own size says
  nothing about their error, and decibels of it (the column) may be large where nothing is wrong.

"""


def write_comparison(
    found: Comparison, spec: CompareSpec, content: Mapping[str, Any], folder: Path, *, figures: bool = True
) -> Path:
    """Write the files of the channel validation: page, JSON and figure; return the page's path.

    Raises
    ------
    StoreError
        The disk refused.
    """
    files = {f"{COMPARISON}.md": validation_page(found.rows, seed=spec.seed).encode()}
    if figures and found.certificate is not None:
        files[CERTIFICATE] = to_png(draw_certificate(found.certificate))
    return write_all(folder, files | {f"{COMPARISON}.json": json_file(content)})


def validation_table(rows: Sequence[Validation]) -> str:
    """Markdown table of the channel validation: matched and one-sided paths with reasons, largest errors, by room."""
    cells = []
    for scene, depth, kind, report in rows:
        numbers = report.as_dict()
        spread = numbers["percentiles"]
        columns = ("length_error_m", "gain_error_db", "phase_error_rad", "aod_error_rad", "aoa_error_rad")
        errors = [_error(spread[name]) for name in columns]
        counts = [str(report.cycles), str(report.matched), _reasons(numbers), str(report.unexplained)]
        nearest = [f"{limits['nearest']['share']:.0%}" if limits else "-" for limits in numbers["limits"].values()]
        cells.append([scene, str(depth), kind, *counts, str(report.num_breaches), *errors, " ".join(nearest)])
    return "\n".join(table_lines(_HEAD, cells)) + "\n"


def validation_page(rows: Sequence[Validation], *, seed: int) -> str:
    """Markdown page of the channel validation: method and table."""
    how = f"Seed {seed}; poses at random, midpoint at least 0.1 m off every surface, baseline 0.1 m."
    return f"{_TEXT}{how}\n\n{validation_table(rows)}"


def _reasons(numbers: Mapping[str, Any]) -> str:
    """Table cell of the channel validation: reasons of one-sided paths, as `edge: 3 (1.2e-6 m)`."""
    limits = numbers["proof_limits_m"]
    texts = [
        f"{reason}: {n}" + (f" ({limits[reason]:.1e} m)" if limits[reason] else "")
        for reason, n in numbers["explained"].items()
    ]
    return ", ".join(texts) or "none needed"


def _error(spread: Mapping[str, float]) -> str:
    """Table cell of the channel validation: largest error and 99th percentile; `< 1e-12` for mere rounding."""
    if not spread:
        return "-"
    largest, p99 = ("< 1e-12" if spread[name] < 1e-12 else f"{spread[name]:.1e}" for name in ("max", "p99"))
    return f"{largest} ({p99})"


ALONE = "#CC79A7"
"""Colour of a path that only one channel has."""
FLOOR = 1e-16
"""Smallest error that is drawn: half the spacing of float64 at 1."""
MOST_LISTED = 6
"""Largest number of one-sided paths whose explanations are written out."""


def draw_certificate(certificate: Certificate) -> Figure:
    """Draw the comparison of both channels at one pose: traced paths, image-source paths, one-sided ones, errors."""
    scene, report = certificate.scene, certificate.report
    low, high = scene.bounds
    aspect = float((high[1] - low[1]) / (high[0] - low[0]))
    with styled():
        figure = Figure(figsize=(11.0, 2.0 * 5.2 * aspect + 2.2))
        (left, right), (alone, errors) = figure.subplots(2, 2)
        for axis, paths, name in ((left, certificate.traced, "traced"), (right, certificate.analytic, "analytic")):
            _draw_side(axis, certificate, paths, name)
        _draw_alone(alone, certificate)
        _draw_errors(errors, certificate)
        figure.suptitle(
            f"Path certificate: {scene.name}, pose {certificate.pose}: {report.matched} matched, "
            f"{sum(report.explained.values())} explained, {report.unexplained} unexplained",
            weight="bold", fontsize=12,
        )  # fmt: skip
        kinds = [kind for kind in PathKind if kind in report.kind]
        lines = [Line2D([], [], color=KIND[kind], lw=2.0, label=kind.name) for kind in kinds]
        lines.append(Line2D([], [], color=ALONE, lw=3.0, label="only one side has it"))
        for marker, size, label in (("*", 11, "agent"), ("o", 9, "scatterer"), ("s", 9, "panel")):
            filled = TRUTH if marker == "*" else "none"
            lines.append(Line2D([], [], ls="", marker=marker, ms=size, mfc=filled, mec=TRUTH, label=label))
        figure.legend(handles=lines, loc="outside lower center", ncols=len(lines), fontsize=9)
    return figure


def _draw_side(axis: Axes, certificate: Certificate, paths: Paths, name: str) -> None:
    """Draw all paths of one channel from above for the validation, those that the other channel lacks on top."""
    _draw_plan(axis, certificate)
    columns = np.flatnonzero(paths.valid[0])
    only = {path.label for path in certificate.report.one_sided if path.side == name}
    for column in columns[np.argsort(-paths.kind[columns], kind="stable")]:
        path, points = int(column), path_points(certificate.scene, paths, 0, int(column))
        if paths.label(path) in only:
            axis.plot(points[:, 0], points[:, 1], color=ALONE, lw=3.0, zorder=6)
        else:
            axis.plot(points[:, 0], points[:, 1], color=KIND[PathKind(paths.kind[path])], lw=0.8, alpha=0.6, zorder=3)
    counts = f"{len(columns)} paths" + (f", {len(only)} of them alone" if only else "")
    axis.set_title(f"{name}: {counts}", weight="bold")


def _draw_alone(axis: Axes, certificate: Certificate) -> None:
    """Draw the paths that only one channel has in the validation, with their explanations below."""
    _draw_plan(axis, certificate)
    sides = {"traced": certificate.traced, "analytic": certificate.analytic}
    one_sided = certificate.report.one_sided
    for path in one_sided:
        paths = sides[path.side]
        column = next(p for p in np.flatnonzero(paths.valid[0]) if paths.label(int(p)) == path.label)
        points = path_points(certificate.scene, paths, 0, int(column))
        axis.plot(points[:, 0], points[:, 1], color=ALONE, lw=2.5, ls="-" if path.reason else ":", zorder=6)
        axis.plot(points[1:-1, 0], points[1:-1, 1], "o", color=ALONE, ms=5, zorder=7)
    axis.set_title("what only one side has, and why", weight="bold")
    axis.set_xlabel("")
    axis.text(0.0, -0.09, _proofs(one_sided), transform=axis.transAxes, va="top", fontsize=8.5)


def _proofs(one_sided: Sequence[OneSidedPath]) -> str:
    """Explanations of the first one-sided paths of a channel comparison as text."""
    if not one_sided:
        return "nothing: both sides have the same paths"
    lines = [f"{p.label}\n  only {p.side}: {p.reason or 'UNEXPLAINED'}, {p.proof}" for p in one_sided[:MOST_LISTED]]
    more = len(one_sided) - MOST_LISTED
    return "\n".join(lines + ([f"and {more} more"] if more > 0 else []))


def _draw_errors(axis: Axes, certificate: Certificate) -> None:
    """Draw the errors of matched paths of the channel validation, the tracer's float32 against float64, in rows by
    quantity and path class."""
    report = certificate.report
    rows = (
        ("length [m]", report.length_error), ("gain [dB]", report.gain_error_db), ("phase [rad]", report.phase_error),
        ("AoD [rad]", report.aod_error), ("AoA [rad]", report.aoa_error),
    )  # fmt: skip
    kinds = [kind for kind in PathKind if kind in report.kind]
    for row, (_, error) in enumerate(rows):
        for number, kind in enumerate(kinds):
            mine = np.sort(np.maximum(error[report.kind == kind], FLOOR))
            height = row + 0.8 * (number + 0.5) / len(kinds) - 0.4
            axis.plot(mine, np.full(len(mine), height), "|", color=KIND[kind], ms=6, mew=1.2, alpha=0.8)
    axis.set_xscale("log")
    axis.set_yticks(range(len(rows)), [name for name, _ in rows])
    axis.invert_yaxis()
    axis.grid(False, axis="y")
    axis.set_xlabel(f"tracer's float32 against analytic float64 (equal or less: at {FLOOR:.0e})")
    axis.set_title("matched paths: how far apart", weight="bold")


def _draw_plan(axis: Axes, certificate: Certificate) -> None:
    """Draw walls, landmarks and agent of the pose of the channel validation from above."""
    scene = certificate.scene
    for edge in wall_edges(build_walls(scene)):
        axis.plot(edge[:, 0], edge[:, 1], color=WALL, lw=1.6, solid_capstyle="round", zorder=2)
    for scatterer in scene.scatterers:
        axis.plot(*scatterer.position[:2], "o", ms=9, mfc="none", mec=TRUTH, mew=1.5, zorder=8)
    for panel in scene.panels:
        axis.plot(*panel.center[:2], "s", ms=9, mfc="none", mec=TRUTH, mew=1.5, zorder=8)
    axis.plot(*scene.agent.position[0, :2], "*", color=TRUTH, ms=11, zorder=9)
    axis.set_aspect("equal")
    axis.grid(False)
    axis.set(xlabel="x [m]", ylabel="y [m]")
