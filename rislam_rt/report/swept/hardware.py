"""Table, figure and page of the hardware study: the receiver's errors with impairments and calibration."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rislam_rt.report.markdown import NOTHING, paragraph, percent, picture, ratio, table_lines
from rislam_rt.report.style import styled
from rislam_rt.studies.swept import Group, HardwareSpec
from rislam_rt.studies.swept.spec import CALIBRATED, MismatchSection

TITLE = "Hardware: what a laboratory must reach for the panel to matter"
SCORES = ("false", "panel", "landmarks", "components", "error_over_std", "left")
HEARD, MORE_FALSE = 0.9, 2.0
"""Tolerable: least share of panel detections relative to an ideal front end, most further false components."""
WAYS = {
    "built": ("", "receiver"), "told": ("", "told"), "calibrated": (CALIBRATED, "receiver"),
    "calibrated_told": (CALIBRATED, "told"),
}  # fmt: skip
"""Ways of dealing with an impairment: suffix of the variant's name, and key of its scores."""
NAMES = dict(zip(WAYS, ("as built", "told", "calibrated", "calibrated, told"), strict=True))
MARKS = dict(zip(WAYS, (("#D55E00", "o"), ("#E69F00", "^"), ("#0072B2", "s"), ("#009E73", "D")), strict=True))
LAW = """Of each run the receiver alone is looked at, at some places of its second half, with the panel focused on
the agent. One front end a seed is built with each fault; then the same one is calibrated on the first cycles
(`hardware.calibration_cycles`), panel at rest. Told: the estimator counts the power of the distortion as noise
(`hardware.told`), as the tolerances say or as the calibration left it; of its converters' steps it always is told.
False: components a cycle that are no path. Panel: share of looks in which its direct path is reported. Landmarks:
components that came over one. Errors: half width of 68 % of the cosine errors over the reported deviations, 1 if
they are as reported. What false components do to the agent: [receiver](../receiver.md#real-hardware)."""


def hardware_content(groups: Sequence[Group], spec: HardwareSpec) -> dict[str, Any]:
    """Scores of the hardware study as plain data, by impairment, level and way of dealing with it; tolerable levels."""
    found = {str(group.point["variant"]): group for group in groups}
    ideal = _means(found.get("reference"), "receiver")
    entries = [{"fault": "none", "level": "", "note": "ideal", "way": "built", **ideal}]
    for fault in spec.faults:
        for level in fault.levels:
            for way, (end, key) in WAYS.items():
                group = found.get(fault.variant(level).name + end)
                head = {"fault": fault.name, "level": str(level), "note": fault.note, "way": way}
                entries += [{**head, **_means(group, key)}] if group is not None else []
    about = {fault.name: fault.model_dump(exclude={"set"}) for fault in spec.faults}
    limits = {fault.name: {way: _limit(fault, entries, way, ideal) for way in WAYS} for fault in spec.faults}
    return {"entries": entries, "about": about, "limits": limits}


def draw_hardware(content: Mapping[str, Any], spec: HardwareSpec) -> Figure:
    """Draw false components and panel detections of the hardware study at every level of every impairment."""
    entries = content["entries"]
    rows = list(dict.fromkeys((entry["fault"], entry["level"]) for entry in entries))
    with styled():
        figure = Figure(figsize=(9.6, 1.6 + 0.24 * len(rows)))
        for axis, score, label in zip(
            figure.subplots(1, 2, sharey=True), ("false", "panel"),
            ("false components a cycle", "share of looks in which the panel's direct path is heard"), strict=True,
        ):  # fmt: skip
            for way, (colour, mark) in MARKS.items():
                own = [e for e in entries if e["way"] == way and e[score] is not None]
                place = [rows.index((e["fault"], e["level"])) for e in own]
                axis.plot([e[score] for e in own], place, mark, color=colour, ms=5, label=NAMES[way], alpha=0.8)
            axis.set_xlabel(label, fontsize=9)
        figure.axes[0].set_yticks(range(len(rows)), [" ".join(row).strip() for row in rows], fontsize=8)
        figure.axes[0].invert_yaxis()
        figure.axes[0].set_xscale("symlog", linthresh=1.0)
        figure.axes[0].set_xticks([0, 1, 2, 5, 10, 20, 50], ["0", "1", "2", "5", "10", "20", "50"])
        figure.axes[1].set_xlim(-0.05, 1.05)
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(NAMES))
    return figure


