"""Command line options that several commands share, and their parsing."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import typer

from rislam_rt.cli.output_files import OUTPUT
from rislam_rt.errors import ConfigError
from rislam_rt.input_messages import parse_number
from rislam_rt.shipped import find_pipeline, find_room

if TYPE_CHECKING:
    from rislam_rt.arrays import Floats

FARTHEST = 1e5
"""Largest coordinate [m] of a point on the command line, as in a scene."""


def pipeline_file(name: str) -> Path:
    """Command line argument of a pipeline: the path of its file, or of a built-in one by its name.

    Its folder and the working folder are added to Python's module path, so that it can name a user's own methods. Those
    of a run's folder, copied as they ran, come before those of the working folder, which `python -m` has put first.
    """
    file = find_pipeline(name)
    beside, here = str(file.parent.resolve()), os.getcwd()
    if (file.parent / "run.json").is_file() and here in sys.path and beside not in sys.path:
        sys.path.insert(sys.path.index(here), beside)
    look_for_methods_in(beside, here)
    return file


def run_folder(name: str) -> Path:
    """Command line argument of a completed run: its folder. Methods of a user's own are looked for in the working
    folder."""
    look_for_methods_in(os.getcwd())
    return Path(name)


def look_for_methods_in(*folders: str) -> None:
    """Add folders to Python's module path, for a user's own methods on the command line."""
    for folder in folders:
        if folder not in sys.path:
            sys.path.append(folder)  # last, so that nobody's file hides a library


SceneFolder = Annotated[
    Path,
    typer.Argument(
        metavar="SCENE", help="Scene folder, or the name of a built-in room.", parser=find_room, show_default=False
    ),
]
PipelineFile = Annotated[
    Path,
    typer.Argument(
        metavar="PIPELINE", help="Pipeline file (TOML), or the name of a built-in one.", parser=pipeline_file
    ),
]
RunFolder = Annotated[
    Path,
    typer.Argument(metavar="RUN", help="Folder of a completed run.", parser=run_folder, show_default=False),
]
MAIN_JOB = Path("trace_then_slam")
"""Default pipeline of all commands."""
SceneOption = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="Scene folder, or the name of a built-in room; the pipeline's own by default.",
        parser=find_room,
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a setting, e.g. radio.bandwidth_ghz=0.5; repeatable."),
]
RadioSettings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a setting radio.*, as in a pipeline; repeatable."),
]
JsonFile = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="Write what is printed to FILE, machine-readable."), OUTPUT
]
Seed = Annotated[int, typer.Option(min=0, help="Seed of all random draws.")]
Depth = Annotated[int, typer.Option(min=0, max=4, help="Largest number of wall bounces on a path.")]
ChannelName = Annotated[Literal["traced", "image_source"], typer.Option(help="Ray tracer, or exact image sources.")]


class StudyOptions(NamedTuple):
    """Options of `rislam-rt run` beside the settings, for studies as well."""

    pipeline: Path
    """Pipeline file."""
    scene: Path | None
    """Scene folder of `--scene`."""
    out: Path | None
    """Output folder of `--out`."""
    jobs: int | None
    """Number of processes."""
    json: Path | None
    """File of `--json`."""
    page: bool
    """Whether to draw the figures and the page."""


def check_one_scene(scene: Path | None, changed: Sequence[str] | None) -> None:
    """Check that a command is not given two scenes, one by its option `--scene` and one by `--set`.

    Raises
    ------
    ConfigError
        It is.
    """
    if scene is not None and any(setting.partition("=")[0].strip() == "scene" for setting in changed or ()):
        raise ConfigError(f"--set scene: --scene {scene} is given too; leave one of them out")


def parse_point(option: str, text: str, farthest: float = FARTHEST) -> "Floats":
    """Point or vector (3,) from the text `x,y,z` of a command line option, within `farthest` along each axis.

    Raises
    ------
    ConfigError
        It is not three numbers, or one lies beyond that: by default, beyond what a scene may hold.
    """
    import numpy as np

    try:
        values = np.array([parse_number(part) for part in text.split(",")])
    except ValueError:
        values = np.zeros(0)
    if values.shape == (3,) and (np.abs(values) > farthest).any():
        raise ConfigError(
            f"{option}: '{text[:60]}' received; give at most {farthest:g}, counted from a point in the room or near it"
        )
    if values.shape != (3,) or not np.isfinite(values).all():
        raise ConfigError(f"{option}: '{text[:60]}' received; give three numbers, e.g. {option} 0.5,0.7,0.5")
    return values
