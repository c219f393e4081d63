"""Error curves of the schemes: a band for the interval, the bound dashed, names at the ends of the lines."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from rislam_rt.report.style import MARKER, TRUTH, scheme_colour

GAP = 0.055
"""Least distance between two names, in heights of the axes."""


def draw_schemes(axis: Axes, x: Sequence[float], curves: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    """Draw one curve a scheme, from its entries along x, on a logarithmic axis of metres; names stand to the right."""
    for scheme, entries in curves.items():
        colour = scheme_colour(scheme)
        value, low, high, bound = (
            np.array([np.nan if entry[name] is None else entry[name] for entry in entries], dtype=np.float64)
            for name in ("rmse_m", "rmse_low_m", "rmse_high_m", "bound_m")
        )
        axis.fill_between(x, low, high, color=colour, alpha=0.13, lw=0.0)
        axis.plot(x, bound, color=colour, ls="--", lw=1.1)
        axis.plot(x, value, color=colour, marker=MARKER.get(scheme, "o"), ms=5, lw=1.7)
    axis.set_yscale("log")
    mark_metres(axis.yaxis)
    ends = {scheme: _last(entries) for scheme, entries in curves.items()}
    label_ends(axis, {scheme: end for scheme, end in ends.items() if end is not None})


def mark_metres(side: Axis) -> None:
    """Marks on the axis of error curves at 1, 2 and 5 of every power of ten, in plain numbers."""
    side.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    side.set_major_formatter(lambda value, _: f"{value:g}")
    side.set_minor_formatter(NullFormatter())


def label_ends(axis: Axes, ends: Mapping[str, float]) -> None:
    """Put each name at the height where its curve ends, moved apart as far as need be."""
    low, high = np.log10(axis.get_ylim())
    order = sorted(ends, key=lambda name: ends[name])
    place = np.array([(np.log10(ends[name]) - low) / (high - low) for name in order])
    for row in range(1, len(place)):
        place[row] = max(place[row], place[row - 1] + GAP)
    if len(place):
        place -= max(0.0, place[-1] - 1.0)
        for row in range(len(place) - 2, -1, -1):
            place[row] = min(place[row], place[row + 1] - GAP)
    for name, height in zip(order, place, strict=True):
        axis.annotate(
            name, (1.02, height), xycoords="axes fraction", color=scheme_colour(name), va="center", weight="bold",
            fontsize=9,
        )  # fmt: skip


def explain_lines(figure: Figure, axis: Axes) -> None:
    """What solid and dashed error curves are, below the figure."""
    error = axis.plot([], [], color=TRUTH, lw=1.7, label="RMSE over seeds, band: 95 % interval")
    bound = axis.plot([], [], color=TRUTH, lw=1.1, ls="--", label="posterior bound")
    figure.legend(handles=[*error, *bound], loc="outside lower center", ncols=2, fontsize=8)


def _last(entries: Sequence[Mapping[str, Any]]) -> float | None:
    known = [entry["rmse_m"] for entry in entries if entry["rmse_m"]]
    return known[-1] if known else None
