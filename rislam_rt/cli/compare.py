"""`rislam-rt compare SCENE`."""

from typing import Annotated

import typer

from rislam_rt.cli.options import Depth, JsonFile, SceneFolder, Seed, write_json


def command(
    scene: SceneFolder,
    poses: Annotated[int, typer.Option(min=1, max=100_000, help="Number of random poses.")] = 50,
    depth: Depth = 2,
    seed: Seed = 7,
    json: JsonFile = None,
) -> None:
    """Compare traced and analytic paths one by one at random poses. Exit code 1 if a difference is unexplained.

    Twice: with the tracer's paths refined in float64, as every run uses them, and with its own float32 vertices.
    """
    import numpy as np

    from rislam_rt.backend import prepare_backend
    from rislam_rt.channel.compare import compare_channels
    from rislam_rt.cli.scenes import open_scene
    from rislam_rt.model import RadioConfig
    from rislam_rt.report.tables import print_comparison

    opened = open_scene(scene)
    room = opened.scene
    prepare_backend()
    opened.warn()
    refined, raw = (
        compare_channels(room, RadioConfig(), poses=poses, depth=depth, rng=np.random.default_rng(seed), refine=refine)
        for refine in (True, False)
    )
    print_comparison(room.name, refined, raw)
    about = {"scene": room.name, "poses": poses, "depth": depth, "seed": seed}
    write_json(json, {**about, **refined.as_dict(), "float32": raw.as_dict()})
    if refined.unexplained or raw.unexplained:
        raise typer.Exit(1)
