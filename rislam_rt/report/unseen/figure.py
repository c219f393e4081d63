"""Figure of the study in unseen rooms: relative RMSE of every run, by classes of motion and room."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rislam_rt.report.style import TRUTH, styled
from rislam_rt.report.swept.error_curves import log_metres
from rislam_rt.report.unseen.score_cards import CLASSES, SchemeRun, column, in_order

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
SCORE, BOUND = "relative_rmse_m", "relative_bound_m"
DIVISIONS = ("motion", "plan", "size", "reflection")


def draw_unseen(runs: Mapping[str, Sequence[SchemeRun]]) -> Figure:
    """Draw the relative RMSE of every run in unseen rooms by class, crosses where lost, bars at medians and bounds."""
    with styled():
        figure = Figure(figsize=(12.0, 8.0))
        axes = figure.subplots(2, 2, sharey=True).ravel()
        for axis, division in zip(axes, DIVISIONS, strict=True):
            _draw_division(axis, division, runs)
        for axis in axes[::2]:
            axis.set_ylabel("RMSE relative to the true start [m]")
        log_metres(axes[0])
        handles = [
            axes[0].plot([], [], ls="none", marker="o", ms=5, color=COLOURS[k % len(COLOURS)], label=name)[0]
            for k, name in enumerate(runs)
        ]
        handles += axes[0].plot([], [], ls="none", marker="x", color=TRUTH, label="lost")
        handles += axes[0].plot([], [], color=TRUTH, lw=2.0, label="median")
        handles += axes[0].plot([], [], color=TRUTH, lw=2.0, ls=":", label="median of the bounds")
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 7), fontsize=9)
    return figure


def _draw_division(axis: Axes, division: str, runs: Mapping[str, Sequence[SchemeRun]]) -> None:
    """Draw the relative RMSE of every run by the classes of one property of rooms."""
    of = CLASSES[division]
    order = in_order({of(run.traits) for members in runs.values() for run in members if run.scores})
    width = 0.8 / max(len(runs), 1)
    for number, members in enumerate(runs.values()):
        colour = COLOURS[number % len(COLOURS)]
        for place, name in enumerate(order):
            own = [run for run in members if run.scores and of(run.traits) == name]
            if not own:
                continue
            middle = place + (number - 0.5 * (len(runs) - 1)) * width
            value, lost = column(own, SCORE), column(own, "lost") > 0.0
            x = middle + 0.7 * width * ((np.arange(len(own)) * 0.618034) % 1.0 - 0.5)  # so that dots overlap less
            axis.plot(x[~lost], value[~lost], ls="none", marker="o", ms=3.5, alpha=0.7, color=colour)
            axis.plot(x[lost], value[lost], ls="none", marker="x", ms=4.5, color=colour)
            for score, style in ((SCORE, "-"), (BOUND, ":")):
                axis.hlines(
                    np.median(column(own, score)), middle - 0.4 * width, middle + 0.4 * width, color=colour, lw=2.0,
                    ls=style,
                )  # fmt: skip
    axis.set_xticks(range(len(order)), order)
    axis.set_title(f"By {division}", fontsize=10)
