"""Table, figure and page of the study in many rooms: errors of agent, landmarks and walls, and which aims are met."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rislam_rt.evaluate import NEAR_ANGLE, NEAR_WALL
from rislam_rt.input_messages import share_text
from rislam_rt.pipeline.scores.audible_paths import HEARD
from rislam_rt.report.markdown import metres, metres_between, paragraph, picture, ratio, table_lines
from rislam_rt.report.style import legend_below, scheme_styles, styled
from rislam_rt.report.swept.entries import scheme_entry, what_limits
from rislam_rt.report.swept.error_curves import ends_of, log_metres
from rislam_rt.shipped import short_names
from rislam_rt.studies.swept import Group, RoomsSpec

TITLE = "All rooms"
AIMS: dict[str, float] = {
    "rmse_m": 0.04, "over_bound": 1.5, "ris_m": 0.06, "scatterer_m": 0.1, "wall_deg": 2.0, "wall_m": 0.1, "diverged": 0,
    "failed": 0,
}  # fmt: skip
"""Aims: the largest value of each score that is good enough."""
BOUND_OF = {
    "ris_m": "ris_bound_m", "scatterer_m": "scatterer_bound_m", "wall_deg": "wall_bound_deg", "wall_m": "wall_bound_m",
}  # fmt: skip
"""Names of the posterior bounds of the errors of landmarks and walls."""


def rooms_content(groups: Sequence[Group], spec: RoomsSpec) -> dict[str, Any]:
    """Scores of the study of the shipped rooms as plain data: an entry a room, variant and scheme, and missed aims."""
    entries = []
    usual = groups[0].point.get("variant", "") if groups else ""
    rooms = short_names(str(group.point["scene"]) for group in groups)
    for group in groups:
        room, variant = rooms[str(group.point["scene"])], group.point.get("variant", "")
        for scheme in group.schemes:
            series = scheme if variant == usual else f"{scheme}, {variant}"
            entry = scheme_entry(group, scheme)
            missed = missed_aims(entry)
            limits = {name: budget(entry, name) for name in missed}
            found = {"limit": what_limits(entry), "missed": missed, "limits": limits}
            entries.append({"room": room, "series": series, **entry, **found})
    return {"entries": entries, "aims": AIMS}


def budget(entry: Mapping[str, Any], name: str) -> str:
    """What limits a score that misses its aim in one of the rooms: `bound`, `association`, `filter`, or `not heard` (no
    path)."""
    if name not in BOUND_OF:
        return what_limits(entry)
    error, bound = entry[name], entry[BOUND_OF[name]]
    if bound is None:
        return "not heard"
    if error is None:  # never found: it could have been if the bound is below the aim
        return "bound" if bound > AIMS[name] else what_limits(entry, np.inf)
    return what_limits(entry, error / bound if bound else np.inf)


def missed_aims(entry: Mapping[str, Any]) -> list[str]:
    """Names of the scores that miss their aim in a room; a panel or scatterer that was never found misses its own."""
    there = {"ris_m": "ris_found", "scatterer_m": "scatterer_found"}
    asked = {name: limit for name, limit in AIMS.items() if name not in there or entry[there[name]] is not None}
    return [name for name, limit in asked.items() if entry[name] is None or entry[name] > limit]


def draw_rooms(content: Mapping[str, Any], spec: RoomsSpec) -> Figure:
    """Draw the agent's RMSE of all schemes in many rooms, with posterior bounds as short bars, and the aim."""
    entries = content["entries"]
    rooms = list(dict.fromkeys(entry["room"] for entry in entries))
    series = {entry["series"]: entry["scheme"] for entry in entries}
    styles = scheme_styles(series.values())
    with styled():
        figure = Figure(figsize=(max(6.0, 2.5 + 1.05 * len(rooms)), 4.6))
        axis = figure.subplots()
        for number, (name, scheme) in enumerate(series.items()):
            shift = 0.14 * (number - 0.5 * (len(series) - 1))
            own = {entry["room"]: entry for entry in entries if entry["series"] == name}
            shown = [room for room in rooms if room in own and own[room]["rmse_m"]]
            x = np.array([rooms.index(room) + shift for room in shown])
            value = np.array([own[room]["rmse_m"] for room in shown])
            ends = np.array([ends_of(own[room]) for room in shown]).reshape(-1, 2)
            bound = [own[room]["bound_m"] for room in shown]
            colour, marker = styles[scheme]
            axis.errorbar(
                x, value, np.abs(ends.T - value), color=colour, ls="none", marker=marker, ms=5,
                capsize=2, label=name, mfc=colour if name == scheme else "white",
            )  # fmt: skip
            axis.hlines(bound, x - 0.06, x + 0.06, color=colour, lw=2.0, ls=(0, (1, 0.6)))
        axis.axhline(AIMS["rmse_m"], color="black", lw=0.9, ls=":")
        axis.text(1.0, AIMS["rmse_m"], " aim", va="center", fontsize=9, transform=axis.get_yaxis_transform())
        log_metres(axis)
        axis.set_xticks(range(len(rooms)), rooms, rotation=20, ha="right")
        axis.set_ylabel("RMSE of the agent's position [m]")
        axis.set_title("Marks: RMSE over seeds with 95 % interval; short bars: posterior bound", fontsize=10)
        legend_below(figure, axis.get_legend_handles_labels()[0], columns=6)
    return figure


