"""Export of a run as a recording for the Rerun viewer: room, true trajectory, and each scheme's estimates over time."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb

from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import SetupError
from rislam_rt.model import Scene, SchemeResult, SlamResult
from rislam_rt.report.drawing_geometry import wall_edges
from rislam_rt.report.style import scheme_styles

TIMELINE = "time"
TWO_SIGMA = 2.0
GREY = (90, 90, 90)
"""Colour of the true room, trajectory and landmarks."""


def recording_bytes(result: SlamResult, identity: str) -> bytes:
    """Encode a run as a recording for the Rerun viewer, the content of an `.rrd` file in metres and seconds.

    Parameters
    ----------
    identity
        Name of the recording: the viewer takes two files of one name for the same.

    Raises
    ------
    SetupError
        The extra `viz` (rerun-sdk) is not installed.
    """
    try:
        import rerun
    except ImportError:
        raise SetupError("--rerun: rerun-sdk is not installed; pip install 'rislam-rt[viz]'") from None
    stream = rerun.RecordingStream("rislam_rt", recording_id=identity)
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    sink = stream.binary_stream()
    _log_room(rerun, stream, result.scene)
    colours = _colours(result.schemes)
    for cycle, time in enumerate(result.scene.agent.time):
        stream.set_time(TIMELINE, duration=float(time))
        stream.log("truth/agent", rerun.Points3D([result.scene.agent.position[cycle]], radii=0.03, colors=[GREY]))
        for name, scheme in result.schemes.items():
            _log_cycle(rerun, stream, scheme, cycle, colours[name])
            error = float(np.linalg.norm(scheme.position[cycle] - result.scene.agent.position[cycle]))
            stream.log(f"error/{name}", rerun.Scalars(error))
    for name, scheme in result.schemes.items():
        way = rerun.LineStrips3D([scheme.position], colors=[colours[name]])
        stream.log(f"{name}/way", way, static=True)
    return bytes(sink.read() or b"")


def _log_room(rerun: Any, stream: Any, scene: Scene) -> None:
    """Add the edges of the walls, true landmarks and true trajectory to a Rerun recording, for all times."""
    stream.log("/", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    edges = wall_edges(build_walls(scene))
    stream.log("truth/room", rerun.LineStrips3D(edges, colors=[GREY]), static=True)
    stream.log("truth/way", rerun.LineStrips3D([scene.agent.position], colors=[GREY]), static=True)
    marks = rerun.Points3D(scene.landmark_positions, labels=list(scene.landmarks), radii=0.05, colors=[GREY])
    stream.log("truth/landmarks", marks, static=True)


def _log_cycle(rerun: Any, stream: Any, scheme: SchemeResult, cycle: int, colour: tuple[int, ...]) -> None:
    """Add a scheme's estimated position, its 2 sigma ellipsoid and the landmarks of a cycle to a Rerun recording."""
    from scipy.spatial.transform import Rotation

    size, axes = np.linalg.eigh(scheme.covariance[cycle, :3, :3])
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    place = scheme.position[cycle]
    name = scheme.scheme
    stream.log(f"{name}/agent", rerun.Points3D([place], radii=0.03, colors=[colour]))
    ellipsoid = rerun.Ellipsoids3D(
        centers=[place],
        half_sizes=[TWO_SIGMA * np.sqrt(np.maximum(size, 0.0))],
        quaternions=[rerun.Quaternion(xyzw=Rotation.from_matrix(axes).as_quat())],
        colors=[colour],
    )
    stream.log(f"{name}/ellipsoid", ellipsoid)
    held = np.flatnonzero(scheme.held[cycle] & (scheme.parent < 0))
    number = [""] * len(scheme.ident) if scheme.panel is None else [f" {panel}" for panel in scheme.panel[cycle]]
    panel = [f" panel{number[i]}" if scheme.ris_probability[cycle, i] > 0.5 else "" for i in held]
    labels = [f"{scheme.ident[i]}{text}" for i, text in zip(held, panel, strict=True)]
    points = rerun.Points3D(scheme.landmark_position[cycle, held], labels=labels, radii=0.04, colors=[colour])
    stream.log(f"{name}/landmarks", points)


def _colours(schemes: Iterable[str]) -> dict[str, tuple[int, ...]]:
    """Colours of a run's schemes in a Rerun recording, by name: red, green, blue from 0 to 255."""
    styles = scheme_styles(schemes)
    return {name: tuple(round(255 * part) for part in to_rgb(style.colour)) for name, style in styles.items()}
