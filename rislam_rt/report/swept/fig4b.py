"""Figure, tables and page of Fig. 4(b): RMSE of the agent against SNR, for all schemes with their bounds."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rislam_rt.report import markdown
from rislam_rt.report.style import scheme_styles, styled
from rislam_rt.report.swept.entries import by_scheme, interval_entry, scheme_entry, what_limits
from rislam_rt.report.swept.error_curves import draw_schemes, explain_lines
from rislam_rt.studies.swept import Fig4bSpec, Group, paired_difference, paired_gain
from rislam_rt.studies.swept.sweep import SNR

TITLE = "Error of the agent against SNR: Fig. 4(b)"
OURS = "optimized"
"""Name of the scheme that the paper proposes."""


def fig4b_content(groups: Sequence[Group], spec: Fig4bSpec) -> dict[str, Any]:
    """Scores of Fig. 4(b) as plain data: an entry for each case, SNR and scheme, and the paper's scheme's gains."""
    entries = [
        {
            "case": group.point["variant"],
            "snr_db": group.point[SNR],
            "paper_snr_db": group.mean("paper_snr_db"),
            **{name: value for name, value in scheme_entry(group, scheme).items() if name not in group.point},
            "each_m": [None if np.isnan(rmse) else float(rmse) for rmse in group.column(scheme, "rmse_m")],
        }
        for group in groups
        for scheme in group.schemes
    ]
    return {"entries": entries, "gains": [entry for group in groups for entry in gain_entries(group)]}


def gain_entries(group: Group) -> list[dict[str, Any]]:
    """Reduction of the RMSE by the paper's scheme against each other one, and that of the bounds, at one SNR."""
    if OURS not in group.schemes:
        return []
    found = []
    ours, least = group.column(OURS, "rmse_m"), group.column(OURS, "bound_m")
    for scheme in group.schemes:
        if scheme == OURS:
            continue
        theirs, bound = group.column(scheme, "rmse_m"), group.column(scheme, "bound_m")
        limit = paired_gain(least, bound)
        entry = {"case": group.point["variant"], "snr_db": group.point[SNR], "over": scheme}
        entry |= interval_entry("gain", paired_gain(ours, theirs))
        entry |= interval_entry("lower_by", paired_difference(ours, theirs), "_m")
        found.append(entry | {"bound_gain": limit.value if limit else None})
    return found


def draw_fig4b(content: Mapping[str, Any], spec: Fig4bSpec) -> Figure:
    """Draw Fig. 4(b): RMSE of all schemes against SNR, a part for each case, the paper's SNR along the top."""
    cases = [case for case in spec.cases if any(e["case"] == case.name for e in content["entries"])]
    styles = scheme_styles(entry["scheme"] for entry in content["entries"])
    with styled():
        figure = Figure(figsize=(1.2 + 5.2 * len(cases), 5.0))
        axes = figure.subplots(1, len(cases), squeeze=False)[0]
        for axis, case in zip(axes, cases, strict=True):
            entries = [entry for entry in content["entries"] if entry["case"] == case.name]
            snr = sorted({entry["snr_db"] for entry in entries})
            draw_schemes(axis, snr, by_scheme(entries, "snr_db"), styles)
            axis.set_title(f"{case.name}: {case.note}" if case.note else case.name, fontsize=9, weight="bold")
            axis.set_xlabel("SNR of a 5 cm sphere at 3 m, over signal and all antennas [dB]")
            shift = float(np.mean([entry["paper_snr_db"] - entry["snr_db"] for entry in entries]))
            top = axis.secondary_xaxis("top", functions=(lambda x, s=shift: x + s, lambda x, s=shift: x - s))
            top.set_xlabel("SNR as the paper defines it [dB]", fontsize=9)
        axes[0].set_ylabel("RMSE of the agent's position [m]")
        explain_lines(figure, axes[0])
    return figure


