"""Opening a scene for a command."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rislam_rt.arrays import Floats
    from rislam_rt.model import Scene


def open_scene(path: Path) -> "Scene":
    """A scene that was read and checked; its warnings go to the error stream.

    Raises
    ------
    SceneError
        It is unusable.
    """
    import typer

    from rislam_rt.scene import check_scene, load_scene
    from rislam_rt.scene.findings import raise_errors

    scene = load_scene(path)
    findings = check_scene(path)
    raise_errors(findings)
    for finding in findings:
        typer.echo(f"warning: {finding.line}", err=True)
    return scene


def parse_point(text: str, scene: "Scene") -> "Floats":
    """A point `x,y,z` [m] within the bounds of a scene.

    Raises
    ------
    ConfigError
        It is not three finite numbers, or lies outside.
    """
    import numpy as np

    from rislam_rt.errors import ConfigError

    try:
        point = np.array([float(part) for part in text.split(",")])
    except ValueError:
        point = np.zeros(0)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise ConfigError(f"--at: '{text[:60]}' received; give three numbers in metres, e.g. --at 1.5,1.5,0.5")
    low, high = scene.bounds
    if (point < low - 1e-9).any() or (point > high + 1e-9).any():
        raise ConfigError(
            f"--at: {point.tolist()} lies outside the room ({low.tolist()} to {high.tolist()}); move it in"
        )
    return point
