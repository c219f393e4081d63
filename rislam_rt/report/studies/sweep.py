"""Figure of a sweep: RMSE of the agent along one axis, a line for every scheme and value of the other axes."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rislam_rt.input_messages import unit_of
from rislam_rt.report.style import legend_below, save_figure, scheme_styles, styled
from rislam_rt.report.swept.error_curves import log_metres
from rislam_rt.shipped import short_names
from rislam_rt.studies.pipeline_sweep import SchemeScore

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
LINES = ("-", "--", ":", "-.")


def draw_scores(scores: Sequence[SchemeScore], path: Path) -> Path | None:
    """Draw the RMSE of a sweep's runs so far to a file; no file and None before the first run has ended.

    Raises
    ------
    StoreError
        The disk refused.
    """
    shown = [score for score in scores if score.rmse]
    return save_figure(scores_figure(shown), path) if shown else None


def scores_figure(scores: Sequence[SchemeScore]) -> Figure:
    """Figure of a sweep: RMSE with its interval along the main axis, beside it that relative to the start, and the
    number of runs for each point."""
    relative = [score for score in scores if score.relative]
    with styled():
        figure = Figure(figsize=(11.0 if relative else 7.0, 4.6))
        axes = figure.subplots(1, 2 if relative else 1, squeeze=False)[0]
        _draw_errors(axes[0], scores, [(score.overall, score.interval) for score in scores])
        axes[0].set_ylabel("RMSE of the agent's position [m]")
        if relative:
            _draw_errors(axes[1], scores, [(score.relative, score.relative_interval) for score in scores])
            axes[1].set_ylabel("RMSE relative to its start [m]")
        runs = sorted({len(score.rmse) for score in scores})
        count = " to ".join(map(str, runs[:: max(len(runs) - 1, 1)]))
        several = ", 95 % bootstrap intervals" if runs[-1] > 1 else ""
        axes[0].set_title(f"{count} {'run' if runs == [1] else 'runs'} a point{several}")
        legend_below(figure, axes[0].get_legend_handles_labels()[0], columns=3 * len(axes))
    return figure


def _draw_errors(
    axis: Axes, scores: Sequence[SchemeScore], errors: Sequence[tuple[float | None, tuple[float, float] | None]]
) -> None:
    """Draw one error of a sweep's scores, with its interval, along the main axis; what is not known is left out."""
    along = main_axis(scores)
    ticks = list(dict.fromkeys(str(score.point.get(along, score.scheme)) for score in scores))
    numeric = all(_is_number(score.point.get(along)) for score in scores)
    groups: dict[tuple[str, str], list[int]] = {}
    for number, score in enumerate(scores):
        groups.setdefault((score.scheme, _others(score.point, along)), []).append(number)
    styles = scheme_styles(score.scheme for score in scores)
    kinds = list(dict.fromkeys(others for _, others in groups))
    step = min(0.12, 0.8 / len(groups))
    for number, ((scheme, others), group) in enumerate(groups.items()):
        shift = 0.0 if not along else step * (number - 0.5 * (len(groups) - 1))
        line = "none" if not numeric else LINES[kinds.index(others) % len(LINES)]
        style: Mapping[str, Any] = {"ls": line, "marker": MARKERS[number % len(MARKERS)], "ms": 5, "capsize": 3}
        labels = [str(scores[row].point.get(along, scheme)) for row in group]
        x = [float(label) if numeric else ticks.index(label) + shift for label in labels]
        middle = np.array([errors[row][0] for row in group], dtype=np.float64)
        ends = np.array([errors[row][1] or [errors[row][0]] * 2 for row in group], dtype=np.float64)
        label = ", ".join(part for part in (scheme, others) if part)
        axis.errorbar(x, middle, np.abs(ends.T - middle), color=styles[scheme].colour, label=label, **style)
    if not numeric:
        axis.set_xticks(range(len(ticks)), [*short_names(ticks).values()] if along == "scene" else ticks)
    log_metres(axis)
    unit = unit_of(along)
    axis.set_xlabel((f"{along} [{unit}]" if unit else along) or "scheme")


def main_axis(scores: Sequence[SchemeScore]) -> str:
    """Axis along which a sweep's RMSE is drawn: the first with numbers, or else the first but that of the schemes."""
    keys = [key for key in scores[0].point if key != "schemes"]
    numbers = [key for key in keys if _is_number(scores[0].point[key])]
    return next(iter((*numbers, *keys)), "")


def _others(point: Mapping[str, Any], along: str) -> str:
    """Values of a point along the other axes, as text."""
    names = short_names((key for key in point if key != "schemes"), ".")
    return ", ".join(f"{name} = {point[key]}" for key, name in names.items() if key != along)


def _is_number(value: Any) -> bool:
    """Whether a sweep's axis value is a number, and not a boolean."""
    return isinstance(value, int | float) and not isinstance(value, bool)