def fig4b_body(content: Mapping[str, Any], spec: Fig4bSpec, figure: str | None) -> list[str]:
    """Lines of the page of Fig. 4(b): the picture, errors, gains, and what limits the errors."""
    lines = markdown.picture(figure, "RMSE of the agent against SNR")
    for case in spec.cases:
        entries = [entry for entry in content["entries"] if entry["case"] == case.name]
        gains = [entry for entry in content["gains"] if entry["case"] == case.name]
        if entries:
            lines += [f"## {case.name}: {case.note}", "", *_error_lines(entries), "", *_gain_lines(gains), ""]
            lines += [*_budget_lines(entries), ""]
    return lines[:-1]


def _error_lines(entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """Tables of the RMSE of all schemes, absolute and after alignment."""
    shape = """The shape of the way alone: RMSE [m] after the turn about the vertical and the shift that fit it best.
    Most of the start's own error is not in it, which no measurement of unknown landmarks removes:"""
    return [
        "RMSE of the agent [m], with its 95 % interval:", "", *_schemes_lines(entries, "rmse"), "",
        *markdown.paragraph(shape), "", *_schemes_lines(entries, "aligned"),
    ]  # fmt: skip


def _schemes_lines(entries: Sequence[Mapping[str, Any]], error: str) -> list[str]:
    """Table of Fig. 4(b): one error of all schemes by SNR."""
    schemes = list(dict.fromkeys(entry["scheme"] for entry in entries))
    rows = []
    for snr in dict.fromkeys(entry["snr_db"] for entry in entries):
        own = {entry["scheme"]: entry for entry in entries if entry["snr_db"] == snr}
        paper = next(iter(own.values()))["paper_snr_db"]
        cells = [
            markdown.metres_between(own[scheme], error) if scheme in own else markdown.NOTHING for scheme in schemes
        ]
        rows.append([f"{snr:g}", f"{paper:.0f}", *cells])
    return markdown.table_lines(["SNR [dB]", "paper's SNR [dB]", *schemes], rows)


def _gain_lines(gains: Sequence[Mapping[str, Any]]) -> list[str]:
    """Table for Fig. 4(b) of the RMSE reductions by the paper's scheme, from pairs of equal motion and noise."""
    rivals = list(dict.fromkeys(entry["over"] for entry in gains))
    rows = []
    for snr in dict.fromkeys(entry["snr_db"] for entry in gains):
        cells = [f"{snr:g}"]
        for rival in rivals:
            entry = next(e for e in gains if e["snr_db"] == snr and e["over"] == rival)
            limit = f"; bounds {100 * entry['bound_gain']:.0f} %" if entry["bound_gain"] is not None else ""
            cells.append(f"{markdown.percent_between(entry, 'gain')}, {markdown.metres(entry['lower_by_m'])} m{limit}")
        rows.append(cells)
    title = (
        f"How far `{OURS}` is below the others, from pairs of runs with the same motion and noise (95 % interval), in"
    )
    head = ["SNR [dB]", *(f"than {rival}" for rival in rivals)]
    return [title, "metres, and the same of their bounds:", "", *markdown.table_lines(head, rows)]


def _budget_lines(entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """Table for Fig. 4(b) of bounds, NEES, association and what limits the error, by SNR and scheme."""
    rows = [
        [
            f"{entry['snr_db']:g}", entry["scheme"], markdown.metres(entry["bound_m"]),
            *(markdown.ratio(entry[name]) for name in ("over_bound", "nees_per_dof", "association")),
            f"{entry['diverged']} of {entry['runs']}", str(entry["failed"]), what_limits(entry),
        ]
        for entry in entries
    ]  # fmt: skip
    head = ["SNR [dB]", "scheme", "bound [m]", "RMSE / bound", "NEES", "association", "diverged", "failed", "limit"]
    text = """Error budget. The limit is the bound where the RMSE is within 1.5 of it, else association where fewer than
    95 % of the components are taken for what they are, else the filter. NEES is that of the position per degree of
    freedom: 1 if the estimator knows how wrong it is."""
    return [*markdown.paragraph(text), "", *markdown.table_lines(head, rows)]
