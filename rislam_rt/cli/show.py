"""The command `rislam-rt show SCENE`: describes a scene, and draws it as a picture or an interactive page."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rislam_rt.cli.options import MAIN_JOB, Depth, SceneFolder, Settings, pipeline_file
from rislam_rt.cli.output_files import OUTPUT, check_ending, check_output
from rislam_rt.cli.progress_bars import show_progress
from rislam_rt.storage.files import write_atomic

if TYPE_CHECKING:
    from rislam_rt.model import Scene
    from rislam_rt.pipeline.specification.pipeline_spec import Settings as Records


def command(
    scene: SceneFolder,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Picture to write (PNG, SVG or PDF)."), OUTPUT
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a view that turns, with paths; for any browser, offline."),
        OUTPUT,
    ] = None,
    depth: Depth = 1,
    pipeline: Annotated[
        Path,
        typer.Option(metavar="PIPELINE", help="Whose radio and receiver say which paths are heard (--html).",
                     parser=pipeline_file),
    ] = MAIN_JOB,
    set_: Settings = None,
) -> None:  # fmt: skip
    """Describe a scene, and draw it from above and in three dimensions; or as a page that turns (--html).

    The page shows the paths of poses along the way by class, found by exact image sources, --depth bounces at most.

    Example: rislam-rt show office --html office.html --depth 2
    """
    from rislam_rt.cli.scene_arguments import open_scene
    from rislam_rt.pipeline import load_spec
    from rislam_rt.pipeline.specification.pipeline_spec import build_settings
    from rislam_rt.report.terminal_tables import print_scene
    from rislam_rt.scene.scene_folder import safe_name

    check_ending("--html", html, (".html", ".htm"))
    settings = build_settings(load_spec(pipeline, set_ or ())) if html is not None else None
    if out is not None:
        from rislam_rt.report.style import picture_kind

        picture_kind(out)  # before anything is worked out
    opened = open_scene(scene, settings.radio if settings is not None else None)
    room = opened.scene
    picture = out or (check_output(Path(f"{safe_name(room.name)}.png")) if html is None else None)
    opened.warn()
    print_scene(room)
    if html is not None and settings is not None:
        typer.echo(f"view: {_write_view(room, settings, depth, html)}")
    if picture is None:
        return
    from rislam_rt.report.room_figures import draw_scene

    with show_progress() as tell:
        tell("draw", 0, 1)
        file = draw_scene(room, picture)
        tell("draw", 1, 1)
    typer.echo(f"picture: {file}")


def _write_view(room: "Scene", settings: "Records", depth: int, file: Path) -> Path:
    """Part of `rislam-rt show --html`: write the view of a scene with the paths at some poses of its trajectory."""
    from rislam_rt.channel.image_source import ImageSourceChannel
    from rislam_rt.report.view.page import view_page
    from rislam_rt.report.view.paths_data import paths_data, poses_of

    with show_progress() as tell:
        tell("paths", 0, 2)
        channel = ImageSourceChannel(room, settings.radio, depth)
        middle = channel.paths(room.agent[len(room.agent) // 2 :][:1])
        tell("paths", 1, 2)
        motion = room.agent[poses_of(room, int(middle.valid.sum()))]
        data = paths_data(room, motion, channel.paths(motion), settings)
        tell("paths", 2, 2)
    size = " x ".join(f"{side:.3g}" for side in room.bounds[1] - room.bounds[0])
    about = f"{size} m, {len(motion)} poses along the way. Drag to turn, wheel or two fingers to zoom."
    if data["left_out"]:
        about += f" {data['left_out']} small walls are left out."
    write_atomic(file, view_page(room.name, about, data).encode())
    return file
