"""Robustness against a belief that is told wrong: the agent's error by mismatch, as table, figure and page."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rislam_rt.evaluate import Interval
from rislam_rt.report.style import styled
from rislam_rt.report.swept.entries import (
    failure_notes,
    interval_entry,
    metres,
    metres_between,
    paragraph,
    percent_between,
    ratio,
    scheme_entry,
    table_lines,
)
from rislam_rt.report.swept.error_curves import mark_metres
from rislam_rt.studies.swept import Group, RobustnessSpec, paired_gain

WORST = 3
"""Mismatches that are named."""
LEVELS = ("#9ecae1", "#4292c6", "#08519c", "#08306b")
"""Colours of the levels, the first one first."""
REFERENCE = "#8c8c8c"
LAW = """One quantity at a time is not as filter and design are told ([list](../told.md)), all else right. The change is
that of the agent's RMSE against the reference, from pairs of runs with the same motion and noise; a wrong height is
part of the error. The bound is that of an agent that is told the truth."""


def robustness_content(groups: Sequence[Group], spec: RobustnessSpec) -> dict[str, Any]:
    """Plain data: one entry a level and scheme, with the change against the reference, seed by seed; and the worst."""
    levels = {
        mismatch.variant(level).name: (mismatch, level) for mismatch in spec.mismatches for level in mismatch.levels
    }
    reference = next((group for group in groups if group.point["variant"] == "reference"), None)
    entries = []
    for group in groups:
        mismatch, level = levels.get(str(group.point["variant"]), (None, None))
        for scheme in group.schemes:
            change = _change(group, reference, scheme) if mismatch is not None else None
            entries.append(
                {
                    **scheme_entry(group, scheme),
                    "mismatch": mismatch.name if mismatch else "",
                    "level": str(level) if mismatch else "",
                    "ordinary": bool(mismatch and level == mismatch.ordinary),
                    **interval_entry("change", change),
                }
            )
    about = {mismatch.name: mismatch.model_dump(exclude={"set"}) for mismatch in spec.mismatches}
    return {"entries": entries, "about": about, "worst": worst_mismatches(entries)}


def worst_mismatches(entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """Mismatches that robustness is worst against, by their change at the level of ordinary equipment, the largest
    first; the first scheme counts."""
    first = entries[0]["scheme"] if entries else ""
    known = {e["mismatch"]: e["change"] for e in entries if e["ordinary"] and e["scheme"] == first and e["change"]}
    return sorted((name for name, change in known.items() if change > 0.0), key=lambda name: -known[name])


def draw_robustness(content: Mapping[str, Any]) -> Figure:
    """Draw robustness: RMSE of every level with its interval, one row a mismatch, the reference as a line."""
    entries = [entry for entry in content["entries"] if entry["rmse_m"] is not None]
    scheme = entries[0]["scheme"] if entries else ""
    own = [entry for entry in entries if entry["scheme"] == scheme]
    rows = list(dict.fromkeys(entry["mismatch"] for entry in own if entry["mismatch"]))
    with styled():
        figure = Figure(figsize=(8.6, 1.6 + 0.36 * len(rows)))
        axis = figure.subplots()
        for base in (entry for entry in own if not entry["mismatch"]):
            axis.axvspan(base["rmse_low_m"] or base["rmse_m"], base["rmse_high_m"] or base["rmse_m"], color="#eeeeee")
            axis.axvline(base["rmse_m"], color=REFERENCE, lw=1.0, ls=":")
        for row, name in enumerate(rows):
            levels = [entry for entry in own if entry["mismatch"] == name]
            for number, entry in enumerate(levels):
                _draw_level(axis, row + 0.2 * (number - 0.5 * (len(levels) - 1)), entry, LEVELS[number % len(LEVELS)])
        axis.set_yticks(range(len(rows)), [_label(content, name) for name in rows], fontsize=8)
        axis.set_ylim(len(rows) - 0.4, -0.6)
        axis.set_xscale("log")
        mark_metres(axis.xaxis)
        axis.set_xlabel(f"RMSE of the agent's position [m], {scheme}; dotted: nothing wrong")
        axis.set_title("Levels from light to dark; ring: ordinary equipment", fontsize=10)
    return figure


def robustness_page(
    content: Mapping[str, Any], groups: Sequence[Group], about: Sequence[str], figure: str | None
) -> str:
    """Page on robustness: what was done, the worst mismatches with their cures, the picture, a table."""
    lines = ["# Robustness: what happens when the belief is told wrong", "", *about, ""]
    lines += [*paragraph(LAW), "", "## The worst at the level of ordinary equipment", ""]
    lines += [*table_lines(["mismatch", "level", "change", "what would cure it"], _worst_rows(content)), ""]
    lines += ["In this order after them: " + ", ".join(f"`{name}`" for name in content["worst"][WORST:]) + ".", ""]
    if figure is not None:
        lines += [f"![RMSE at every level of every mismatch]({figure})", ""]
    lines += ["## All levels", "", "An asterisk marks the level of ordinary equipment.", ""]
    lines += [*table_lines(_HEAD, [_row(content, entry) for entry in content["entries"]]), ""]
    lines += ["## Why a level is ordinary", ""]
    lines += [f"- `{name}`, {_level(content, name, mismatch['ordinary'])}: {mismatch['source']}."
              for name, mismatch in content["about"].items() if mismatch["source"]]  # fmt: skip
    return "\n".join([*lines, "", "## Failures", "", *failure_notes(groups)]) + "\n"


_HEAD = ["mismatch", "level", "scheme", "agent RMSE [m]", "change", "bound [m]", "shape of the way [m]", "NEES",
         "panel [m]", "panel found", "association", "diverged", "failed"]  # fmt: skip


def _change(group: Group, reference: Group | None, scheme: str) -> Interval | None:
    if reference is None:
        return None
    gain = paired_gain(group.column(scheme, "rmse_m"), reference.column(scheme, "rmse_m"))
    return Interval(-gain.value, -gain.upper, -gain.lower) if gain else None


def _worst_rows(content: Mapping[str, Any]) -> list[list[str]]:
    rows = []
    first = content["entries"][0]["scheme"] if content["entries"] else ""
    for name in content["worst"][:WORST]:
        mismatch = content["about"][name]
        mine = [entry for entry in content["entries"] if entry["mismatch"] == name and entry["ordinary"]]
        entry = next(entry for entry in mine if entry["scheme"] == first)
        note = f"`{name}`: {mismatch['note']}"
        rows.append([note, _level(content, name, entry["level"]), percent_between(_between(entry)), mismatch["cure"]])
    return rows


def _row(content: Mapping[str, Any], entry: Mapping[str, Any]) -> list[str]:
    name = entry["mismatch"]
    note = f"`{name}`: {content['about'][name]['note']}" if name else "`reference`: nothing is wrong"
    level = _level(content, name, entry["level"]) + ("*" if entry["ordinary"] else "") if name else ""
    found = "-" if entry["ris_found"] is None else f"{100 * entry['ris_found']:.0f} %"
    return [
        note, level, entry["scheme"], metres_between(entry), percent_between(_between(entry)), metres(entry["bound_m"]),
        metres(entry["aligned_m"]), ratio(entry["nees_per_dof"]), metres(entry["ris_m"]), found,
        ratio(entry["association"]), f"{entry['diverged']} of {entry['runs']}", str(entry["failed"]),
    ]  # fmt: skip


def _between(entry: Mapping[str, Any]) -> Interval | None:
    if entry["change"] is None:
        return None
    ends = (np.nan if entry[name] is None else entry[name] for name in ("change_low", "change_high"))
    return Interval(entry["change"], *ends)


def _level(content: Mapping[str, Any], name: str, level: Any) -> str:
    return f"{level} {content['about'][name]['unit']}".strip()


def _label(content: Mapping[str, Any], name: str) -> str:
    levels = ", ".join(str(level) for level in content["about"][name]["levels"])
    return f"{name}: {levels} {content['about'][name]['unit']}".strip()


def _draw_level(axis: Any, row: float, entry: Mapping[str, Any], colour: str) -> None:
    value, low, high = (entry[name] or entry["rmse_m"] for name in ("rmse_m", "rmse_low_m", "rmse_high_m"))
    axis.plot([low, high], [row, row], color=colour, lw=1.4)
    edge = "black" if entry["ordinary"] else colour
    axis.plot([value], [row], color=colour, marker="o", ms=5.5, mec=edge, mew=1.0)
