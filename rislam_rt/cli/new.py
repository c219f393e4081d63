"""`rislam-rt new SCENE`."""

from pathlib import Path
from typing import Annotated

import typer


def command(
    scene: Annotated[
        Path, typer.Argument(metavar="SCENE", help="Folder to make; it must not exist yet.", show_default=False)
    ],
    from_: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="FILE",
            help="A scene file of Mitsuba or Sionna RT (.xml), or sionna:NAME for a scene that Sionna brings along.",
        ),
    ] = "",
    within: Annotated[
        str, typer.Option(metavar="X0,Y0,X1,Y1", help="With --from: take this window of the plan alone [m].")
    ] = "",
    template: Annotated[str, typer.Option(help="Built-in room to start from.")] = "paper_room",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the files of a folder that exists.")] = False,
    seed: Annotated[
        int | None, typer.Option(min=0, help="A random room instead: the one that 'unseen' draws from this number.")
    ] = None,
) -> None:
    """Make a scene folder from a file, from a built-in room, or of a random one, to be edited."""
    from rislam_rt.scene import new_scene, write_scene

    if from_:
        from rislam_rt.cli.options import parse_numbers
        from rislam_rt.scene.xml import new_from_xml

        notes = new_from_xml(from_, scene, within=parse_numbers("--within", within), overwrite=overwrite)
        typer.echo(f"{scene}: made from '{from_}'; edit its scene.toml")
        for note in notes:
            typer.echo(f"note: {note}")
        return
    if seed is not None:
        from rislam_rt.scene.random_rooms import draw_room

        room = draw_room(seed)
        write_scene(room.scene, scene, overwrite=overwrite)
        typer.echo(f"{scene}: random room {seed} ({room.shape}, {room.motion}); edit its scene.toml")
        return
    typer.echo(f"{new_scene(template, scene, overwrite=overwrite)}: made from '{template}'; edit its scene.toml")
