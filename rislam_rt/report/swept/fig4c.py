"""Figure, table and page of Fig. 4(c): RMSE of agent and panel against the panel's size."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rislam_rt.report.markdown import metres, metres_between, percent_between, picture, ratio, table_lines
from rislam_rt.report.style import scheme_styles, styled
from rislam_rt.report.swept.entries import by_scheme, interval_entry, panels_of, scheme_entry, what_limits
from rislam_rt.report.swept.error_curves import draw_error, draw_schemes, explain_lines, label_ends, log_metres
from rislam_rt.studies.swept import Fig4cSpec, Group, paired_gain, spread

TITLE = "Error against the panel's size: Fig. 4(c)"


def fig4c_content(groups: Sequence[Group], spec: Fig4cSpec) -> dict[str, Any]:
    """Scores of Fig. 4(c) as plain data: an entry for each panel size and scheme, and the RMSE's fall with size."""
    return {
        "entries": [
            {**scheme_entry(group, scheme), **interval_entry("panel", spread(panel_error(group, scheme)), "_m")}
            for group in groups
            for scheme in group.schemes
        ],
        "falls": [_fall(groups, scheme) for scheme in groups[0].schemes] if groups else [],
    }


def draw_fig4c(content: Mapping[str, Any], spec: Fig4cSpec) -> Figure:
    """Draw Fig. 4(c): RMSE of the agent (left) and of the panel (right) against the panel's size."""
    entries = content["entries"]
    sizes = sorted({entry["size"] for entry in entries})
    curves = by_scheme(entries, "size")
    styles = scheme_styles(curves)
    with styled():
        figure = Figure(figsize=(11.0, 4.8))
        agent, panel = figure.subplots(1, 2)
        draw_schemes(agent, sizes, curves, styles)
        explain_lines(figure, agent)
        for scheme, own in curves.items():
            if any(entry["panel_m"] is not None for entry in own):
                draw_error(panel, sizes, own, styles[scheme], "panel")
        log_metres(panel)
        label_ends(panel, curves, styles, "panel_m")
        for axis, what in ((agent, "agent's position"), (panel, "panel's position at the end")):
            axis.set_xticks(sizes, [f"{size} x {size}" for size in sizes], fontsize=9)
            axis.set(xlabel="elements of the panel", ylabel=f"RMSE of the {what} [m]")
    return figure


def fig4c_body(content: Mapping[str, Any], spec: Fig4cSpec, figure: str | None) -> list[str]:
    """Lines of the page of Fig. 4(c): the picture, and a table of errors."""
    lines = ["Gains of the panel are summed element by element; the far field begins farther off than the room is high",
             "from 10 x 10 elements on. The panel's position is that at the end of a run, where the map holds it.", "",
             *picture(figure, "RMSE of agent and panel against the panel's size")]  # fmt: skip
    rows = [
        [
            f"{entry['size']} x {entry['size']}", entry["scheme"], metres_between(entry), metres(entry["bound_m"]),
            ratio(entry["over_bound"]), metres_between(entry, "panel"), ratio(entry["ris_found"]),
            ratio(entry["association"]), f"{entry['diverged']} of {entry['runs']}", str(entry["failed"]),
            what_limits(entry),
        ]
        for entry in content["entries"]
    ]  # fmt: skip
    head = [
        "panel", "scheme", "agent RMSE [m]", "bound [m]", "RMSE / bound", "panel RMSE [m]", "panel found",
        "association", "diverged", "failed", "limit",
    ]  # fmt: skip
    lines += [*table_lines(head, rows), "", "## From the smallest to the largest panel", ""]
    for fall in content["falls"]:
        agent, panel = (
            "an unknown share" if fall[name] is None else percent_between(fall, name) for name in ("agent", "panel")
        )
        lines.append(f"- `{fall['scheme']}`: agent's RMSE lower by {agent}, panel's by {panel}")
    return lines


def panel_error(group: Group, scheme: str) -> Any:
    """Position error (R,) [m] of the (first) panel at the end of each run, for Fig. 4(c); NaN if not mapped."""
    panels = panels_of(group, scheme)
    return group.column(scheme, "landmarks", panels[0], "final_m") if panels else np.full(len(group.results), np.nan)


def _fall(groups: Sequence[Group], scheme: str) -> dict[str, Any]:
    """Relative reduction of a scheme's RMSE of agent and panel from the smallest to the largest panel."""
    ordered = sorted(groups, key=lambda group: group.point["size"])
    small, large = ordered[0], ordered[-1]
    agent = paired_gain(large.column(scheme, "rmse_m"), small.column(scheme, "rmse_m"))
    panel = paired_gain(panel_error(large, scheme), panel_error(small, scheme))
    return {"scheme": scheme, **interval_entry("agent", agent), **interval_entry("panel", panel)}
