"""Figure of the computing times of the cycle's four steps against their time budgets (timing)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rislam_rt.model import STEPS, SlamResult
from rislam_rt.report.style import scheme_colour, styled


def draw_timing(result: SlamResult, budget: Sequence[float]) -> Figure:
    """Draw the computing times of the cycle's steps: median (bar), 99th percentile (whisker), and `budget` [s]."""
    schemes = result.schemes
    height = 0.8 / len(schemes)
    with styled():
        figure = Figure(figsize=(8.6, 1.4 + 0.45 * len(STEPS) * max(len(schemes), 2) / 2))
        axis = figure.subplots()
        for number, (name, scheme) in enumerate(schemes.items()):
            at = np.arange(len(STEPS)) - 0.4 + (number + 0.5) * height
            median, high = 1e3 * np.percentile(scheme.seconds, [50.0, 99.0], axis=0)
            whisker = np.stack([np.zeros(len(STEPS)), high - median])
            axis.barh(at, median, 0.9 * height, xerr=whisker, color=scheme_colour(name), label=name,
                      error_kw={"lw": 1.0, "capsize": 2})  # fmt: skip
        for step, limit in enumerate(budget):
            axis.plot([1e3 * limit] * 2, [step - 0.45, step + 0.45], color="black", lw=2.0)
        axis.set_yticks(np.arange(len(STEPS)), STEPS)
        axis.invert_yaxis()
        axis.set_xscale("log")
        axis.set_xlabel("time of a step [ms]")
        axis.grid(False, axis="y")
        axis.set_title("Steps of a cycle against their budgets", weight="bold")
        handles, _ = axis.get_legend_handles_labels()
        budget_line = Line2D([], [], color="black", lw=2.0, label="budget")
        figure.legend(handles=[*handles, budget_line], loc="outside lower center", ncols=5, fontsize=9)
    return figure
