"""Scenes that commands work on: reading and checking them, their warnings, points in them."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rislam_rt.cli.options import parse_point
from rislam_rt.cli.verbosity import warn
from rislam_rt.errors import ConfigError
from rislam_rt.shipped import room_beside

if TYPE_CHECKING:
    from rislam_rt.arrays import Floats
    from rislam_rt.model import RadioConfig, Scene
    from rislam_rt.pipeline import PipelineSpec
    from rislam_rt.studies import Fig4aSpec


class OpenedScene(NamedTuple):
    """A scene that was read and checked, with the warnings of the check."""

    scene: "Scene"
    warnings: tuple[str, ...]

    def warn(self, but: str | None = None) -> None:
        """Print the scene's warnings, after all other checks of a command, so that an error is one line; without those
        that hold the words `but`, which the command itself says later."""
        for line in self.warnings:
            if but is None or but not in line:
                warn(line)


def open_scene(path: Path, radio: "RadioConfig | None" = None) -> OpenedScene:
    """Read and check the scene that a command works on; where a radio is given, materials and panel at its carrier as
    well.

    Raises
    ------
    SceneError
        The scene has errors.
    """
    from rislam_rt.scene import check_scene, load_scene
    from rislam_rt.scene.findings import raise_errors

    findings = check_scene(path, radio)
    raise_errors(findings)
    return OpenedScene(load_scene(path), tuple(f.line for f in findings if f.severity == "warning"))


def scene_of(option: Path | None, spec: "PipelineSpec | Fig4aSpec", pipeline: Path) -> Path:
    """The scene folder that a command works on: that of `--scene`, or the one that the pipeline names, relative to its
    file, or built in.

    Raises
    ------
    ConfigError
        Neither names one.
    """
    if option is not None:
        return option
    if spec.scene is None:
        raise ConfigError(f"{pipeline}: scene: not given; add it, or give --scene DIR")
    return room_beside(pipeline.parent, spec.scene)


def point_in(scene: "Scene", text: str) -> "Floats":
    """Command line argument `--at`: a point (3,) [m] from the text `x,y,z`, which must lie within the bounds of a
    scene.

    Raises
    ------
    ConfigError
        It is not three finite numbers, or lies outside.
    """
    point = parse_point("--at", text)
    low, high = scene.bounds
    if (point < low - 1e-9).any() or (point > high + 1e-9).any():
        raise ConfigError(
            f"--at: {point.tolist()} lies outside the room ({low.tolist()} to {high.tolist()}); move it in"
        )
    return point
