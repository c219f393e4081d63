"""Tables for the terminal: scores of runs and studies, path classes, channel comparisons, designs, sweeps, scenes."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from rislam_rt.input_messages import counted, share_text
from rislam_rt.model import PathKind, Paths, Scene
from rislam_rt.pipeline.scores.audible_paths import HEARD
from rislam_rt.pipeline.scores.loss_causes import is_unnoticed, words_of_loss
from rislam_rt.pipeline.scores.wall_scores import PlaneScore, found_of_heard, plane_scores
from rislam_rt.report.markdown import ratio
from rislam_rt.shipped import short_names

if TYPE_CHECKING:
    from rislam_rt.arrays import Floats
    from rislam_rt.channel.compare import PathReport, Validation
    from rislam_rt.design import Design
    from rislam_rt.studies.pipeline_sweep import SchemeScore
    from rislam_rt.sweeps import Row


WHOLE_LABELS = 2
"""Schemes of a run up to which a terminal of 80 columns has room for the labels of a table in one line each."""

ERROR, RELATIVE = "agent RMSE (95 %)", "relative to its start"
"""Columns of a sweep's table that break between an error and its interval."""


def print_summary(summary: Mapping[str, Any]) -> None:
    """Print the scores of a run as a table, a column for each scheme: RMSE of agent, landmarks and walls, bound."""
    title = f"{summary['pipeline']} in {summary['scene']}: {summary['cycles']} cycles, seed {summary['seed']}"
    label = Column("RMSE", no_wrap=len(summary["schemes"]) <= WHOLE_LABELS)
    table = Table(label, *(Column(name, justify="right") for name in summary["schemes"]))
    for row in summary_rows(summary):
        table.add_row(*row)
    _show(title, table)


def summary_rows(summary: Mapping[str, Any]) -> list[list[str]]:
    """Rows of the terminal table of a run's scores: label, then one cell for each scheme."""
    schemes = list(summary["schemes"].values())
    rows = [[label, *map(show, schemes)] for label, show in ERRORS.items()]
    for name in schemes[0]["landmarks"]:
        rows.append([f"landmark {name}", *(_landmark(s["landmarks"][name]) for s in schemes)])
    rows += [*_panel_rows(schemes), *_wall_rows(schemes)]
    rows += [[label, *map(show, schemes)] for label, show in SCORES.items()]
    if any(s["lost"]["times"] for s in schemes):
        rows.append(["because", *(words_of_loss(s["lost"]) if s["lost"]["times"] else "-" for s in schemes)])
    return rows


def _landmark(entry: Mapping[str, Any]) -> str:
    """Cell of a terminal table: error of a landmark; "-" for a panel where the scheme was told of none."""
    return _metres(entry["rmse_m"], "-" if entry.get("identified_last", True) is None else "not found")


