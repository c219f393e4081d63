"""What `rislam-rt run` does with a pipeline that is not the main job."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from rislam_rt.cli.options import write_json

if TYPE_CHECKING:
    from rislam_rt.pipeline.studies import CompareSpec, Fig4aSpec


class Given(NamedTuple):
    """What the command line says beside the settings."""

    pipeline: Path
    scene: Path | None
    out: Path | None
    jobs: int | None
    json: Path | None
    page: bool


def run_compare_channels(spec: "CompareSpec", given: Given) -> None:
    """Compare both channels in all rooms; exit code 1 if a difference is unexplained."""
    from rislam_rt.cli.progress import show_progress
    from rislam_rt.cli.scenes import open_scene
    from rislam_rt.errors import ConfigError
    from rislam_rt.pipeline.run import prepare_channel
    from rislam_rt.pipeline.studies.compare import comparison_table, run_comparison
    from rislam_rt.pipeline.studies.spec import study_record
    from rislam_rt.report.study import write_comparison
    from rislam_rt.report.tables import print_validation

    if given.scene is not None:
        raise ConfigError(f"--scene {given.scene}: a pipeline of kind 'compare_channels' names its rooms; set 'rooms'")
    opened = [open_scene(_beside(given.pipeline, room.scene)) for room in spec.rooms]
    folder = _folder(given.out, Path("runs") / f"{spec.name}-{spec.seed}")
    prepare_channel("traced")
    for one in opened:
        one.warn()
    scenes = [one.scene for one in opened]
    with show_progress() as progress:
        found = run_comparison(scenes, spec, jobs=given.jobs or os.cpu_count() or 1, progress=progress)
    content = {**study_record(spec, scenes), "unexplained": found.unexplained, "rooms": comparison_table(found)}
    print_validation(found.rows)
    typer.echo(f"page: {write_comparison(found, spec, content, folder, figures=given.page)}")
    write_json(given.json, content)
    if found.unexplained:
        raise typer.Exit(1)


def run_gain_curves(spec: "Fig4aSpec", given: Given) -> None:
    """Fig. 4(a): gain against distance."""
    import numpy as np

    from rislam_rt.cli.progress import show_progress
    from rislam_rt.cli.scenes import open_scene, scene_of
    from rislam_rt.pipeline.run import prepare_channel
    from rislam_rt.pipeline.studies.fig4a import check_fig4a, run_fig4a
    from rislam_rt.pipeline.studies.spec import study_record
    from rislam_rt.report.fig4a import fig4a_table, verdict
    from rislam_rt.report.study import write_fig4a

    opened = open_scene(scene_of(given.scene, spec, given.pipeline))
    scene = opened.scene
    check_fig4a(scene, spec)
    folder = _folder(given.out, Path("runs") / f"{spec.name}-{scene.name}-{spec.seed}")
    prepare_channel(spec.channel)
    opened.warn()
    with show_progress() as progress:
        found = run_fig4a(scene, spec, rng=np.random.default_rng(spec.seed), progress=progress)
    content = {**study_record(spec, [scene]), **fig4a_table(found)}
    for element in found.curves:
        typer.echo("\n".join([*verdict(found, element), ""]))
    typer.echo(f"page: {write_fig4a(found, spec, scene.name, content, folder, figures=given.page)}")
    write_json(given.json, content)


def _beside(pipeline: Path, scene: str) -> Path:
    """A scene folder that a pipeline file names."""
    return Path(os.path.normpath(pipeline.parent / scene))


def _folder(out: Path | None, default: Path) -> Path:
    """Where the files go; a study's files may join others in a folder.

    Raises
    ------
    ConfigError
        There is a file of that name.
    """
    from rislam_rt.errors import ConfigError

    folder = out or default
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"--out {folder}: is a file; give a folder")
    return folder
