"""Advice on a scene: a terminal table of which landmarks will be detected, and a figure of the panel's coverage."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap

import numpy as np
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure, SubFigure
from rich.console import Console
from rich.table import Column, Table

from rislam_rt.adviser.advice import Advice
from rislam_rt.adviser.coverage import Coverage
from rislam_rt.adviser.link_budget import NOTHING_DB, LandmarkLink
from rislam_rt.adviser.remedies import detection_label
from rislam_rt.adviser.tracing_cost import cost_words
from rislam_rt.input_messages import share_text
from rislam_rt.model import Scene
from rislam_rt.report.map_from_above import draw_plan
from rislam_rt.report.style import save_figure, styled

STEPS_DB = np.arange(-18.0, 31.0, 6.0)
"""Limits [dB] of the coverage map's colours; zero is the detection threshold."""
PLACES = ("start", "middle", "end")
"""Columns of the table of advice that show a place."""
UNSAID = {"swept": "most beams miss it", "random": "most codes miss it"}
"""Why a landmark is not heard under so many codes whose best or mean is loud enough."""
WEAKENED = "weakened by paths that come in with it"
"""Why a landmark is not heard whose strongest path is loud enough and has a component of its own."""
LETTERS = 60
"""Most letters in a line of the coverage map's title: so many of the widest, bold, are as wide as the picture."""
UNSEEN = "#d9d9d9"
"""Colour of places in the coverage map that no direct path from the panel reaches."""


def print_advice(advice: Advice) -> None:
    """Print a table of the SNR margin of each landmark along the trajectory, remedies, and the cost of tracing."""
    console = Console(highlight=False)
    table = Table(Column("landmark", overflow="fold"), "codes", *PLACES, "heard", "why not")
    for link in advice.links:
        cells = (_cell(link, at) for at in link.three)
        table.add_row(link.landmark, link.code or "any", *cells, share_text(link.share), _why(link))
    if advice.links:
        title = f"SNR of the strongest path over the threshold of {advice.threshold_db:.1f} dB [dB]"
        console.print(title, style="bold", markup=False)
        console.print(table)
        if any("(" in _cell(link, at) for link in advice.links for at in link.three):
            said = (
                "in brackets: not heard there; below 0 dB it is too weak, above it is for the reason in the last column"
            )
            console.print(said, soft_wrap=True)
    for line in advice.remedies:
        console.print(line, markup=False, soft_wrap=True)
    console.print(f"to trace {advice.costs[0].walls} walls: {'; '.join(map(cost_words, advice.costs))}", soft_wrap=True)


def draw_coverage(scene: Scene, coverages: Sequence[Coverage], path: Path) -> Path:
    """Draw a coverage map of each RIS panel, SNR of its direct path over the threshold, to a file; return its path."""
    low, high = scene.bounds
    height = float(np.clip(6.0 * (high[1] - low[1]) / (high[0] - low[0]), 2.5, 9.0)) + 1.2
    with styled():
        figure = Figure(figsize=(7.6, height * len(coverages)))
        for part, coverage in zip(figure.subfigures(len(coverages), 1, squeeze=False).flat, coverages, strict=True):
            _draw_map(part, scene, coverage)
        return save_figure(figure, path)


def _draw_map(figure: SubFigure, scene: Scene, coverage: Coverage) -> None:
    """Draw one panel's coverage map over the room's plan as advice, with a line where the SNR meets the threshold; its
    title stands above map and colours, in as many lines as it needs."""
    from matplotlib import colormaps

    axis = figure.subplots()
    colours = colormaps["viridis"].with_extremes(bad=UNSEEN)
    shown = axis.pcolormesh(
        coverage.x, coverage.y, coverage.margin_db, cmap=colours, shading="nearest", zorder=-2,
        norm=BoundaryNorm(STEPS_DB, colours.N, extend="both"),
    )  # fmt: skip
    axis.set_facecolor(UNSEEN)
    level = np.ma.masked_invalid(coverage.margin_db)
    if level.count() and level.min() < 0.0 < level.max():
        axis.contour(coverage.x, coverage.y, level, levels=[0.0], colors="#d55e00", linewidths=2.0, zorder=1)
    draw_plan(axis, scene)
    axis.set(xlabel="x [m]", ylabel="y [m]")
    about = wrap(f"{coverage.panel} in {scene.name}, agent at z = {coverage.height:.2f} m:", LETTERS)
    told = f"heard at {share_text(coverage.heard)} of where it is seen"
    figure.suptitle("\n".join([*about, told]), size=11, weight="bold")
    bar = figure.colorbar(shown, ax=axis, fraction=0.05, pad=0.02)
    bar.set_label("SNR of the direct path under the best code,\nover the threshold [dB]; grey: no such path")


def _cell(link: LandmarkLink, at: int) -> str:
    """Cell of the advice table: a landmark's SNR margin [dB] at one place, in brackets where it is not detected."""
    if link.margin_db[at] <= NOTHING_DB:
        return "none"
    text = f"{link.margin_db[at]:+.1f}"
    return text if link.probability[at] > 0.5 else f"({text})"


def _why(link: LandmarkLink) -> str:
    """Report's cell of the table of advice: the most frequent reason why a landmark is not detected, none if it is
    heard; and why it is not at each of the three places where it is loud enough all the same."""
    said = [reason for reason in link.reason if reason]
    usual = "" if detection_label(link) == "heard" or not said else max(said, key=said.count)
    places: dict[str, list[str]] = {}
    for name, at in zip(PLACES, link.three, strict=True):
        if _cell(link, at).startswith("(+"):
            places.setdefault(link.reason[at] or UNSAID.get(link.code, WEAKENED), []).append(name)
    if len(places) == 1 and (usual in places or len(next(iter(places.values()))) == len(PLACES)):
        return next(iter(places))
    first = [usual] if usual and usual not in places else []
    return "; ".join([*first, *(f"{', '.join(at)}: {why}" for why, at in places.items())])
