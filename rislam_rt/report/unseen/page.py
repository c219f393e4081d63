"""The page of a study in unseen rooms: score cards, classes of rooms, worst runs, failures."""

from collections.abc import Mapping, Sequence
from typing import Any

from rislam_rt.evaluate import NEAR_ANGLE, NEAR_WALL
from rislam_rt.input_messages import share_text
from rislam_rt.pipeline.scores.audible_paths import HEARD
from rislam_rt.pipeline.scores.true_loss import FAR_OVER, LASTING, LOST
from rislam_rt.report.markdown import NOTHING, paragraph, picture, table_lines
from rislam_rt.report.unseen.score_cards import SchemeRun
from rislam_rt.studies.score_card.score import GOOD_ANGLE, GOOD_OFFSET, NEAR_POINT, SETTLED
from rislam_rt.studies.unseen.spec import TEST, UnseenSpec

MILLI = 1e3
WORST = 12
"""Number of the worst runs that are listed."""


def unseen_page(
    content: Mapping[str, Any], runs: Mapping[str, Sequence[SchemeRun]], about: Sequence[str], figure: str | None
) -> str:
    """Markdown page of a study in unseen rooms."""
    lines = ["# Unseen rooms", "", *about, "", *_meaning(), ""]
    lines += picture(figure, "Relative error of every run, by class of room and motion")
    cards = content["cards"]
    rows = [[label, *(show(entry) for entry in cards.values())] for label, show in ROWS.items()]
    lines += ["## Score card", "", *table_lines(["", *cards], rows), ""]
    for name, classes in content["classes"].items():
        rows = [[entry["division"], entry["class"], *(show(entry) for show in COLUMNS.values())] for entry in classes]
        lines += [f"## By class: {name}", "", *table_lines(["class of", "", *COLUMNS], rows), ""]
    failed = [(name, run) for name, members in runs.items() for run in members if run.failed]
    failures = [f"- room {run.room}, {name}: {run.failed}" for name, run in failed] or ["None."]
    lines += ["## Worst runs", "", *_worst(runs), "", "## Failures", "", *failures]
    return "\n".join(lines) + "\n"


def _meaning() -> list[str]:
    """Lines of the page of unseen rooms on what the scores mean."""
    text = """Errors of the agent's position, absolute and relative to the true start: the second is without the error
    that the agent was told its start with, which no measurement of an unknown room can mend. Bounds are posterior
    bounds of the same motion, codes and settings, with landmarks and walls unknown, the association known, and white
    acceleration of the strength that the motion truly has; the relative one has the start as its origin. Ratios are
    of root mean squares over a run. A run draws the start's error once, and for the whole of it. Who is told nothing
    of the room moves with the start, to the last digit, so that one run tells what is expected over all draws: what
    the start adds to the bound stands in place of what its draw added. Given are medians over the rooms with their
    95 % bootstrap intervals, and 95th percentiles; shares with Wilson's intervals. Dead reckoning is the start's
    told velocity, kept."""
    lost = f"""Lost is a run whose relative error exceeds {LOST:g} m and {FAR_OVER:g} relative bounds for {LASTING:g} s
    on end; silently so, if no cycle from then on says that it diverged, and the error exceeds {FAR_OVER:g} of the
    estimator's own deviations for as long. A wall or landmark counts as heard if a path of
    it is above the detection threshold for {HEARD:g} s in all; walls in one plane are one. A wall is found if at the
    end a plane of the map lies within {NEAR_WALL:g} m of it (RMS over its surface) and within {NEAR_ANGLE:g} degrees,
    one to one, and found well within {GOOD_ANGLE:g} degree and {GOOD_OFFSET:g} m at its middle; a landmark, within
    {NEAR_POINT:g} m; the panel, if the landmark that the map holds for it does. A panel that the estimator is told of
    is one of the landmarks, too, found as such whatever the map holds it for. Ghosts are what stands for nothing,
    heard or not, one to one. A birth is of the right kind if most components that the landmark got were of that kind.
    Delays are medians from the first audible cycle to the first in which the map holds it; a panel that is not found
    has none."""
    return [*paragraph(text), "", *paragraph(lost)]


