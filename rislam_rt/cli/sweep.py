"""`rislam-rt sweep PIPELINE`."""

from pathlib import Path
from typing import Annotated

import typer

from rislam_rt.cli.options import JsonFile, PipelineFile, SceneOption, Settings, write_json


def command(
    pipeline: PipelineFile,
    scene: SceneOption = None,
    set_: Settings = None,
    axis: Annotated[
        list[str] | None, typer.Option(metavar="KEY=V1,V2", help="Values of a setting to go through; repeatable.")
    ] = None,
    repeat: Annotated[int, typer.Option(min=1, max=10_000, help="Runs with different seeds at every point.")] = 5,
    jobs: Annotated[int | None, typer.Option(min=1, help="Runs at a time; one a core by default.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder; sweeps/<pipeline>-<scene> by default.")
    ] = None,
    json: JsonFile = None,
) -> None:
    """Run a pipeline over settings and seeds. What is there already is not run again. Exit code 1 if a run failed."""
    import os

    from rislam_rt.cli.progress import show_progress
    from rislam_rt.cli.scenes import open_scene, scene_of
    from rislam_rt.pipeline import load_spec
    from rislam_rt.pipeline.run import prepare_channel
    from rislam_rt.pipeline.sweep import build_cells, parse_axes, run_sweep
    from rislam_rt.report.tables import print_sweep

    axes = parse_axes(axis or ())
    spec = load_spec(pipeline, set_ or ())
    folder = scene_of(scene, spec, pipeline)
    opened = open_scene(folder)
    cells = build_cells(pipeline, folder, set_ or (), axes, repeat)
    for kind in {cell.spec.channel for cell in cells}:
        prepare_channel(kind)
    opened.warn()
    target = out or Path("sweeps") / f"{spec.name}-{opened.scene.name}"
    with show_progress() as progress:
        rows = run_sweep(cells, folder, target, jobs or os.cpu_count() or 1, progress)
    print_sweep(rows)
    typer.echo(f"sweep folder: {target}")
    write_json(json, {"rows": [{**row._asdict(), "overall_rmse_m": row.overall if row.rmse else None} for row in rows]})
    if any(row.failed for row in rows):
        raise typer.Exit(1)
