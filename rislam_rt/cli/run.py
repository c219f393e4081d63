"""`rislam-rt run PIPELINE`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rislam_rt.cli.options import MAIN_JOB, JsonFile, PipelineFile, SceneOption, Settings, write_json
from rislam_rt.cli.study import Given

if TYPE_CHECKING:
    from rislam_rt.pipeline import PipelineSpec


def command(
    pipeline: PipelineFile = MAIN_JOB,
    scene: SceneOption = None,
    set_: Settings = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Run folder; runs/<pipeline>-<scene>-<seed> by default.")
    ] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Schemes at a time; one a core by default.")] = None,
    json: JsonFile = None,
    page: Annotated[
        bool, typer.Option("--report/--no-report", help="Whether to draw the figures and the page.")
    ] = True,
) -> None:
    """Run a pipeline in a room: trace, then design, measure, localise and map, cycle by cycle.

    An interrupted run goes on where it stopped when the same command is given again; a completed one is replaced.
    A file of another kind is a study: 'compare_channels' (exit code 1 if the channels differ), 'fig4a', 'claims',
    'train_classifier', or 'fig4b', 'fig4c', 'rooms', 'ablations', 'unseen', which go through settings, rooms and seeds
    (exit code 1 if a run failed).
    """
    from rislam_rt.cli.study import run_claims, run_compare_channels, run_gain_curves, run_swept
    from rislam_rt.pipeline.studies import (
        ClaimsSpec,
        ClassifierSpec,
        CompareSpec,
        Fig4aSpec,
        SweptSpec,
        UnseenSpec,
        load_any,
    )

    spec = load_any(pipeline, set_ or ())
    given = Given(pipeline, scene, out, jobs, json, page)
    if isinstance(spec, CompareSpec):
        run_compare_channels(spec, given)
    elif isinstance(spec, Fig4aSpec):
        run_gain_curves(spec, given)
    elif isinstance(spec, UnseenSpec):
        from rislam_rt.cli.unseen import run_unseen

        run_unseen(spec, given)
    elif isinstance(spec, SweptSpec):
        run_swept(spec, given)
    elif isinstance(spec, ClaimsSpec):
        run_claims(spec, given)
    elif isinstance(spec, ClassifierSpec):
        from rislam_rt.cli.training import run_classifier

        run_classifier(spec, given)
    else:
        run_main_job(spec, given)


def run_main_job(spec: "PipelineSpec", given: Given) -> None:
    """All schemes over all cycles of a room."""
    import os

    import numpy as np

    from rislam_rt.cli.progress import show_progress
    from rislam_rt.cli.scenes import open_scene, scene_of
    from rislam_rt.pipeline import run_slam
    from rislam_rt.pipeline.run import check_run, prepare_channel
    from rislam_rt.pipeline.spec import build_radio
    from rislam_rt.pipeline.store import PartialRun, check_folder, run_folder, run_identity
    from rislam_rt.pipeline.summary import summarise
    from rislam_rt.report.tables import print_summary

    pipeline, scene, out, jobs, json, page = given
    opened = open_scene(scene_of(scene, spec, pipeline), build_radio(spec.radio))
    room = opened.scene
    check_run(room, spec)
    folder = out or run_folder(spec, room, Path("runs"))
    check_folder(folder)
    prepare_channel(spec.channel)

    partial = PartialRun(folder, run_identity(spec, room))
    opened.warn()
    try:
        with show_progress() as progress:
            result = run_slam(
                room,
                spec,
                rng=np.random.default_rng(spec.seed),
                jobs=jobs or os.cpu_count() or 1,
                done=partial,
                progress=progress,
            )
    except KeyboardInterrupt:
        kept = len(partial)
        partial.abandon()
        typer.echo(f"interrupted: {kept} schemes kept; the same command goes on from there", err=True)
        raise typer.Exit(130) from None
    except BaseException:
        partial.abandon()
        raise
    summary = summarise(result)
    folder = partial.complete(result, summary)
    print_summary(summary)
    if page:
        from rislam_rt.report import write_report

        typer.echo(f"report: {write_report(result, summary, folder)}")
    typer.echo(f"run folder: {folder}")
    write_json(json, summary)
