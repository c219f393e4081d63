"""The command `rislam-rt design SCENE`: designs the panel's phase code for one position of the agent."""

from pathlib import Path
from typing import Annotated

import typer

from rislam_rt.cli.options import ChannelName, Depth, JsonFile, RadioSettings, SceneFolder, Seed
from rislam_rt.cli.output_files import OUTPUT, write_json


def command(
    scene: SceneFolder,
    at: Annotated[str, typer.Option(metavar="X,Y,Z", help="The agent's midpoint, in metres.", show_default=False)],
    depth: Depth = 2, channel: ChannelName = "image_source", seed: Seed = 7, set_: RadioSettings = None,
    figure: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the codes (PNG or SVG)."), OUTPUT] = None,
    json: JsonFile = None,
) -> None:  # fmt: skip
    """Design the panel's code for one position with every method, and say how far each is from the optimum.

    Example: rislam-rt design paper_room --at 1.5,1.5,0 --figure codes.png
    """
    import numpy as np

    from rislam_rt.cli.scene_arguments import open_scene, point_in
    from rislam_rt.pipeline.channels import prepare_channel
    from rislam_rt.pipeline.design_at_position import design_at, design_table
    from rislam_rt.pipeline.specification.read_pipeline import load_radio
    from rislam_rt.report.terminal_tables import print_designs

    radio = load_radio(set_ or ())
    opened = open_scene(scene, radio)
    room = opened.scene
    point = point_in(room, at)
    prepare_channel(channel)
    opened.warn()
    found = design_at(room, radio, point, channel=channel, depth=depth, rng=np.random.default_rng(seed))
    table = design_table(found)
    print_designs(room.name, point, found.designs, found.target)
    if not found.is_direct:
        typer.echo(f"the direct path to the panel is hidden; gains and gaps are those of {found.target}")
    for name, gains in found.panels.items():
        if gains:
            each = ", ".join(f"{panel} {gain:.2f} dB" for panel, gain in gains.items())
            typer.echo(f"{name}: {each}")
    if figure is not None:
        from rislam_rt.report.code_pictures import draw_codes

        typer.echo(f"figure: {draw_codes(found.designs, figure, room.ris.spec if room.ris else None)}")
    write_json(json, {"scene": room.name, "at_m": point.tolist(), "seed": seed, **table})
