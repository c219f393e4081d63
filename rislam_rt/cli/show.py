"""`rislam-rt show SCENE`."""

from pathlib import Path
from typing import Annotated

import typer

from rislam_rt.cli.options import SceneFolder


def command(
    scene: SceneFolder,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Picture to write (PNG or SVG).")] = None,
) -> None:
    """Describe a scene, and draw it from above and in three dimensions.

    Example: rislam-rt show office --out office.svg
    """
    from rislam_rt.cli.scenes import open_scene
    from rislam_rt.report.room import draw_scene
    from rislam_rt.report.tables import print_scene
    from rislam_rt.scene.names import safe_name

    opened = open_scene(scene)
    opened.warn()
    room = opened.scene
    print_scene(room)
    typer.echo(f"picture: {draw_scene(room, out or Path(f'{safe_name(room.name)}.png'))}")
