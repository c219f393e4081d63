"""Table, figure and page of the ablations: change of the RMSE with one setting changed at a time."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rislam_rt.report.markdown import metres, metres_between, percent_between, picture, ratio, table_lines
from rislam_rt.report.style import TRUTH, styled
from rislam_rt.report.swept.entries import interval_entry, rmse_change, scheme_entry
from rislam_rt.report.swept.error_curves import draw_rmse, log_metres
from rislam_rt.studies.swept import AblationsSpec, Group

TITLE = "Ablations: one setting at a time"
WORSE, BETTER, SAME = "#D55E00", "#0072B2", "#8c8c8c"


def ablations_content(groups: Sequence[Group], spec: AblationsSpec) -> dict[str, Any]:
    """Scores of the ablations as plain data: an entry for each variant and scheme, with the change of its RMSE.

    The change is that against the reference's first scheme, seed by seed.
    """
    about = {variant.name: variant for variant in spec.variants}
    base = groups[0]
    own = base.column(base.schemes[0], "rmse_m") if base.schemes else np.full(len(base.results), np.nan)
    entries = []
    for group in groups:
        variant = about[str(group.point["variant"])]
        for scheme in group.schemes:
            first = group is base and scheme == base.schemes[0]
            change = interval_entry("change", None if first else rmse_change(group, scheme, own))
            about_it = {"group": variant.group, "note": variant.note}
            entries.append({**scheme_entry(group, scheme), **about_it, **change})
    return {"reference": spec.variants[0].name, "entries": entries}


def draw_ablations(content: Mapping[str, Any], spec: AblationsSpec) -> Figure:
    """Draw the RMSE of every ablation with its interval, its posterior bound as a tick, the reference as a line."""
    entries = [entry for entry in content["entries"] if entry["rmse_m"] is not None]
    with styled():
        figure = Figure(figsize=(8.2, 1.4 + 0.3 * len(entries)))
        axis = figure.subplots()
        for row, entry in enumerate(entries):
            draw_rmse(axis, row, entry, _colour(entry), ms=6)
            if entry["bound_m"]:
                axis.plot([entry["bound_m"]], [row], color=TRUTH, marker="|", ms=11, mew=1.6)
        if entries:
            axis.axvline(entries[0]["rmse_m"], color=SAME, lw=1.0, ls=":")
        labels = [": ".join(part for part in (entry["group"], entry["variant"]) if part) for entry in entries]
        axis.set_yticks(range(len(entries)), labels, fontsize=9)
        axis.invert_yaxis()
        log_metres(axis, "x")
        axis.grid(axis="y", visible=False)
        axis.set_xlabel("RMSE of the agent's position [m]: dot with 95 % interval; black tick: posterior bound")
        axis.set_title("blue: better than the reference, orange: worse, grey: no telling", fontsize=10)
    return figure


def ablations_body(content: Mapping[str, Any], spec: AblationsSpec, figure: str | None) -> list[str]:
    """Lines of the ablations' page: the picture, and a table for each group of variants."""
    lines = [
        f"The reference is `{content['reference']}`. The change is that of the agent's RMSE against it, from pairs of",
        "runs with the same motion and noise; more is worse.", "",
    ]  # fmt: skip
    lines += picture(figure, "RMSE of every variant")
    for name in dict.fromkeys(entry["group"] for entry in content["entries"]):
        own = [entry for entry in content["entries"] if entry["group"] == name]
        lines += [f"## {name or 'Reference'}", "", *table_lines(_HEAD, [_row(entry) for entry in own]), ""]
    return lines[:-1]


_HEAD = [
    "variant", "scheme", "agent RMSE [m]", "change", "bound [m]", "RMSE / bound", "NEES", "panel [m]",
    "scatterers [m]", "walls [m]", "association", "diverged", "failed",
]  # fmt: skip


def _row(entry: Mapping[str, Any]) -> list[str]:
    """Table row of an ablation."""
    return [
        f"`{entry['variant']}`" + (f": {entry['note']}" if entry["note"] else ""), entry["scheme"],
        metres_between(entry), percent_between(entry, "change"), metres(entry["bound_m"]), ratio(entry["over_bound"]),
        ratio(entry["nees_per_dof"]), metres(entry["ris_m"]), metres(entry["scatterer_m"]), metres(entry["wall_m"]),
        ratio(entry["association"]), f"{entry['diverged']} of {entry['runs']}", str(entry["failed"]),
    ]  # fmt: skip


def _colour(entry: Mapping[str, Any]) -> str:
    """Colour of an ablation: better, worse, or no significant change."""
    if entry["change"] is None or entry["change_low"] <= 0.0 <= entry["change_high"]:
        return SAME
    return WORSE if entry["change"] > 0.0 else BETTER