def _panel_rows(schemes: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Rows of a terminal table: whether the last map has each panel; none of a summary that does not say so."""
    entries = schemes[0]["landmarks"]
    panels = [name for name, entry in entries.items() if "identified_last" in entry]
    cells = {None: "-", True: "yes", False: "no"}
    return [
        [f"panel {name} found" if len(panels) > 1 else "panel found"]
        + [cells[s["landmarks"][name]["identified_last"]] for s in schemes]
        for name in panels
    ]


def _wall_rows(schemes: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Rows of a terminal table: how many walls each scheme found of those heard for `HEARD` seconds, and ghosts; each
    wall that was heard or found; how many there are else. Walls in one plane are one."""
    ghosts = [f", {counted(s['ghost_walls'], 'ghost')}" if s["ghost_walls"] else "" for s in schemes]
    found = [found_of_heard(s["walls"]) + more for s, more in zip(schemes, ghosts, strict=True)]
    asked = all(plane.heard is not None for s in schemes for plane in plane_scores(s["walls"]))
    rows, others = [["walls found of those heard" if asked else "walls found", *found]], 0
    for planes in zip(*(plane_scores(s["walls"]) for s in schemes), strict=True):
        if not any(plane.heard or plane.found for plane in planes):
            others += 1
            continue
        first, *more = planes[0].names
        rows.append([f"wall {first}{f' (+{len(more)} in its plane)' if more else ''}", *map(_wall, planes)])
    why = f"not heard for {HEARD:g} s" if asked else "not found"
    return rows + ([[counted(others, "other wall"), *(why for _ in schemes)]] if others else [])


def _lost(loss: Mapping[str, Any] | None) -> str:
    """Cell of a terminal table: since when a scheme was lost by the truth, and whether silently."""
    if loss is None:
        return "-"
    return f"from {loss['lost_at_s']:.1f} s on{', silently' if loss['silent'] else ''}" if loss["lost"] else "no"


def _over(scores: Mapping[str, Any], name: str) -> str:
    """Cell of a terminal table: the agent's error over its bound, absolute or `relative_`."""
    least, error = scores[f"{name}bound_m"], scores[f"{name}rmse_m"]
    return f"{error / least:.1f}" if least and error is not None else "-"


def _fine(value: float | None) -> str:
    """Cell of a terminal table: a bound in centimetres, or in millimetres below one."""
    if not value:
        return "-"
    return f"{1000.0 * value:.2f} mm" if value < 0.01 else _metres(value)


def _said(outcomes: Mapping[str, int]) -> str:
    """Cell of a terminal table: in how many cycles the estimator itself reported divergence."""
    cycles = outcomes.get("diverged", 0)
    return f"in {cycles} of {sum(outcomes.values())} cycles" if cycles else "never"


ERRORS: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "agent": lambda s: _metres(s["rmse_m"]),
    "agent, largest error": lambda s: _metres(s["largest_m"]),
    "agent, relative to its start": lambda s: _metres(s["relative_rmse_m"], "-"),
    "agent, path aligned": lambda s: _metres(s["rmse_aligned_m"], "-"),
}
SCORES: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "posterior bound of the agent": lambda s: _fine(s["bound_m"]),
    "agent over it": lambda s: _over(s, ""),
    "bound relative to the start": lambda s: _fine(s["relative_bound_m"]),
    "agent over it, relative to its start": lambda s: _over(s, "relative_"),
    "NEES per degree of freedom": lambda s: ratio(s["nees_per_dof"]),
    "GOSPA of the map": lambda s: _metres(s["map"]["gospa_m"]),
    "association: precision, recall": lambda s: (
        f"{share_text(s['association']['precision'])}, {share_text(s['association']['recall'])}"
    ),
    "slower than its budget": lambda s: ", ".join(s["over_budget"]) or "no step",
    "diverged": lambda s: "yes, without noticing" if is_unnoticed(s) else "yes" if s["diverged"] else "no",
    "lost, relative to its start": lambda s: _lost(s["true_loss"]),
    "held itself for lost": lambda s: _said(s["outcomes"]),
}
"""Rows of a scheme's scores by their labels, before those of the landmarks and walls and after: functions that make a
cell."""


def path_table(paths: Paths) -> list[dict[str, Any]]:
    """Statistics of the paths of each class: number of identities, mean number per cycle, range of gains [dB]."""
    rows = []
    for kind in PathKind:
        columns = np.flatnonzero(paths.kind == kind)
        valid = paths.valid[:, columns]
        if not valid.any():
            continue
        level = 20.0 * np.log10(np.maximum(np.abs(paths.gain[:, columns][valid]), 1e-20))
        rows.append(
            {
                "class": kind.name, "identities": len(columns), "mean_per_cycle": float(valid.sum(axis=1).mean()),
                "lowest_gain_db": float(level.min()), "highest_gain_db": float(level.max()),
            }
        )  # fmt: skip
    return rows


def print_paths(name: str, paths: Paths, rows: list[dict[str, Any]], seconds: float, panel: str) -> None:
    """Print the statistics of path classes from `path_table`; `panel` are the panel's phase codes in words."""
    title = f"{name}: {paths.num_cycles} cycles, {paths.source}, {seconds:.2f} s (panel {panel})"
    table = Table("class", "identities", "a cycle", "gain \\[dB]")
    for row in rows:
        gains = f"{row['lowest_gain_db']:.1f} to {row['highest_gain_db']:.1f}"
        table.add_row(row["class"], str(row["identities"]), f"{row['mean_per_cycle']:.1f}", gains)
    _show(title, table)