def about_lines(spec: UnseenSpec, record: Mapping[str, Any], tests: int, there: int, wanted: int) -> list[str]:
    """Lines on how the numbers of a study in unseen rooms were computed: rooms, cycles, code, count of test runs."""
    config = record["settings"]
    unfinished = "" if there == wanted else f" Not complete: {there} of {wanted} cells."
    purpose = "for tests" if spec.is_test else "for development"
    counted = "never" if tests == 0 else "once" if tests == 1 else f"{tests} times"
    carried = ", carried by a walker" if spec.ways == "carried" else ""
    way = f'; **agents set out from rest along the walls{carried}** (`ways = "{spec.ways}"`)'
    way = "" if spec.ways == "anyhow" else way
    text = f"""Rooms {spec.first} to {spec.first + spec.rooms - 1} ({purpose}), drawn at random each from its number:
    shape, ceiling, size, materials, furniture, scatterers, panel and motion ([how](../unseen_data.md)){way}.
    {config["cycles"] or "All"} cycles of 0.1 s, up to {config["depth"]} wall bounces. Written by
    `rislam-rt run pipelines/unseen.toml`, do not edit. Code `{record["code"]}`.{unfinished}"""
    count = f"""Test rooms (from {TEST} on) were run **{counted}**; every run of them is written into the ledger
    `pipelines/{spec.ledger}`."""
    return [*paragraph(text), "", *paragraph(count), *_series(spec)]


def _series(spec: UnseenSpec) -> list[str]:
    """Lines on the schemes of a study in unseen rooms and on the settings of its variants."""
    schemes = spec.run.get("schemes", [])
    lines = [f"- all: schemes {', '.join(f'`{name}`' for name in schemes)} (without a panel, what needs none)"]
    for variant in spec.variants:
        told = {
            key: str(value).lower() if isinstance(value, bool) else repr(value) for key, value in variant.set.items()
        }
        settings = ", ".join(f"`{key} = {value}`" for key, value in told.items())
        lines.append(f"- `{variant.name}`: {settings or 'the defaults'}{f'; {variant.note}' if variant.note else ''}")
    return ["", *lines]


def _worst(runs: Mapping[str, Sequence[SchemeRun]]) -> list[str]:
    """Table of the runs in unseen rooms with the largest relative RMSE."""
    found = [(name, run) for name, members in runs.items() for run in members if run.scores]
    found.sort(key=lambda item: -item[1].scores["relative_rmse_m"])
    head = ["room", "series", "relative RMSE [m]", "bound [m]", "lost", "motion", "plan", "size [m]", "R", "panel"]
    rows = []
    for name, run in found[:WORST]:
        scores, traits = run.scores, run.traits
        lost = "silently" if scores["silent"] else "yes" if scores["lost"] else "no"
        rows.append(
            [str(run.room), name, f"{scores['relative_rmse_m']:.3f}", f"{scores['relative_bound_m']:.4f}", lost,
             traits["motion"], traits["shape"], f"{traits['size']:.1f}", f"{traits['reflection']:.2f}",
             traits["panel"]]
        )  # fmt: skip
    return table_lines(head, rows)


def _median(name: str, scale: float = 1.0, digits: int = 2) -> Any:
    """Function that formats a score of a card as median with interval and 95th percentile."""

    def show(entry: Mapping[str, Any]) -> str:
        parts = [entry[name], entry[f"{name}_low"], entry[f"{name}_high"], entry[f"{name}_p95"]]
        if parts[0] is None:
            return NOTHING
        value, low, high, p95 = (NOTHING if part is None else f"{scale * part:.{digits}f}" for part in parts)
        return f"{value} ({low} to {high}); {p95}"

    return show


def _short(name: str, scale: float = 1.0, digits: int = 2) -> Any:
    """Function that formats a score of a card as median and 95th percentile."""

    def show(entry: Mapping[str, Any]) -> str:
        if entry[name] is None:
            return NOTHING
        return f"{scale * entry[name]:.{digits}f}; {scale * entry[f'{name}_p95']:.{digits}f}"

    return show


