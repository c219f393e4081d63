"""Figures of curves against time (errors, gains of path classes), and of the computing times of a cycle's steps."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import position_errors
from rislam_rt.model import STEPS, PathKind, SchemeResult, SlamResult
from rislam_rt.pipeline.scores.summary import landmark_track
from rislam_rt.report.style import SchemeStyle, legend_below, scheme_styles, styled
from rislam_rt.slam.step_info import StepOutcome

MARKS = 8
"""About how many markers a curve over time has."""
CLASSES: dict[PathKind, dict[str, Any]] = {
    PathKind.LOS: {"color": "black"}, PathKind.VT: {"color": "#999999"},
    PathKind.PS: {"color": "black", "ls": ":"}, PathKind.VS: {"color": "#999999", "ls": ":"},
}  # fmt: skip
"""Curves of the path classes that no code changes: grey, since colours are those of schemes."""


def draw_agent_error(result: SlamResult) -> Figure:
    """Draw the agent's position error of all schemes against time, on a logarithmic axis, the filter's own standard
    deviation dashed, and crosses where it held itself for lost."""
    time = result.scene.agent.elapsed
    with styled():
        figure = Figure(figsize=(8.6, 4.1))
        axis = figure.subplots()
        handles, crosses, styles = [], False, scheme_styles(result.schemes)
        for number, (name, scheme) in reversed(list(enumerate(result.schemes.items()))):
            error = position_errors(scheme.position, result.scene.agent.position)
            believed = np.sqrt(np.einsum("kii->k", scheme.covariance[:, :3, :3]))
            colour, shown = styles[name].colour, _on_log_axis(error)
            label = f"{name}, RMSE {100.0 * np.sqrt(np.mean(error**2)):.1f} cm"
            handles += axis.plot(
                time, shown, lw=1.6, label=label, **_look(styles[name], number, len(result.schemes), len(time))
            )
            axis.plot(time, _on_log_axis(believed), color=colour, lw=1.0, ls="--", alpha=0.7)
            lost = np.array([outcome == StepOutcome.DIVERGED for outcome in scheme.outcome], dtype=np.bool_)
            axis.plot(time[lost], shown[lost], color=colour, ls="none", marker="x", ms=6.0)
            crosses |= bool(lost.any())
        axis.set(xlabel="time [s]", ylabel="agent position error [cm]", yscale="log")
        axis.set_title("How far off the agent is, and how far off it believes to be", weight="bold")
        axis.set_xlim(*time_limits(time))
        plain = FuncFormatter(lambda value, _: f"{value:g}")
        axis.yaxis.set_major_formatter(plain)
        axis.yaxis.set_minor_formatter(NullFormatter() if np.ptp(np.log10(axis.get_ylim())) > 1.0 else plain)
        more = [Line2D([], [], color="#555555", lw=1.0, ls="--", label="the filter's own σ")]
        if crosses:
            more += [Line2D([], [], color="#555555", ls="none", marker="x", label="held itself for lost")]
        legend_below(figure, [*handles[::-1], *more], columns=5)
    return figure


def _look(style: SchemeStyle, number: int, schemes: int, cycles: int) -> dict[str, Any]:
    """Colour and marker of a scheme's curve over time, as arguments of `plot`; markers stand at about `MARKS` cycles,
    fewer in a short run, and at cycles of its own for each of the `schemes`, so that curves which lie on each other can
    be told apart."""
    step = max(cycles // MARKS, min(schemes, cycles))
    first = number * step // schemes
    return {"color": style.colour, "marker": style.marker, "ms": 5.0, "markevery": (first, step)}


def _on_log_axis(error: Floats) -> Floats:
    """Curve [cm] of errors (K,) [m] on a logarithmic axis, which has no zero: who knows all has none."""
    return np.where(error > 0.0, 100.0 * error, np.nan)


def time_limits(time: Floats) -> tuple[float, float]:
    """Limits of a time axis [s] for curves over cycles at `time` (K,); around a single cycle, a second."""
    first, last = float(time[0]), float(time[-1])
    return (first, last) if last > first else (first - 0.5, first + 0.5)


def draw_landmark_errors(result: SlamResult) -> Figure:
    """Draw the position errors of a run's landmarks against time, for all schemes: distance to the matched estimate."""
    scene, time = result.scene, result.scene.agent.elapsed
    tracks = {name: landmark_track(scene, scheme).error for name, scheme in result.schemes.items()}
    styles = scheme_styles(tracks)
    with styled():
        figure = Figure(figsize=(8.6, 3.9))
        axes = figure.subplots(1, max(len(scene.landmarks), 1), sharey=True, squeeze=False)[0]
        for place, (name, errors) in reversed(list(enumerate(tracks.items()))):
            for number, axis in enumerate(axes[: errors.shape[1]]):
                look = _look(styles[name], place, len(tracks), len(time))
                axis.plot(time, 100.0 * errors[:, number], lw=1.4, label=name, **look)
        never = set(np.flatnonzero(~np.any([np.isfinite(e).any(axis=0) for e in tracks.values()], axis=0)).tolist())
        for number, (axis, landmark) in enumerate(zip(axes, scene.landmarks, strict=False)):
            axis.set_title(landmark, weight="bold")
            axis.set(xlabel="time [s]", xlim=time_limits(time))
            axis.set_ylim(0.0)
            if number in never:
                axis.text(0.5, 0.5, "never found", transform=axis.transAxes, ha="center", color="#555555")
        axes[0].set_ylabel("landmark position error [cm]")
        legend_below(figure, axes[0].get_legend_handles_labels()[0][::-1], columns=5)
    return figure


