"""The score card of a single run, a column for each scheme, in the words of the page of unseen rooms."""

from collections.abc import Callable, Mapping
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from rislam_rt.report.markdown import NOTHING
from rislam_rt.report.unseen.page import MILLI
from rislam_rt.studies.score_card.score import SETTLED

UNKNOWN = "not known"
"""Cell of a score that needs the map of every cycle, where the last alone is known."""
Show = Callable[[Mapping[str, Any]], str]


def print_run_card(title: str, scores: Mapping[str, Mapping[str, Any]]) -> None:
    """Print the score card of a run on the terminal; `scores` are those of `score_run` by scheme, with `cycle_ms`."""
    table = Table("score", *(Column(escape(name), justify="right") for name in scores))
    for label, cells in card_rows(scores).items():
        table.add_row(escape(label), *cells)
    console = Console(highlight=False)
    console.print(title, style="bold", markup=False)
    console.print(table)


def card_rows(scores: Mapping[str, Mapping[str, Any]]) -> dict[str, list[str]]:
    """Cells of a run's score card by the label of their row, one a scheme; no row of the panel where no scheme was told
    of one."""
    told = any(entry["panel_heard"] is not None for entry in scores.values())
    rows = {label: show for label, show in ROWS.items() if told or label not in OF_PANEL}
    return {label: [show(entry) for entry in scores.values()] for label, show in rows.items()}


def _value(name: str, scale: float = 1.0, digits: int = 2) -> Show:
    """Function that formats a score of a run's card as a number."""
    return lambda entry: NOTHING if entry.get(name) is None else f"{scale * entry[name]:.{digits}f}"


def _over_time(name: str) -> Show:
    """Function that formats a score of a run's card that is not known without the map of every cycle."""
    show = _value(name, digits=0 if name == "births" else 2)
    return lambda entry: UNKNOWN if entry["births"] is None else show(entry)


def _of(name: str, of: str) -> Show:
    """Function that formats a score of a run's card that counts some `of` others."""
    return lambda entry: UNKNOWN if entry[of] is None else f"{entry[name]} of {entry[of]}"


def _yes(name: str) -> Show:
    """Function that formats a score of a run's card that is true or not."""
    return lambda entry: "yes" if entry[name] else "no"


def _panel(entry: Mapping[str, Any]) -> str:
    """Cell of a run's card: whether the panel was found, `-` of a scheme that was told of none."""
    if entry["panel_heard"] is None:
        return NOTHING
    return _yes("panel_found")(entry) if entry["panel_heard"] else "not heard"


OF_PANEL = ("panel found", "delay of the panel [s]")
"""Labels of the rows of a run's card that a run without a panel does not have."""
ROWS: dict[str, Show] = {
    "RMSE [mm]": _value("rmse_m", MILLI, 1),
    "RMSE / bound": _value("ratio"),
    "RMSE / bound, expected over the start's error": _value("expected_ratio", digits=3),
    "relative RMSE [mm]": _value("relative_rmse_m", MILLI),
    "relative RMSE / relative bound": _value("relative_ratio"),
    f"relative RMSE after {SETTLED:g} s [mm]": _value("late_relative_rmse_m", MILLI),
    f"the same / relative bound after {SETTLED:g} s": _value("late_relative_ratio"),
    "relative bound [mm]": _value("relative_bound_m", MILLI),
    "dead reckoning [mm]": _value("dead_reckoning_m", MILLI, 0),
    "NEES per degree of freedom": _value("nees"),
    "NEES across (x and y) per degree of freedom": _value("horizontal_nees"),
    "NEES across, expected over the start's error": _value("expected_nees"),
    "lost": lambda entry: f"from {entry['lost_at_s']:.1f} s on" if entry["lost"] else "no",
    "silently lost": _yes("silent"),
    "births": _over_time("births"),
    "births of the right kind": _of("births_right", "births_judged"),
    "walls found of those heard": _of("walls_found", "walls_heard"),
    "walls found well": _of("walls_good", "walls_heard"),
    "angle of those found [deg]": _value("wall_deg"),
    "offset of those found [mm]": _value("wall_m", MILLI, 1),
    "delay of walls [s]": _over_time("wall_delay_s"),
    "landmarks (with panel) found of those heard": _of("points_found", "points_heard"),
    "error of those found [mm]": _value("point_m", MILLI, 1),
    "delay of landmarks [s]": _over_time("point_delay_s"),
    OF_PANEL[0]: _panel,
    OF_PANEL[1]: _over_time("panel_delay_s"),
    "ghost walls": _value("ghost_walls", digits=0),
    "ghost landmarks": _value("ghost_points", digits=0),
    "GOSPA [m]": _value("gospa_m"),
    "CPU time of the estimator a cycle [ms]": _value("cycle_ms", digits=1),
}
"""Scores of a run's card by their label: functions that format them."""
