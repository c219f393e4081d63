"""Drawing of error curves: RMSE of each scheme with its interval as a band, posterior bound dashed, names."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from rislam_rt.arrays import Floats
from rislam_rt.report.style import TRUTH, SchemeStyle

Curves = Mapping[str, Sequence[Mapping[str, Any]]]
"""Error curves of schemes by name: the entries of each, sorted along x."""
GAP = 0.055
"""Least distance between the names of two curves, relative to the height of the axes."""


def draw_schemes(axis: Axes, x: Sequence[float], curves: Curves, styles: Mapping[str, SchemeStyle]) -> None:
    """Draw RMSE and posterior bound of each scheme along x on a logarithmic axis [m], names to the right."""
    for scheme, entries in curves.items():
        axis.plot(x, numbers(entries, "bound_m"), color=styles[scheme].colour, ls="--", lw=1.1)
        draw_error(axis, x, entries, styles[scheme], "rmse")
    log_metres(axis)
    label_ends(axis, curves, styles, "rmse_m")


def draw_error(
    axis: Axes, x: Sequence[float], entries: Sequence[Mapping[str, Any]], style: SchemeStyle, name: str
) -> None:
    """Draw one error of a scheme along x as a curve with its interval as a band."""
    value, low, high = (numbers(entries, f"{name}{end}_m") for end in ("", "_low", "_high"))
    axis.fill_between(x, low, high, color=style.colour, alpha=0.13, lw=0.0)
    axis.plot(x, value, color=style.colour, marker=style.marker, ms=5, lw=1.7)


def log_metres(axis: Axes, which: str = "y") -> None:
    """Make one axis of error curves logarithmic, with ticks at 1, 2 and 5 of every power of ten in plain numbers."""
    axis.set(**{f"{which}scale": "log"})
    side: Axis = getattr(axis, f"{which}axis")
    side.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    side.set_major_formatter(lambda value, _: f"{value:g}")
    side.set_minor_formatter(NullFormatter())


def draw_rmse(axis: Axes, row: float, entry: Mapping[str, Any], colour: str, **marker: Any) -> None:
    """Draw an RMSE as a dot in a row, with its interval as a line."""
    axis.plot(ends_of(entry), [row, row], color=colour, lw=1.4)
    axis.plot([entry["rmse_m"]], [row], color=colour, marker="o", **marker)


def ends_of(entry: Mapping[str, Any]) -> tuple[float, float]:
    """Ends of the interval of an RMSE [m] for drawing; the RMSE itself where there is none."""
    return entry["rmse_low_m"] or entry["rmse_m"], entry["rmse_high_m"] or entry["rmse_m"]


def numbers(entries: Sequence[Mapping[str, Any]], name: str) -> Floats:
    """One number of every entry, (E,), for error curves, NaN where there is none."""
    return np.array([np.nan if entry[name] is None else entry[name] for entry in entries], dtype=np.float64)


def label_ends(axis: Axes, curves: Curves, styles: Mapping[str, SchemeStyle], name: str) -> None:
    """Write each scheme's name at the height where its error curve ends, moved apart so that names do not overlap."""
    known = {scheme: [entry[name] for entry in entries if entry[name]] for scheme, entries in curves.items()}
    ends = {scheme: values[-1] for scheme, values in known.items() if values}
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
            name, (1.02, height), xycoords="axes fraction", color=styles[name].colour, va="center", weight="bold",
            fontsize=9,
        )  # fmt: skip


def explain_lines(figure: Figure, axis: Axes) -> None:
    """Add a legend of solid (RMSE) and dashed (posterior bound) curves below a figure."""
    error = axis.plot([], [], color=TRUTH, lw=1.7, label="RMSE over seeds, band: 95 % interval")
    bound = axis.plot([], [], color=TRUTH, lw=1.1, ls="--", label="posterior bound")
    figure.legend(handles=[*error, *bound], loc="outside lower center", ncols=2, fontsize=8)
