"""Fig. 4(c): errors of agent and panel against the panel's size, as figure, table and page."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rislam_rt.evaluate import Interval
from rislam_rt.report.style import MARKER, scheme_colour, styled
from rislam_rt.report.swept.entries import (
    failure_notes,
    interval_entry,
    metres,
    metres_between,
    panel_of,
    percent_between,
    ratio,
    scheme_entry,
    table_lines,
    what_limits,
)
from rislam_rt.report.swept.error_curves import draw_schemes, explain_lines, label_ends, mark_metres
from rislam_rt.studies.swept import Group, paired_gain, spread


def fig4c_content(groups: Sequence[Group]) -> dict[str, Any]:
    """Plain data: one entry a size and scheme, and how much lower the largest panel's error is than the smallest's."""
    return {
        "entries": [_entry(group, scheme) for group in groups for scheme in group.schemes],
        "falls": [_fall(groups, scheme) for scheme in groups[0].schemes] if groups else [],
    }


def draw_fig4c(content: Mapping[str, Any]) -> Figure:
    """Draw Fig. 4(c): agent left, panel right, on a logarithmic axis of panel sizes."""
    entries = content["entries"]
    sizes = sorted({entry["size"] for entry in entries})
    curves: dict[str, list[Mapping[str, Any]]] = {}
    for entry in sorted(entries, key=lambda entry: entry["size"]):
        curves.setdefault(entry["scheme"], []).append(entry)
    with styled():
        figure = Figure(figsize=(11.0, 4.8))
        agent, panel = figure.subplots(1, 2)
        draw_schemes(agent, sizes, curves)
        explain_lines(figure, agent)
        ends = {}
        for scheme, own in curves.items():
            value, low, high = (
                np.array([np.nan if e[name] is None else e[name] for e in own], dtype=np.float64)
                for name in ("panel_m", "panel_low_m", "panel_high_m")
            )
            if np.isnan(value).all():
                continue
            colour = scheme_colour(scheme)
            panel.fill_between(sizes, low, high, color=colour, alpha=0.13, lw=0.0)
            panel.plot(sizes, value, color=colour, marker=MARKER.get(scheme, "o"), ms=5, lw=1.7)
            ends[scheme] = float(value[~np.isnan(value)][-1])
        panel.set_yscale("log")
        mark_metres(panel.yaxis)
        label_ends(panel, ends)
        for axis, what in ((agent, "agent's position"), (panel, "panel's position at the end")):
            axis.set_xticks(sizes, [f"{size} x {size}" for size in sizes], fontsize=9)
            axis.set_xlabel("elements of the panel")
            axis.set_ylabel(f"RMSE of the {what} [m]")
    return figure


def fig4c_page(content: Mapping[str, Any], groups: Sequence[Group], about: Sequence[str], figure: str | None) -> str:
    """Page of Fig. 4(c): what was done, the picture, the tables."""
    lines = ["# Error against the panel's size: Fig. 4(c)", "", *about, ""]
    lines += [
        "Gains of the panel are summed element by element; the far field begins farther off than the room is high"
    ]
    lines += ["from 10 x 10 elements on. The panel's position is that at the end of a run, where the map holds it.", ""]
    if figure is not None:
        lines += [f"![RMSE of agent and panel against the panel's size]({figure})", ""]
    rows = [
        [
            f"{entry['size']} x {entry['size']}", entry["scheme"], metres_between(entry), metres(entry["bound_m"]),
            ratio(entry["over_bound"]), _panel_text(entry), ratio(entry["ris_found"]), ratio(entry["association"]),
            f"{entry['diverged']} of {entry['runs']}", str(entry["failed"]), what_limits(entry),
        ]
        for entry in content["entries"]
    ]  # fmt: skip
    head = [
        "panel", "scheme", "agent RMSE [m]", "bound [m]", "RMSE / bound", "panel RMSE [m]", "panel found",
        "association", "diverged", "failed", "limit",
    ]  # fmt: skip
    lines += [*table_lines(head, rows), "", "## From the smallest to the largest panel", ""]
    for fall in content["falls"]:
        agent, panel = _percent(fall, "agent"), _percent(fall, "panel")
        lines.append(f"- `{fall['scheme']}`: agent's RMSE lower by {agent}, panel's by {panel}")
    return "\n".join([*lines, "", "## Failures", "", *failure_notes(groups)]) + "\n"


def panel_error(group: Group, scheme: str) -> Any:
    """(R,) distance [m] of the panel's estimate at the end, for Fig. 4(c); NaN where the map has none."""
    name = panel_of(group, scheme)
    return np.full(len(group.results), np.nan) if name is None else group.column(scheme, "landmarks", name, "final_m")


def _entry(group: Group, scheme: str) -> dict[str, Any]:
    panel = interval_entry("panel", spread(panel_error(group, scheme)), "_m")
    return {**scheme_entry(group, scheme), **panel}


def _fall(groups: Sequence[Group], scheme: str) -> dict[str, Any]:
    """Fall in Fig. 4(c): lower RMSE with the largest panel than with the smallest, as a share."""
    ordered = sorted(groups, key=lambda group: group.point["size"])
    small, large = ordered[0], ordered[-1]
    agent = paired_gain(large.column(scheme, "rmse_m"), small.column(scheme, "rmse_m"))
    panel = paired_gain(panel_error(large, scheme), panel_error(small, scheme))
    return {"scheme": scheme, **interval_entry("agent", agent), **interval_entry("panel", panel)}


def _panel_text(entry: Mapping[str, Any]) -> str:
    return metres_between(
        {name: entry[name.replace("rmse", "panel")] for name in ("rmse_m", "rmse_low_m", "rmse_high_m")}
    )


def _percent(fall: Mapping[str, Any], name: str) -> str:
    if fall[name] is None:
        return "an unknown share"
    return percent_between(Interval(fall[name], fall[f"{name}_low"], fall[f"{name}_high"]))
