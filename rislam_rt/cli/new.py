"""`rislam-rt new SCENE`."""

from pathlib import Path
from typing import Annotated

import typer


def command(
    scene: Annotated[
        Path, typer.Argument(metavar="SCENE", help="Folder to make; it must not exist yet.", show_default=False)
    ],
    template: Annotated[str, typer.Option(help="Built-in room to start from.")] = "paper_room",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the files of a folder that exists.")] = False,
) -> None:
    """Make a scene folder from a built-in room, to be edited."""
    from rislam_rt.scene import new_scene

    typer.echo(f"{new_scene(template, scene, overwrite=overwrite)}: made from '{template}'; edit its scene.toml")
