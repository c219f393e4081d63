"""The command `rislam-rt compare SCENE`: compares traced with image-source paths at random poses in a scene."""

from typing import Annotated

import typer

from rislam_rt.cli.options import Depth, JsonFile, RadioSettings, SceneFolder, Seed
from rislam_rt.cli.output_files import write_json


def command(
    scene: SceneFolder, poses: Annotated[int, typer.Option(min=1, max=100_000, help="Number of random poses.")] = 50,
    depth: Depth = 2, seed: Seed = 7, set_: RadioSettings = None, json: JsonFile = None,
) -> None:  # fmt: skip
    """Compare traced and analytic paths one by one at random poses. Exit code 1 if a path that one side lacks is
    unexplained, or an error of a path that both have is beyond what precision and geometry explain.

    Twice: with the tracer's own float32 vertices, which are the independent evidence and the verdict; and refined in
    float64, as every run uses them. A refined number beyond its limits is exit code 1 too.

    Example: rislam-rt compare paper_room --poses 20 --depth 1 --set radio.tx_pattern=dipole
    """
    import numpy as np

    from rislam_rt.channel.compare import compare_channels
    from rislam_rt.cli.scene_arguments import open_scene
    from rislam_rt.pipeline.specification.read_pipeline import load_radio
    from rislam_rt.report.terminal_tables import print_comparison
    from rislam_rt.tracer_backend import prepare_backend

    radio = load_radio(set_ or ())
    opened = open_scene(scene, radio)
    room = opened.scene
    prepare_backend()
    opened.warn()
    refined, raw = (
        compare_channels(room, radio, poses=poses, depth=depth, rng=np.random.default_rng(seed), refine=refine)
        for refine in (True, False)
    )
    print_comparison(room.name, refined, raw)
    about = {"scene": room.name, "poses": poses, "depth": depth, "seed": seed}
    passed = raw.passed and refined.passed
    verdict = {"passed": passed, "evidence": "float32", "float32": raw.passed, "refined": refined.passed}
    write_json(json, {**about, "verdict": verdict, **refined.as_dict(), "float32": raw.as_dict()})
    if not passed:
        raise typer.Exit(1)
