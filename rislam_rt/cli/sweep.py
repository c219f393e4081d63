"""The command `rislam-rt sweep PIPELINE`: runs a SLAM pipeline over axes of settings and over seeds."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rislam_rt.cli.interrupts import Interrupted
from rislam_rt.cli.options import MAIN_JOB, JsonFile, PipelineFile, SceneOption, Settings, check_one_scene
from rislam_rt.cli.output_files import write_json
from rislam_rt.cli.progress_bars import show_sweep
from rislam_rt.input_messages import counted

if TYPE_CHECKING:
    from rislam_rt.sweeps import Row, Sweep, SweepOptions, SweepReport


def command(
    pipeline: PipelineFile = MAIN_JOB,
    scene: SceneOption = None,
    set_: Settings = None,
    axis: Annotated[
        list[str] | None, typer.Option(metavar="KEY=V1,V2", help="Values of a setting to go through; repeatable.")
    ] = None,
    repeat: Annotated[
        int | None,
        typer.Option(min=1, max=10_000, help="Runs with different seeds at every point; the pipeline's own, or 5."),
    ] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Runs at a time; one a core by default.")] = None,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a Dask cluster that does the runs instead.")
    ] = None,
    time_limit: Annotated[
        float | None, typer.Option(metavar="S", help="Stop a run after so many seconds; it counts as failed.")
    ] = None,
    retry: Annotated[bool, typer.Option("--retry", help="Do failed runs again.")] = False,
    estimate: Annotated[bool, typer.Option("--estimate", help="Say what it will cost, and stop there.")] = False,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder; sweeps/<pipeline>-<scene> by default.")
    ] = None,
    json: JsonFile = None,
) -> None:
    """Run a pipeline over settings and seeds. What is there already is not run again. Exit code 1 if a run failed.

    Example: rislam-rt sweep trace_then_slam --axis radio.reference_snr_db=0,13 --repeat 5 --estimate
    """
    import os

    from rislam_rt.report.terminal_tables import print_sweep
    from rislam_rt.studies.pipeline_sweep import default_folder, load_section, score_rows, slam_sweep
    from rislam_rt.sweeps import SweepOptions
    from rislam_rt.sweeps.store import count_others

    check_one_scene(scene, set_)
    sweep = slam_sweep(pipeline, set_ or (), axis or (), scene=scene, repeat=repeat)
    limit = time_limit if time_limit is not None else load_section(pipeline, set_ or ()).time_limit_s
    effort = SweepOptions(jobs or os.cpu_count() or 1, dask, limit, retry, estimate)
    target = out or default_folder(Path("sweeps"), sweep)
    try:
        report = _run(sweep, target, effort)
    except KeyboardInterrupt:
        raise Interrupted("interrupted: what is done is kept; the same command goes on from there") from None
    if estimate and report.cost.cells:
        return
    scores = score_rows(report.rows)
    print_sweep(scores)
    others = count_others(target, (row.cell for row in report.rows))
    more = f" (besides {counted(others, 'cell')} of other settings or repetitions, kept and not in its tables)"
    typer.echo(f"sweep folder: {target}{more if others else ''}")
    write_json(json, {"rows": [score.as_dict() for score in scores], "failed": len(report.failed)})
    if report.failed:
        raise typer.Exit(1)


def _run(sweep: "Sweep", target: Path, effort: "SweepOptions") -> "SweepReport":
    """Part of `rislam-rt sweep`: run the cells with a progress bar, updating scores and their figure as cells end."""
    from rislam_rt.pipeline.channels import prepare_channel
    from rislam_rt.report.studies.sweep import draw_scores
    from rislam_rt.studies.pipeline_sweep import score_rows, write_scores
    from rislam_rt.sweeps import build_cells, run_sweep
    from rislam_rt.sweeps.store import check_folder

    check_folder(target)
    if effort.dask is None:
        for kind in {cell.settings["channel"] for cell in build_cells(sweep)}:
            prepare_channel(kind)

    def grow(rows: "Sequence[Row]") -> None:
        scores = score_rows(rows)
        write_scores(scores, target)
        draw_scores(scores, target / "scores.png")

    with show_sweep() as tell:
        return run_sweep(sweep, target, effort, tell=tell, grow=grow)
