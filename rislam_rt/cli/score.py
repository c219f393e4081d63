"""The command `rislam-rt score RUN`: the score card of a completed run in any room, and recordings of its schemes."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rislam_rt.cli.options import JsonFile, RunFolder
from rislam_rt.cli.output_files import check_output, write_json
from rislam_rt.cli.progress_bars import show_progress
from rislam_rt.cli.verbosity import verbosity, warn
from rislam_rt.errors import ConfigError
from rislam_rt.input_messages import counted

if TYPE_CHECKING:
    from rislam_rt.model import SlamResult
    from rislam_rt.studies.score_card.recorded_run import RecordedScheme


def command(
    run: RunFolder,
    save: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Write a recording of each scheme there, RUN_SCHEME.nc with the run folder's name: "
            "inputs, truth, scores.",
        ),
    ] = None,
    replay: Annotated[
        bool,
        typer.Option(
            "--replay/--no-replay",
            help="Whether to replay the measurements, as long as localising took. Births, delays and CPU time need it; "
            "errors, bounds, and walls, landmarks and ghosts of the last map do not.",
        ),
    ] = True,
    json: JsonFile = None,
) -> None:
    """Print the score card of a completed run, in a room of one's own or another: what the study 'unseen' says of its.

    Error and bound relative to the true start, whether the run was lost and said so, walls, landmarks and panel found
    of those heard, ghosts, births, delays. A panel that the scheme is told of counts among the landmarks, too. A run
    folder holds the last map alone: for births and delays its measurements are replayed, which gives the run's
    estimates again; nothing is traced. What is saved with --save goes into read_recording, replay and score_run of
    Python.

    Example: rislam-rt score runs/trace_then_slam-office-7-0123abcd --save recordings
    """
    from rislam_rt.pipeline.long.run import read_whole
    from rislam_rt.report.unseen.run_card import print_run_card
    from rislam_rt.studies.score_card.recording_file import write_recording
    from rislam_rt.sweeps.cell_work import plain_result

    result = read_whole(run)
    files = {name: _recording_file(save, run, name) for name in result.schemes} if save is not None else {}
    found = _recorded(result, run, replay=replay)
    scores: dict[str, dict[str, Any]] = {}
    for one in found:
        name = one.recording.scheme
        scores[name] = {**one.recording.scores, "cycle_ms": None if one.cycle_s is None else 1e3 * one.cycle_s}
        if one.has_strayed:
            warn(
                f"{name}: its replay strays from the run's estimates by up to {one.apart:.2g} m, as another version or "
                "machine made them: delays and births are not known; run again for them"
            )
        if name in files:
            write_recording(one.recording, files[name])
    cycles = len(result.scene.agent)
    about = {"pipeline": result.name, "scene": result.scene.name, "cycles": cycles, "seed": result.seed}
    print_run_card("{pipeline} in {scene}: {cycles} cycles, seed {seed}".format(**about), scores)
    for file in files.values():
        typer.echo(f"recording: {file}")
    write_json(json, plain_result({"run": str(run), **about, "replayed": replay, "schemes": scores}))


def _recording_file(folder: Path, run: Path, scheme: str) -> Path:
    """Path of the recording of a scheme, checked: the score card is not computed if it cannot be written."""
    if not folder.is_dir() and (folder.exists() or folder.suffix == ".nc"):
        raise ConfigError(f"--save {folder}: names a file; give a folder, for one recording of each scheme")
    from rislam_rt.pipeline.run_datasets import part_name

    file = folder / part_name(run.resolve().name, scheme)
    check_output(file, "--save ")
    return file


def _recorded(result: "SlamResult", run: Path, *, replay: bool) -> "list[RecordedScheme]":
    """Recordings of all schemes for their score cards, with a progress bar while they are replayed."""
    from rislam_rt.studies.score_card.recorded_run import recorded_schemes, replay_seconds

    if not replay:
        return list(recorded_schemes(result, run, replayed=False))
    if not verbosity().quiet:
        what = f"{counted(len(result.scene.agent), 'cycle')} of {counted(len(result.schemes), 'scheme')}"
        typer.echo(f"replaying {what}: localising took {replay_seconds(result):.0f} s in the run", err=True)
    with show_progress() as progress:
        return list(recorded_schemes(result, run, progress=progress))
