"""`rislam-rt trace SCENE`."""

from pathlib import Path
from typing import Annotated

import typer

from rislam_rt.cli.options import ChannelName, Depth, JsonFile, SceneFolder, write_json


def command(
    scene: SceneFolder,
    depth: Depth = 2,
    channel: ChannelName = "traced",
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write all paths to a NetCDF file.")] = None,
    json: JsonFile = None,
) -> None:
    """Trace a scene along the agent's trajectory and print what was found, class by class."""
    from time import perf_counter

    from rislam_rt.cli.scenes import open_scene
    from rislam_rt.model import RadioConfig
    from rislam_rt.pipeline.dataset import paths_to_dataset, write_dataset
    from rislam_rt.pipeline.run import build_channel, prepare_channel
    from rislam_rt.report.tables import path_table, print_paths

    opened = open_scene(scene)
    room = opened.scene
    prepare_channel(channel)
    opened.warn()
    begin = perf_counter()
    paths = build_channel(channel, room, RadioConfig(), depth).paths(room.agent)
    seconds = perf_counter() - begin
    table = path_table(paths)
    print_paths(room.name, paths, table, seconds)
    if out is not None:
        write_dataset(paths_to_dataset(paths, room.agent), out)
        typer.echo(f"paths: {out}")
    content = {"scene": room.name, "depth": depth, "cycles": len(room.agent), "source": paths.source}
    write_json(json, {**content, "seconds": seconds, "classes": table})