def rooms_body(content: Mapping[str, Any], spec: RoomsSpec, figure: str | None) -> list[str]:
    """Lines of the page of the swept study in the shipped rooms: the aims, the picture, a table of all rooms."""
    aims = content["aims"]
    text = f"""Aims: agent's RMSE at most {aims["rmse_m"]:g} m and {aims["over_bound"]:g} times its posterior bound,
    panel at most {aims["ris_m"]:g} m, scatterers {aims["scatterer_m"]:g} m, walls {aims["wall_deg"]:g} degrees and
    {aims["wall_m"]:g} m, no divergence. Landmarks and walls are scored at the end of a run, RMS over those found,
    each with the posterior bound of the same ones; a share in brackets says how many were, of walls among those
    over which a path is above the detection threshold for {HEARD:g} s in all. A plane of the map stands for a wall
    within {NEAR_WALL:g} m of it (RMS over its surface) and {NEAR_ANGLE:g} degrees, one to one, walls in one plane
    being one; those that stand for none, heard or not, are ghosts, a mean number a run. The distance of a wall is
    that at the middle of its surface. "From" is when the map first held the panel, and in brackets when a path over
    it was first audible, both since the run's begin, in the median of the runs in which they were. "Own" is the
    deviation of the angle that the map itself reckons with. GOSPA is of the map's points, cut off at 1 m, order 2."""
    lines = [*paragraph(text), ""]
    text = """The error budget: each aim that is missed, with what limits it. That is the bound where the error is
    within 1.5 of it, else association where fewer than 95 % of the components are taken for what they are, else the
    filter. The bounds know the association and hold all paths as resolved."""
    lines += [*paragraph(text), "", *picture(figure, "RMSE of the agent in every room")]
    head = [
        "room", "scheme", "agent RMSE [m]", "bound [m]", "RMSE / bound", "NEES", "panel [m]", "from [s]",
        "scatterers [m]", "walls [deg]", "own [deg]", "walls [m]", "ghosts", "GOSPA [m]", "association", "diverged",
        "failed", "aims missed: limit",
    ]  # fmt: skip
    rows = [
        [
            entry["room"], entry["series"], metres_between(entry), metres(entry["bound_m"]), ratio(entry["over_bound"]),
            ratio(entry["nees_per_dof"]), _found(entry, "ris_m", "ris_found"), _since(entry),
            _found(entry, "scatterer_m", "scatterer_found"), _found(entry, "wall_deg", "wall_found", 2),
            ratio(entry["wall_own_deg"]), _found(entry, "wall_m", "wall_found"), ratio(entry["ghost_walls"]),
            ratio(entry["gospa_m"]), ratio(entry["association"]), f"{entry['diverged']} of {entry['runs']}",
            str(entry["failed"]),
            ", ".join(f"{NAMES[name]}: {limit}" for name, limit in entry["limits"].items()) or "none",
        ]
        for entry in content["entries"]
    ]  # fmt: skip
    return [*lines, *table_lines(head, rows)]


NAMES = {
    "rmse_m": "agent", "over_bound": "bound", "ris_m": "panel", "scatterer_m": "scatterers", "wall_deg": "wall angle",
    "wall_m": "wall distance", "diverged": "divergence", "failed": "failure",
}  # fmt: skip
"""Names of the aims on the page."""


def _found(entry: Mapping[str, Any], name: str, share: str, digits: int = 3) -> str:
    """Table cell of the study in many rooms: error and bound of landmarks or walls, and the share found of those that
    count; no share where none counts, as none is heard for long."""
    error, bound, found = entry[name], entry[BOUND_OF[name]], entry[share]
    if error is None and found is None:
        return "-"
    parts = ["none found" if error is None else f"{error:.{digits}f}"]
    parts += [] if bound is None else [f"bound {bound:.{digits}f}"]
    return ", ".join(parts) + ("" if error is None or found is None else f" ({share_text(found)})")


def _since(entry: Mapping[str, Any]) -> str:
    """Table cell of the study in many rooms: when the map first held the panel, and when a path over it was audible."""
    held, audible = entry["ris_identified_s"], entry["ris_audible_s"]
    return "-" if audible is None else f"{'never' if held is None else f'{held:.1f}'} ({audible:.1f})"