def _share(name: str, between: bool = True) -> Any:
    """Function that formats a score of a card as a share, with its interval if `between`."""

    def show(entry: Mapping[str, Any]) -> str:
        if entry[name] is None:
            return NOTHING
        text = share_text(entry[name])
        if between:
            text += f" ({share_text(entry[f'{name}_low'])} to {share_text(entry[f'{name}_high'])})"
        return f"{text} of {entry[f'{name}_of']}" if between else text

    return show


def _number(name: str, digits: int = 2) -> Any:
    """Function that formats a score of a card as a number."""
    return lambda entry: NOTHING if entry[name] is None else f"{entry[name]:.{digits}f}"


ROWS: dict[str, Any] = {
    "runs (failed)": lambda entry: f"{entry['runs']} ({entry['failed']})",
    "RMSE [mm]: median (interval); 95th percentile": _median("rmse_m", MILLI, 1),
    "RMSE / bound": _median("ratio"),
    "RMSE / bound, expected over the start's error": _median("expected_ratio", digits=3),
    "relative RMSE [mm]": _median("relative_rmse_m", MILLI),
    "relative RMSE / relative bound": _median("relative_ratio"),
    f"relative RMSE after {SETTLED:g} s [mm]": _median("late_relative_rmse_m", MILLI),
    f"the same / relative bound after {SETTLED:g} s": _median("late_relative_ratio"),
    "relative bound [mm]": _median("relative_bound_m", MILLI),
    "dead reckoning [mm]": _median("dead_reckoning_m", MILLI, 0),
    "NEES per degree of freedom": _median("nees"),
    "NEES within 0.7 to 2": _share("consistent"),
    "NEES across (x and y) per degree of freedom": _median("horizontal_nees"),
    "its mean over the runs": _number("horizontal_nees_mean"),
    "NEES across, expected over the start's error": _median("expected_nees"),
    "lost": _share("lost"),
    "silently lost": _share("silent"),
    "births a run": _number("births"),
    "births of the right kind": _share("births_right"),
    "walls found of those heard": _share("walls_found"),
    "walls found well": _share("walls_good"),
    "angle of those found [deg]": _median("wall_deg"),
    "offset of those found [mm]": _median("wall_m", MILLI, 1),
    "delay of walls [s]": _median("wall_delay_s"),
    "landmarks (with panel) found of those heard": _share("points_found"),
    "error of those found [mm]": _median("point_m", MILLI, 1),
    "delay of landmarks [s]": _median("point_delay_s"),
    "panel found of those heard": _share("panel_found"),
    "delay of the panel [s]": _median("panel_delay_s"),
    "ghost walls a run": _number("ghost_walls"),
    "ghost landmarks a run": _number("ghost_points"),
    "GOSPA [m]": _median("gospa_m"),
    "CPU time of the estimator a cycle [ms]": _number("cycle_ms", 1),
}
"""Scores of a score card by their label on the page: functions that format them."""
COLUMNS: dict[str, Any] = {
    "runs": lambda entry: str(entry["runs"]),
    "RMSE / bound": _short("ratio"),
    "relative RMSE [mm]": _short("relative_rmse_m", MILLI, 1),
    f"after {SETTLED:g} s [mm]": _short("late_relative_rmse_m", MILLI, 1),
    "relative RMSE / bound": _short("relative_ratio", 1.0, 1),
    "NEES": _short("nees"),
    "lost": _share("lost", between=False),
    "silently": _share("silent", between=False),
    "right kind": _share("births_right", between=False),
    "walls found": _share("walls_found", between=False),
    "panel found": _share("panel_found", between=False),
    "ghosts": lambda entry: NOTHING if entry["ghost_walls"] is None else (
        f"{entry['ghost_walls'] + entry['ghost_points']:.1f}"
    ),
}  # fmt: skip
"""Scores of a class of rooms by their column's title: functions that format them."""
_SPREAD = ("ratio", "relative_rmse_m", "late_relative_rmse_m", "relative_ratio", "nees")
_PLAIN = ("division", "class", "runs", "failed", "ghost_walls", "ghost_points")
SHOWN = {
    *_PLAIN, *_SPREAD, *(f"{name}_p95" for name in _SPREAD), "lost", "silent", "births_right", "walls_found",
    "panel_found",
}  # fmt: skip
"""Names of the scores that `COLUMNS` reads."""
