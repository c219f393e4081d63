"""Table, figure and page of the robustness study: change of the agent's RMSE by model mismatch."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from rislam_rt.report import markdown
from rislam_rt.report.style import styled
from rislam_rt.report.swept.entries import interval_entry, rmse_change, scheme_entry
from rislam_rt.report.swept.error_curves import draw_rmse, ends_of, log_metres
from rislam_rt.studies.swept import Group, RobustnessSpec

WORST = 3
"""Number of the worst mismatches that are listed."""
LEVELS = ("#9ecae1", "#4292c6", "#08519c", "#08306b")
"""Colours of a mismatch's levels, in their order."""
REFERENCE = "#8c8c8c"
TITLE = "Robustness: what happens when the belief is told wrong"
LAW = """One quantity at a time is not as filter and design are told ([list](../told.md)), all else right. The change is
that of the agent's RMSE against the reference, from pairs of runs with the same motion and noise; a wrong height is
part of the error. The bound is that of an agent that is told the truth."""


def robustness_content(groups: Sequence[Group], spec: RobustnessSpec) -> dict[str, Any]:
    """Scores of the robustness study as plain data: by mismatch level and scheme, with the change of the RMSE."""
    levels = {
        mismatch.variant(level).name: (mismatch, level) for mismatch in spec.mismatches for level in mismatch.levels
    }
    reference = next((group for group in groups if group.point["variant"] == "reference"), None)
    entries = []
    for group in groups:
        mismatch, level = levels.get(str(group.point["variant"]), (None, None))
        for scheme in group.schemes:
            change = None
            if mismatch is not None and reference is not None:
                change = rmse_change(group, scheme, reference.column(scheme, "rmse_m"))
            about_it = {
                "mismatch": mismatch.name if mismatch else "",
                "level": str(level) if mismatch else "",
                "ordinary": bool(mismatch and level == mismatch.ordinary),
            }
            entries.append({**scheme_entry(group, scheme), **about_it, **interval_entry("change", change)})
    about = {mismatch.name: mismatch.model_dump(exclude={"set"}) for mismatch in spec.mismatches}
    return {"entries": entries, "about": about, "worst": worst_mismatches(entries)}


def worst_mismatches(entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """Mismatches that raise the first scheme's RMSE at the level of ordinary equipment, the worst first."""
    first = entries[0]["scheme"] if entries else ""
    known = {e["mismatch"]: e["change"] for e in entries if e["ordinary"] and e["scheme"] == first and e["change"]}
    return sorted((name for name, change in known.items() if change > 0.0), key=lambda name: -known[name])


def draw_robustness(content: Mapping[str, Any], spec: RobustnessSpec) -> Figure:
    """Draw the RMSE at every level of every mismatch with its interval, a row a mismatch, the reference as a line."""
    entries = [entry for entry in content["entries"] if entry["rmse_m"] is not None]
    scheme = entries[0]["scheme"] if entries else ""
    own = [entry for entry in entries if entry["scheme"] == scheme]
    rows = list(dict.fromkeys(entry["mismatch"] for entry in own if entry["mismatch"]))
    with styled():
        figure = Figure(figsize=(8.6, 1.6 + 0.36 * len(rows)))
        axis = figure.subplots()
        for base in (entry for entry in own if not entry["mismatch"]):
            axis.axvspan(*ends_of(base), color="#eeeeee")
            axis.axvline(base["rmse_m"], color=REFERENCE, lw=1.0, ls=":")
        for row, name in enumerate(rows):
            levels = [entry for entry in own if entry["mismatch"] == name]
            for number, entry in enumerate(levels):
                colour, place = LEVELS[number % len(LEVELS)], row + 0.2 * (number - 0.5 * (len(levels) - 1))
                edge = "black" if entry["ordinary"] else colour
                draw_rmse(axis, place, entry, colour, ms=5.5, mec=edge, mew=1.0)
        axis.set_yticks(range(len(rows)), [_label(content, name) for name in rows], fontsize=8)
        axis.set_ylim(len(rows) - 0.4, -0.6)
        log_metres(axis, "x")
        axis.set_xlabel(f"RMSE of the agent's position [m], {scheme}; dotted: nothing wrong")
        axis.set_title("Levels from light to dark; ring: ordinary equipment", fontsize=10)
    return figure


def robustness_body(content: Mapping[str, Any], spec: RobustnessSpec, figure: str | None) -> list[str]:
    """Lines of the robustness study's page: the worst mismatches with their remedies, the picture, a table."""
    lines = [*markdown.paragraph(LAW), "", "## The worst at the level of ordinary equipment", ""]
    lines += [*markdown.table_lines(["mismatch", "level", "change", "what would cure it"], _worst_rows(content)), ""]
    lines += ["In this order after them: " + ", ".join(f"`{name}`" for name in content["worst"][WORST:]) + ".", ""]
    lines += markdown.picture(figure, "RMSE at every level of every mismatch")
    lines += ["## All levels", "", "An asterisk marks the level of ordinary equipment.", ""]
    lines += [*markdown.table_lines(_HEAD, [_row(content, entry) for entry in content["entries"]]), ""]
    lines += ["## Why a level is ordinary", ""]
    return lines + [f"- `{name}`, {_level(content, name, mismatch['ordinary'])}: {mismatch['source']}."
                    for name, mismatch in content["about"].items() if mismatch["source"]]  # fmt: skip


_HEAD = ["mismatch", "level", "scheme", "agent RMSE [m]", "change", "bound [m]", "shape of the way [m]", "NEES",
         "panel [m]", "panel found", "association", "diverged", "failed"]  # fmt: skip


def _worst_rows(content: Mapping[str, Any]) -> list[list[str]]:
    """Table rows of the mismatches worst for robustness, with their remedies."""
    rows = []
    first = content["entries"][0]["scheme"] if content["entries"] else ""
    for name in content["worst"][:WORST]:
        mismatch = content["about"][name]
        mine = [entry for entry in content["entries"] if entry["mismatch"] == name and entry["ordinary"]]
        entry = next(entry for entry in mine if entry["scheme"] == first)
        note = f"`{name}`: {mismatch['note']}"
        rows.append(
            [note, _level(content, name, entry["level"]), markdown.percent_between(entry, "change"), mismatch["cure"]]
        )
    return rows


def _row(content: Mapping[str, Any], entry: Mapping[str, Any]) -> list[str]:
    """Table row of a mismatch level."""
    name = entry["mismatch"]
    note = f"`{name}`: {content['about'][name]['note']}" if name else "`reference`: nothing is wrong"
    level = _level(content, name, entry["level"]) + ("*" if entry["ordinary"] else "") if name else ""
    return [
        note, level, entry["scheme"], markdown.metres_between(entry), markdown.percent_between(entry, "change"),
        markdown.metres(entry["bound_m"]), markdown.metres(entry["aligned_m"]), markdown.ratio(entry["nees_per_dof"]),
        markdown.metres(entry["ris_m"]), markdown.percent(entry["ris_found"]), markdown.ratio(entry["association"]),
        f"{entry['diverged']} of {entry['runs']}", str(entry["failed"]),
    ]  # fmt: skip


def _level(content: Mapping[str, Any], name: str, level: Any) -> str:
    """Level of a mismatch with its unit."""
    return f"{level} {content['about'][name]['unit']}".strip()


def _label(content: Mapping[str, Any], name: str) -> str:
    """Label of a mismatch in the figure: name, levels, unit."""
    levels = ", ".join(str(level) for level in content["about"][name]["levels"])
    return f"{name}: {levels} {content['about'][name]['unit']}".strip()
