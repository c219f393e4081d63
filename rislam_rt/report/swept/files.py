"""Writing the files of a swept study (page, CSV, JSON, figure) from the cells done so far."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from rislam_rt.report.markdown import paragraph
from rislam_rt.report.style import to_png
from rislam_rt.report.swept import ablations, fig4b, fig4c, hardware, robustness, rooms
from rislam_rt.report.swept.entries import entries_csv, failure_notes
from rislam_rt.storage.files import json_file, write_all
from rislam_rt.studies import swept
from rislam_rt.sweeps import Row
from rislam_rt.sweeps.cell_work import plain_result


class StudyLayout(NamedTuple):
    """Functions that make the data, figure and page of one kind of swept study."""

    title: str
    """Title of the page."""
    content: Callable[[Sequence[swept.Group], Any], dict[str, Any]]
    """Makes plain data from groups and specification."""
    draw: Callable[[Mapping[str, Any], Any], Figure]
    """Draws the figure from plain data and specification."""
    body: Callable[[Mapping[str, Any], Any, str | None], list[str]]
    """Makes the lines of the page from plain data, specification and the figure's file name."""


LAYOUTS: dict[type, StudyLayout] = {
    swept.Fig4bSpec: StudyLayout(fig4b.TITLE, fig4b.fig4b_content, fig4b.draw_fig4b, fig4b.fig4b_body),
    swept.Fig4cSpec: StudyLayout(fig4c.TITLE, fig4c.fig4c_content, fig4c.draw_fig4c, fig4c.fig4c_body),
    swept.AblationsSpec: StudyLayout(
        ablations.TITLE, ablations.ablations_content, ablations.draw_ablations, ablations.ablations_body
    ),
    swept.HardwareSpec: StudyLayout(
        hardware.TITLE, hardware.hardware_content, hardware.draw_hardware, hardware.hardware_body
    ),
    swept.RobustnessSpec: StudyLayout(
        robustness.TITLE, robustness.robustness_content, robustness.draw_robustness, robustness.robustness_body
    ),
    swept.RoomsSpec: StudyLayout(rooms.TITLE, rooms.rooms_content, rooms.draw_rooms, rooms.rooms_body),
}


def write_swept(
    rows: Sequence[Row], spec: swept.SweptSpec, record: Mapping[str, Any], folder: Path, *, figures: bool = True
) -> Path | None:
    """Write the files of a swept study (`.md`, `.csv`, `.json`, figure); return the page, None before any cell is done.

    Raises
    ------
    StoreError
        The disk refused.
    """
    groups = [group for group in swept.group_rows(rows) if group.schemes or (any(group.results) and _of_receiver(spec))]
    if not groups:
        return None
    layout = LAYOUTS[type(spec)]
    content = layout.content(groups, spec)
    figure = f"figures/{spec.name}.png" if figures else None
    failures = hardware.failed_cells(groups) if _of_receiver(spec) else failure_notes(groups)
    lines = [f"# {layout.title}", "", *about_lines(groups, spec, record, len(rows)), "",
             *layout.body(content, spec, figure), "", "## Failures", "", *failures]  # fmt: skip
    # the page first: the others are known as the program's by it
    files = {f"{spec.name}.md": ("\n".join(lines) + "\n").encode()}
    if figure is not None:
        files[figure] = to_png(layout.draw(content, spec))
    files[f"{spec.name}.csv"] = entries_csv(content["entries"])
    files[f"{spec.name}.json"] = json_file(plain_result({**record, **content}), sort_keys=True)
    return write_all(folder, files)


def _of_receiver(spec: swept.SweptSpec) -> bool:
    """Whether the files of a study are of the receiver alone: its cells have no scores of schemes."""
    return isinstance(spec, swept.HardwareSpec)


def about_lines(
    groups: Sequence[swept.Group], spec: swept.SweptSpec, record: Mapping[str, Any], wanted: int
) -> list[str]:
    """Lines on how the numbers of a swept study were computed; `wanted` is the number of cells in all."""
    config = record["settings"]
    source = "ray tracing (Sionna RT)" if config["channel"] == "traced" else "image sources"
    cycles = f"the first {config['cycles']} cycles" if config["cycles"] else "all cycles"
    there = sum(result is not None for group in groups for result in group.results)
    unfinished = "" if there == wanted else f" Not complete: {there} of {wanted} cells."
    rivals = [name for name in ("bp_slam", "channel_slam") if any(name in group.schemes for group in groups)]
    rooms = f"Room{'s' if len(record['scenes']) > 1 else ''} {', '.join(f'`{name}`' for name in record['scenes'])}"
    text = f"""{rooms}; paths by {source} with up to {config["depth"]} wall bounces, {cycles} of the trajectory,
    {spec.repetitions} seeds a point (seed {spec.seed}). Written by `rislam-rt run` from one pipeline, do not edit.
    {unfinished}"""
    if _of_receiver(spec):
        return paragraph(text)
    law = """For every seed the true motion is the scene's trajectory plus white acceleration, and the estimators
    are told its standard deviation; a start is told with one draw of its errors. All schemes of a seed share
    motion, paths, noise and start. RMSE is over the cycles, then over the seeds; intervals are 95 % bootstrap
    intervals over the seeds. The posterior bound is that of the same motion and codes, with landmarks and walls
    unknown and the association known; that of delay-only schemes counts no angles and holds every mirror image as a
    point of its own."""
    if rivals:
        names = " and ".join(f"`{name}`" for name in rivals)
        law += f""" {names} (their own estimators, told delays alone) run with the panel under random codes: one more
        landmark for them than a plain wall would be."""
    return [*paragraph(text), "", *paragraph(law)]