def print_comparison(name: str, refined: "PathReport", raw: "PathReport") -> None:
    """Print the comparison of traced and image-source paths in a room: matched, explained and unexplained, errors.

    Two columns: the tracer's own float32, by which the channels agree or not, and refined numbers.
    """
    title = f"{name}: {refined.cycles} poses"
    table = Table("traced against analytic", "float32", "refined")
    contents = raw.as_dict(), refined.as_dict()
    for side in ("traced", "analytic"):
        table.add_row(f"{side}: searched", *(content["searched"][side].rpartition(", ")[2] for content in contents))
    for key in ("matched", "unexplained"):
        table.add_row(f"{key} paths", *(str(content[key]) for content in contents))
    for reason in sorted({reason for content in contents for reason in content["explained"]}):
        table.add_row(f"explained: {reason}", *(str(content["explained"].get(reason, 0)) for content in contents))
    for label, key, unit in (
        ("length", "max_length_error_m", "m"),
        ("gain", "max_gain_error_db", "dB"),
        ("phase", "max_phase_error_rad", "rad"),
        ("angle", "max_angle_error_rad", "rad"),
    ):
        table.add_row(f"largest {label} error", *(f"{content[key]:.2g} {unit}" for content in contents))
    for quantity in contents[0]["limits"]:
        label = f"{quantity.split(' [')[0]}: nearest to its limit"
        limits = (content["limits"][quantity] for content in contents)
        table.add_row(label, *(f"{limit['nearest']['share']:.1%}" if limit else "-" for limit in limits))
    _show(title, table)
    for report, numbers in ((raw, "float32"), (refined, "refined")):
        _print_faults(report, numbers, "cycle")
    print("agreed" if raw.passed and refined.passed else "NOT agreed")


def _print_faults(report: "PathReport", of: str, at: str) -> None:
    """Print, below the terminal table of a channel comparison, the first ten unexplained paths and the first ten errors
    beyond their limits."""
    for path in [p for p in report.one_sided if not p.reason][:10]:
        print(f"unexplained: {of}, {at} {path.cycle}, {path.label}, only {path.side}")
    for breach in report.breaches[:10]:
        print(f"beyond its limit: {of}, {breach}")


def print_validation(rows: Sequence["Validation"]) -> None:
    """Print the comparison of both channels in many rooms, a line for each room and kind of numbers, then failures."""
    table = Table("room", "numbers", "matched", "explained", "open", "beyond", "length \\[m]")
    for scene, _, numbers, report in rows:
        counts = (report.matched, sum(report.explained.values()), report.unexplained, report.num_breaches)
        length = report.as_dict()["max_length_error_m"]
        table.add_row(scene, numbers, *map(str, counts), f"{length:.0e}")
    _show("traced against analytic, largest error", table)
    for scene, _, numbers, report in rows:
        _print_faults(report, f"{scene}, {numbers}", "pose")
    unexplained, beyond = sum(r.report.unexplained for r in rows), sum(r.report.num_breaches for r in rows)
    print(f"{unexplained} unexplained paths, {beyond} errors beyond their limits")


def print_designs(name: str, point: "Floats", designs: Mapping[str, "Design"], target: str) -> None:
    """Print the phase code designs of one position by method: gain of the target path, gap to the optimum, CRLB."""
    at = ", ".join(f"{x:g}" for x in point)
    title = f"{name}, agent at ({at}) m, target {target}"
    table = Table("method", "gain \\[dB]", "gap \\[dB]", "CRLB \\[m]", "time \\[ms]")
    for method, design in designs.items():
        crlb = f"{np.sqrt(design.crlb):.4g}" if np.isfinite(design.crlb) else design.outcome.name.lower()
        table.add_row(method, f"{design.gain_db:.2f}", f"{design.gap_db:.2f}", crlb, f"{1e3 * design.seconds:.2f}")
    bound = max(design.bound for design in designs.values())
    if bound > 0.0:
        table.add_row("lower bound", "", "", f"{np.sqrt(bound):.4g}", "", style="dim")
    _show(title, table)