def hardware_body(content: Mapping[str, Any], spec: HardwareSpec, figure: str | None) -> list[str]:
    """Lines of the hardware study's page: tolerable levels, the picture, all numbers."""
    ideal = content["entries"][0]
    text = f"""Largest level at which the panel is heard in {100 * HEARD:.0f} % of the looks in which an ideal front end
    hears it ({percent(ideal["panel"])}), with at most {MORE_FALSE:g} more false components a cycle than there
    ({ratio(ideal["false"])}); {NOTHING} where it is so at none of the levels tried:"""
    lines = [*paragraph(LAW), "", *paragraph(text), ""]
    head = ["fault", *NAMES.values(), "levels tried"]
    rows = [_limit_row(content, name) for name in content["about"]]
    lines += [*table_lines(head, rows), ""]
    lines += [*picture(figure, "False components and the panel's share at every level"), "## All levels", ""]
    for scores in (("false", "panel"), ("landmarks", "error_over_std")):
        head = ["fault", "level", *(f"{TITLES[score]}: {name}" for score in scores for name in NAMES.values())]
        lines += [*table_lines(head, _rows(content, scores)), ""]
    return lines[:-1]


def failed_cells(groups: Sequence[Group]) -> list[str]:
    """Line on how many cells of the hardware study failed."""
    failed = sum(result is None for group in groups for result in group.results) - sum(g.missing for g in groups)
    return [f"Of {sum(len(group.results) for group in groups)} cells {failed} failed."]


TITLES = {"false": "false", "panel": "panel", "landmarks": "landmarks", "error_over_std": "errors"}


def _means(group: Group | None, key: str) -> dict[str, Any]:
    """Mean of each of the receiver's scores in the hardware study over the front ends drawn."""
    rows = [result.get(key, result["receiver"]) for result in group.results if result] if group is not None else []
    known = {name: [row[name] for row in rows if row.get(name) is not None] for name in SCORES}
    return {"runs": len(rows), **{name: float(np.mean(values)) if values else None for name, values in known.items()}}


def _limit(
    fault: MismatchSection, entries: Sequence[Mapping[str, Any]], way: str, ideal: Mapping[str, Any]
) -> str | None:
    """Largest tolerable level of a hardware impairment, in the file's order; None if even the first is not."""
    limit = None
    for entry in entries:
        if entry["fault"] == fault.name and entry["way"] == way:
            if any(one.get("panel") is None for one in (entry, ideal)):
                break
            if entry["panel"] < HEARD * ideal["panel"] or entry["false"] > ideal["false"] + MORE_FALSE:
                break
            limit = str(entry["level"])
    return limit


def _limit_row(content: Mapping[str, Any], name: str) -> list[str]:
    """Table row of an impairment's largest tolerable levels."""
    fault, limits = content["about"][name], content["limits"][name]
    found = [limits[way] for way in WAYS]
    cells = [NOTHING if one is None else f"{one} {fault['unit']}".strip() for one in found]
    return [f"`{name}`: {fault['note']}", *cells, ", ".join(map(str, fault["levels"])) + f" {fault['unit']}"]


def _rows(content: Mapping[str, Any], scores: Sequence[str]) -> list[list[str]]:
    """Table rows of some scores at every level of every impairment."""
    table: dict[tuple[str, str], dict[str, Mapping[str, Any]]] = {}
    for entry in content["entries"]:
        table.setdefault((entry["fault"], entry["level"]), {})[entry["way"]] = entry
    rows = []
    for (name, level), ways in table.items():
        unit = content["about"].get(name, {}).get("unit", "")
        cells = [f"`{name}`", f"{level} {unit}".strip()]
        for score in scores:
            show = percent if score == "panel" else ratio
            cells += [show(ways[way][score]) if way in ways else NOTHING for way in WAYS]
        rows.append(cells)
    return rows