def draw_levels(result: SlamResult, detection_snr_db: float, snr_per_gain_db: float) -> Figure:
    """Draw the gain of the strongest path of each class against time; that of the panel for each scheme's codes.

    Parameters
    ----------
    detection_snr_db
        Integrated SNR at which the receiver reports a path.
    snr_per_gain_db
        Integrated SNR of a path with gain 0 dB.
    """
    time, paths = result.scene.agent.elapsed, result.paths
    with styled():
        figure = Figure(figsize=(8.6, 4.8))
        axis = figure.subplots()
        first = next(iter(result.schemes.values()))
        for kind, look in CLASSES.items():
            level = strongest_db(first, paths.kind == kind)
            if np.isfinite(level).any():
                axis.plot(time, level, lw=1.6, label=f"{kind.name}, strongest", **look)
        styles = scheme_styles(result.schemes)
        for number, (name, scheme) in enumerate(result.schemes.items()):
            level = strongest_db(scheme, paths.kind == PathKind.RIS)
            if np.isfinite(level).any():
                random = name == "random"
                width, order = (0.7, 2) if random else (1.8, 3)
                look = _look(styles[name], number, len(result.schemes), len(time))
                axis.plot(time, level, lw=width, zorder=order, label=f"RIS, {name}", **look)
        threshold = detection_snr_db - snr_per_gain_db
        axis.axhline(threshold, color="#555555", lw=1.0, ls="--", label="detection threshold")
        axis.set(xlim=time_limits(time), xlabel="time [s]", ylabel="path gain [dB]")
        shift = (lambda g: np.asarray(g) + snr_per_gain_db, lambda s: np.asarray(s) - snr_per_gain_db)
        right = axis.secondary_yaxis("right", functions=shift)
        right.set_ylabel("SNR over all antennas [dB]")
        axis.set_title("What each class of paths brings", weight="bold")
        legend_below(figure, axis.get_legend_handles_labels()[0], columns=4)
    return figure


def strongest_db(scheme: SchemeResult, columns: Floats) -> Floats:
    """Gain curve (K,) [dB] over time of the strongest of some paths in each cycle; NaN where there is none."""
    gain = np.abs(scheme.gain[:, columns]).max(axis=1, initial=0.0)
    with np.errstate(divide="ignore"):
        level = 20.0 * np.log10(gain)
    return np.where(gain > 0.0, level, np.nan)


def draw_timing(result: SlamResult, budget: Sequence[float]) -> Figure:
    """Draw the computing times of the cycle's steps: median (bar), 99th percentile (whisker), and `budget` [s]."""
    schemes = result.schemes
    height, styles = 0.8 / len(schemes), scheme_styles(schemes)
    with styled():
        figure = Figure(figsize=(8.6, 1.4 + 0.45 * len(STEPS) * max(len(schemes), 2) / 2))
        axis = figure.subplots()
        for number, (name, scheme) in enumerate(schemes.items()):
            at = np.arange(len(STEPS)) - 0.4 + (number + 0.5) * height
            median, high = 1e3 * np.percentile(scheme.seconds, [50.0, 99.0], axis=0)
            whisker = np.stack([np.zeros(len(STEPS)), high - median])
            axis.barh(at, median, 0.9 * height, xerr=whisker, color=styles[name].colour, label=name,
                      error_kw={"lw": 1.0, "capsize": 2})  # fmt: skip
        for step, limit in enumerate(budget):
            axis.plot([1e3 * limit] * 2, [step - 0.45, step + 0.45], color="black", lw=2.0)
        axis.set_yticks(np.arange(len(STEPS)), STEPS)
        axis.invert_yaxis()
        axis.set(xscale="log", xlabel="time of a step [ms]")
        axis.grid(False, axis="y")
        axis.set_title("Steps of a cycle against their budgets", weight="bold")
        handles, _ = axis.get_legend_handles_labels()
        budget_line = Line2D([], [], color="black", lw=2.0, label="budget")
        legend_below(figure, [*handles, budget_line], columns=5)
    return figure