def print_sweep(scores: Sequence["SchemeScore"]) -> None:
    """Print the scores of a sweep as a table, a line for each point of the axes and scheme.

    Names break where a terminal has no room for them; what goes to a file or a pipe is as wide as it needs.
    """
    keys = [key for key in scores[0].point if key != "schemes"]
    counts = {"diverged": [score.diverged for score in scores], "failed": [score.failed for score in scores]}
    counts = {"runs": [len(score.rmse) for score in scores]} | {
        name: all_ for name, all_ in counts.items() if any(all_)
    }
    rooms = short_names(str(score.point["scene"]) for score in scores if "scene" in score.point)
    names = short_names([*keys, "scheme"], ".")
    columns = {
        **{names[key]: [rooms.get(str(s.point[key]), str(s.point[key])) for s in scores] for key in keys},
        "scheme": [score.scheme for score in scores],
        ERROR: [_between(score.overall, score.interval, "none") for score in scores],
        RELATIVE: [_between(score.relative, score.relative_interval, "-") for score in scores],
        **{name: [str(count) for count in all_] for name, all_ in counts.items()},
    }
    console = Console(highlight=False)
    longest = [max(len(word) for cell in (name, *cells) for word in cell.split()) for name, cells in columns.items()]
    needed = sum(longest) + 3 * len(longest) + 1
    if not console.is_terminal:
        console.width = max(console.width, needed)
    whole = needed <= console.width
    table = Table(*(Column(name, overflow="fold", no_wrap=whole and name not in (ERROR, RELATIVE)) for name in columns))
    for cells in zip(*columns.values(), strict=True):
        table.add_row(*map(escape, cells))
    _show("sweep", table, console)


def print_cards(rows: Sequence["Row"], timings: Sequence[Mapping[str, Any]]) -> None:
    """Print the score cards of a study in unseen rooms as a table, a column for each series."""
    from rislam_rt.report.unseen.files import unseen_content
    from rislam_rt.report.unseen.page import ROWS
    from rislam_rt.report.unseen.score_cards import by_series, read_runs

    cards = unseen_content(by_series(read_runs(rows)), timings)["cards"]
    columns = (Column(name, justify="right") for name in cards)
    table = Table("score", *columns, title="median (95 % interval); 95th percentile")
    for label, show in ROWS.items():
        table.add_row(escape(label), *(show(entry) for entry in cards.values()))
    Console().print(table, highlight=False)


def print_scene(scene: Scene) -> None:
    """Print the contents of a scene as a table: reflectors, occluders, scatterers, panels, trajectory, bounds."""
    low, high = scene.bounds
    table = Table("what", "name", "where \\[m]")
    for reflector in scene.reflectors:
        table.add_row("reflector", reflector.name, f"{len(reflector.faces)} triangles, {reflector.material.words}")
    for shade in scene.occluders:
        table.add_row("occluder", shade.name, f"{len(shade.faces)} triangles")
    for scatterer in scene.scatterers:
        shades = ", shades" if scatterer.shade is not None else ""
        table.add_row("scatterer", scatterer.name, f"{_point(scatterer.position)}, {scatterer.rcs:.3g} m2{shades}")
    for panel in scene.panels:
        spec = panel.spec
        table.add_row("panel", panel.name, f"{_point(panel.center)}, {spec.rows} x {spec.cols}, {spec.levels} levels")
    path = scene.agent.position
    table.add_row("agent", f"{len(path)} cycles", f"{_point(path[0])} to {_point(path[-1])}")
    table.add_row("bounds", "", f"{_point(low)} to {_point(high)}")
    _show(scene.name, table)


def _show(title: str, table: Table, console: Console | None = None) -> None:
    """Print a table on the terminal under its title, which rich would wrap at the table's width."""
    console = console or Console(highlight=False)
    console.print(title, style="bold", markup=False)
    console.print(table)


def _metres(value: float | None, unknown: str = "not found") -> str:
    """Cell of a terminal table: an error in centimetres, or in metres from one on; `unknown` if None."""
    if value is None:
        return unknown
    return f"{100.0 * value:.1f} cm" if value < 1.0 else f"{value:.2f} m"


def _between(value: float | None, ends: tuple[float, float] | None, unknown: str) -> str:
    """Cell of a terminal table: an error of three digits with its interval, in a unit that suits it."""
    if value is None:
        return unknown
    scale, unit = (1000.0, "mm") if value < 0.01 else (100.0, "cm") if value < 1.0 else (1.0, "m")
    return f"{scale * value:.3g} {unit}" + (f" ({scale * ends[0]:.2g}-{scale * ends[1]:.2g})" if ends else "")


def _wall(plane: PlaneScore) -> str:
    """Cell of a terminal table: distance and angle error of a wall."""
    if not plane.found:
        return "not heard" if plane.heard is False else "not found"
    return f"{_metres(plane.wall['rmse_m'])}, {plane.wall['angle_deg']:.1f}°"


def _point(point: "Floats") -> str:
    """Cell of a terminal table: coordinates of a point."""
    return "(" + ", ".join(f"{x:.2f}" for x in point) + ")"
