"""The command `rislam-rt run PIPELINE`: runs a SLAM pipeline or a study, or goes on with one that was stopped."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rislam_rt.cli.interrupts import Interrupted
from rislam_rt.cli.options import MAIN_JOB, JsonFile, PipelineFile, SceneOption, Settings, StudyOptions, check_one_scene
from rislam_rt.cli.output_files import write_json
from rislam_rt.cli.progress_bars import show_progress
from rislam_rt.cli.verbosity import warn
from rislam_rt.input_messages import counted
from rislam_rt.shipped import is_shipped

if TYPE_CHECKING:
    from rislam_rt.model import Scene
    from rislam_rt.pipeline import PipelineSpec
    from rislam_rt.pipeline.store.identity import RunIdentity


def command(
    pipeline: PipelineFile = MAIN_JOB,
    scene: SceneOption = None,
    set_: Settings = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Run folder; runs/<pipeline>-<scene>-<seed>-<hash> by default.")
    ] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Schemes at a time; one a core by default.")] = None,
    json: JsonFile = None,
    page: Annotated[
        bool, typer.Option("--report/--no-report", help="Whether to draw the figures and the page.")
    ] = True,
) -> None:
    """Run a pipeline in a room: trace, then design, measure, localise and map, cycle by cycle.

    An interrupted run goes on where it stopped when the same command is given again, and a completed one is shown;
    other settings make another folder.
    A file of another kind is a study: 'compare_channels' (exit code 1 if the channels differ), 'fig4a', 'claims',
    'train_classifier', or 'fig4b', 'fig4c', 'rooms', 'ablations', 'robustness', 'hardware', 'unseen', which go through
    settings, rooms and seeds (exit code 1 if a run failed).

    Example: rislam-rt run trace_then_slam --scene office --set seed=1 --set 'schemes=["optimized", "no_ris"]'
    """
    from rislam_rt.pipeline import PipelineSpec
    from rislam_rt.studies import load_any

    check_one_scene(scene, set_)
    spec = load_any(pipeline, set_ or ())
    given = StudyOptions(pipeline, scene, out, jobs, json, page)
    if isinstance(spec, PipelineSpec):
        run_main_job(spec, given, named=names_schemes(spec, pipeline, set_ or ()))
        return
    from rislam_rt.cli import study
    from rislam_rt.studies import ClaimsSpec, ClassifierSpec, CompareSpec, Fig4aSpec, UnseenSpec

    runs: dict[type, Callable[[Any, StudyOptions], None]] = {
        CompareSpec: study.run_compare_channels, Fig4aSpec: study.run_gain_curves, UnseenSpec: study.run_unseen,
        ClaimsSpec: study.run_claims, ClassifierSpec: study.run_classifier,
    }  # fmt: skip
    runs.get(type(spec), study.run_swept)(spec, given)


def run_main_job(spec: "PipelineSpec", given: StudyOptions, *, named: bool) -> None:
    """Run all schemes of a SLAM pipeline in a scene, as `rislam-rt run` does; a completed run is shown instead.

    Where the user `named` no schemes, those that need a panel are left out of a scene without one, and a line says so.
    """
    from rislam_rt.cli.scene_arguments import open_scene, scene_of
    from rislam_rt.model.delay_spread import SPREAD
    from rislam_rt.pipeline.channels import prepare_channel
    from rislam_rt.pipeline.run import check_run
    from rislam_rt.pipeline.specification.radio import build_radio
    from rislam_rt.pipeline.store.identity import run_identity
    from rislam_rt.pipeline.store.run_folder import DONE, find_run

    opened = open_scene(scene_of(given.scene, spec, given.pipeline), build_radio(spec.radio))
    need = [] if named else panel_schemes(spec, opened.scene)
    spec = without_schemes(spec, need)
    check_run(opened.scene, spec)
    if need:
        left = ", ".join(spec.schemes)
        typer.echo(f"scene '{opened.scene.name}' has no panel, which {', '.join(need)} need: {left} alone")
    identity = run_identity(spec, opened.scene)
    folder = given.out or Path("runs") / identity.folder
    about = find_run(folder, identity)
    if about is not None and about["state"] == DONE:
        show_run(folder, about, given)
        opened.warn(but=SPREAD)
        return
    prepare_channel(spec.channel)
    opened.warn(but=SPREAD)
    compute_run(spec, opened.scene, identity, folder, given)


def names_schemes(spec: "PipelineSpec", pipeline: Path, changed: Sequence[str]) -> bool:
    """For `rislam-rt run`: whether the user named the schemes, in a pipeline of their own or by `--set`."""
    in_file = "schemes" in spec.model_fields_set and not is_shipped(pipeline)
    return in_file or any(setting.partition("=")[0].strip() == "schemes" for setting in changed)


def panel_schemes(spec: "PipelineSpec", scene: "Scene") -> list[str]:
    """For `rislam-rt run`: the schemes of a pipeline that need a panel and do not find one in the scene."""
    from rislam_rt.pipeline.schemes import SCHEMES

    return [] if scene.ris is not None else [name for name in spec.schemes if SCHEMES[name].panel]


def without_schemes(spec: "PipelineSpec", left_out: Sequence[str]) -> "PipelineSpec":
    """For `rislam-rt run`: a pipeline without the schemes that find no panel; with `no_ris` if none is left."""
    if not left_out:
        return spec
    return spec.model_copy(update={"schemes": [name for name in spec.schemes if name not in left_out] or ["no_ris"]})


def show_run(folder: Path, about: Mapping[str, Any], given: StudyOptions) -> None:
    """For `rislam-rt run`: print the scores of a completed run from its folder, draw its page if that is missing."""
    from rislam_rt.pipeline.long.run import read_any
    from rislam_rt.pipeline.store.run_folder import hold_run, read_summary
    from rislam_rt.report.page import PAGE, write_report
    from rislam_rt.storage.lock import LOCK_FILE

    summary = read_summary(folder, about)
    typer.echo("this run is complete already; nothing was computed")
    show_scores(summary)
    page = folder / PAGE
    draw = given.page and not page.is_file()
    if draw or (folder / LOCK_FILE).exists():  # a process died at the report, or is at it
        with hold_run(folder):
            if draw:
                write_report(read_any(folder).shown, summary, folder)
    if given.page:
        typer.echo(f"report: {page}")
    typer.echo(f"run folder: {folder}")
    write_json(given.json, summary)


def compute_run(
    spec: "PipelineSpec", room: "Scene", identity: "RunIdentity", folder: Path, given: StudyOptions
) -> None:
    """For `rislam-rt run`: compute a run, or its missing schemes, in its folder; print scores and write the page."""
    import os

    import numpy as np

    from rislam_rt.pipeline import run_slam
    from rislam_rt.pipeline.long.run import LongRun, run_long
    from rislam_rt.pipeline.long.slices import is_long
    from rislam_rt.pipeline.scores.summary import summarise
    from rislam_rt.pipeline.store.run_folder import open_run

    kept = 0
    try:
        with open_run(folder, identity) as store:
            for name in store.spoiled:
                warn(f"{folder}: scheme '{name}' is not as it was written; it runs again")
            try:
                rng, jobs = np.random.default_rng(spec.seed), given.jobs or os.cpu_count() or 1
                with show_progress() as progress:
                    if is_long(room, spec):
                        found = run_long(room, spec, store, rng=rng, jobs=jobs, progress=progress)
                    else:
                        result = run_slam(room, spec, rng=rng, jobs=jobs, done=store, progress=progress)
                        found = LongRun(summarise(result), result)
                        store.complete(result, found.summary)
                summary, result = found
            finally:
                kept = len(store)
            show_scores(summary)
            if given.page:
                from rislam_rt.report import write_report

                typer.echo(f"report: {write_report(result, summary, folder)}")
    except KeyboardInterrupt:
        said = f"{counted(kept, 'scheme')} kept; the same command goes on from there" if kept else "nothing was kept"
        raise Interrupted(f"interrupted: {said}") from None
    typer.echo(f"run folder: {folder}")
    write_json(given.json, summary)


def show_scores(summary: Mapping[str, Any]) -> None:
    """For `rislam-rt run`: print the scores of a run from its summary, then its warnings on the error stream."""
    from rislam_rt.report.terminal_tables import print_summary

    print_summary(summary)
    for line in summary["warnings"]:
        warn(line)
