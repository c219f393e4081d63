"""The command `rislam-rt export SCENE --xml FOLDER`: writes a scene in the XML format of Mitsuba and Sionna RT."""

from pathlib import Path
from typing import Annotated

import typer

from rislam_rt.cli.options import SceneFolder


def command(
    scene: SceneFolder,
    xml: Annotated[
        Path,
        typer.Option(
            metavar="FOLDER", help="Folder to make: `scene.xml` and meshes for Sionna RT.", show_default=False
        ),
    ],
) -> None:
    """Write a scene in another program's format: a Mitsuba scene file that Sionna RT's `load_scene` opens.

    Example: rislam-rt export office --xml office_xml
    """
    from rislam_rt.cli.scene_arguments import open_scene
    from rislam_rt.scene.xml import write_xml

    opened = open_scene(scene)
    notes = write_xml(opened.scene, xml)
    opened.warn()
    typer.echo(f"{xml}/scene.xml: open it with sionna.rt.load_scene(..., merge_shapes=False)")
    for note in notes:
        typer.echo(f"not in it, but in scene.toml beside it: {note}")
