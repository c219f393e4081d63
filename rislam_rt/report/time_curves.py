"""Figures of curves against time (errors, gains of path classes), and of the computing times of a cycle's steps."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import position_errors
from rislam_rt.model import STEPS, PathKind, SchemeResult, SlamResult
from rislam_rt.pipeline.scores.summary import landmark_track
from rislam_rt.report.style import KIND, scheme_colour, styled
from rislam_rt.slam.step_info import StepOutcome


def draw_agent_error(result: SlamResult) -> Figure:
    """Draw the agent's position error of all schemes against time, on a logarithmic axis, the filter's own standard
    deviation dashed, and crosses where it held itself for lost."""
    time = result.scene.agent.elapsed
    with styled():
        figure = Figure(figsize=(8.6, 4.1))
        axis = figure.subplots()
        handles, crosses = [], False
        for name, scheme in reversed(list(result.schemes.items())):
            error = position_errors(scheme.position, result.scene.agent.position)
            believed = np.sqrt(np.einsum("kii->k", scheme.covariance[:, :3, :3]))
            colour, shown = scheme_colour(name), _on_log_axis(error)
            label = f"{name}, RMSE {100.0 * np.sqrt(np.mean(error**2)):.1f} cm"
            handles += axis.plot(time, shown, color=colour, lw=1.6, label=label)
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
        figure.legend(handles=[*handles[::-1], *more], loc="outside lower center", ncols=5, fontsize=9)
    return figure


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
    with styled():
        figure = Figure(figsize=(8.6, 3.9))
        axes = figure.subplots(1, max(len(scene.landmarks), 1), sharey=True, squeeze=False)[0]
        for name, errors in reversed(tracks.items()):
            for number, axis in enumerate(axes[: errors.shape[1]]):
                axis.plot(time, 100.0 * errors[:, number], color=scheme_colour(name), lw=1.4, label=name)
        never = set(np.flatnonzero(~np.any([np.isfinite(e).any(axis=0) for e in tracks.values()], axis=0)).tolist())
        for number, (axis, landmark) in enumerate(zip(axes, scene.landmarks, strict=False)):
            axis.set_title(landmark, weight="bold")
            axis.set(xlabel="time [s]", xlim=time_limits(time))
            axis.set_ylim(0.0)
            if number in never:
                axis.text(0.5, 0.5, "never found", transform=axis.transAxes, ha="center", color="#555555")
        axes[0].set_ylabel("landmark position error [cm]")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles[::-1], labels[::-1], loc="outside lower center", ncols=5, fontsize=9)
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
        for kind in (PathKind.LOS, PathKind.VT, PathKind.PS, PathKind.VS):
            level = strongest_db(first, paths.kind == kind)
            if np.isfinite(level).any():
                axis.plot(time, level, color=KIND[kind], lw=1.6, label=f"{kind.name}, strongest")
        for name, scheme in result.schemes.items():
            level = strongest_db(scheme, paths.kind == PathKind.RIS)
            if np.isfinite(level).any():
                random = name == "random"
                width, order = (0.7, 2) if random else (1.8, 3)
                axis.plot(time, level, color=scheme_colour(name), lw=width, zorder=order, label=f"RIS, {name}")
        threshold = detection_snr_db - snr_per_gain_db
        axis.axhline(threshold, color="#555555", lw=1.0, ls="--", label="detection threshold")
        axis.set(xlim=time_limits(time), xlabel="time [s]", ylabel="path gain [dB]")
        shift = (lambda g: np.asarray(g) + snr_per_gain_db, lambda s: np.asarray(s) - snr_per_gain_db)
        right = axis.secondary_yaxis("right", functions=shift)
        right.set_ylabel("SNR over all antennas [dB]")
        axis.set_title("What each class of paths brings", weight="bold")
        figure.legend(loc="outside lower center", ncols=4, fontsize=9)
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
        axis.set(xscale="log", xlabel="time of a step [ms]")
        axis.grid(False, axis="y")
        axis.set_title("Steps of a cycle against their budgets", weight="bold")
        handles, _ = axis.get_legend_handles_labels()
        budget_line = Line2D([], [], color="black", lw=2.0, label="budget")
        figure.legend(handles=[*handles, budget_line], loc="outside lower center", ncols=5, fontsize=9)
    return figure
