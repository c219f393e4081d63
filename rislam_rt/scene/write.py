"""Writing of a scene folder, whole or not at all: of a `Scene`, or of a room that comes with the package."""

import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import SceneError, StoreError
from rislam_rt.model import Material, RisPanel, Scatterer, Scene, Trajectory
from rislam_rt.scene.meshes import ply_bytes
from rislam_rt.scene.scene_folder import README, SCENE_FILE, mesh_file
from rislam_rt.scene.shapes import solid_mesh
from rislam_rt.shipped import shipped_missing, shipped_rooms
from rislam_rt.toml import parse_toml, toml_bytes

TRAJECTORY_FILE = "path.tum"
"""Name of the agent's path in a scene folder."""
MADE = re.compile(
    r"(Made|Written) by `(rislam-rt new[ `]|python tools/build_scenes\.py )"
    r"|`rislam-rt new ROOM --from scene\.xml` brings"
)
"""Line in the README of a room that this program wrote, by which its folder is recognised."""


def write_scene(scene: Scene, folder: str | Path, *, overwrite: bool = False, about: str = "") -> Path:
    """Write a scene as the files of a scene folder, with a README if `about` is given. Returns the folder.

    Raises
    ------
    SceneError
        The folder exists and `overwrite` is False, or it holds a scene that this program did not make (`check_made`).
    StoreError
        The disk refused.
    """
    readme = {README: f"# {scene.name}\n\n{about}\n".encode(errors="replace")} if about else {}
    return write_files(scene_files(scene) | readme, folder, overwrite=overwrite)


def new_scene(template: str, folder: str | Path, *, overwrite: bool = False) -> Path:
    """Copy one of the rooms that come with the package into a new scene folder, named after it. Returns the folder.

    Raises
    ------
    SceneError
        No such template, or the folder exists and `overwrite` is False.
    StoreError
        The disk refused.
    """
    rooms = shipped_rooms()
    if not rooms:
        raise SceneError(f"template: '{template}' received; {shipped_missing('scenes')}")
    if template not in rooms:
        raise SceneError(f"template: '{template}' received; give one of {', '.join(rooms)}")
    room = rooms[template]
    files = {file.relative_to(room).as_posix(): file.read_bytes() for file in sorted(room.rglob("*")) if file.is_file()}
    name = room_name(Path(folder), template)
    files[SCENE_FILE] = toml_bytes(parse_toml(files[SCENE_FILE].decode()) | {"name": name})
    _, about, _ = files[README].decode().split("\n\n", 2)
    files[README] = f"# {name}\n\n{about}\n\nMade by `rislam-rt new --template {template}`.\n".encode()
    return write_files(files, folder, overwrite=overwrite)


def room_name(folder: Path, template: str) -> str:
    """Name of a room from the folder that it lies in: the folder's name, with what a room's name cannot hold as `_`."""
    name = re.sub(r"[^A-Za-z0-9_.\-]", "_", os.path.basename(os.path.realpath(folder)))[:64]
    return name if name.strip("._-") else template


def scene_files(scene: Scene) -> dict[str, bytes]:
    """Files of a scene folder to write, by name: `scene.toml`, a PLY mesh a reflector, the path unless straight."""
    shades = [(s.name, s.shade) for s in scene.scatterers if s.shade is not None and not _has_own_shadow(s)]
    meshes = [(r.name, r) for r in scene.reflectors] + shades + [(shade.name, shade) for shade in scene.occluders]
    files = {mesh_file(name): ply_bytes(mesh.vertices, mesh.faces) for name, mesh in meshes}
    agent = _agent_table(scene.agent)
    if "trajectory" in agent:
        files[TRAJECTORY_FILE] = tum_bytes(scene.agent.time, scene.agent.position, scene.agent.heading)
    return files | {SCENE_FILE: toml_bytes(_scene_table(scene, agent))}


def write_files(files: Mapping[str, bytes], folder: str | Path, *, overwrite: bool | None = None) -> Path:
    """Write files (relative name -> content) under a folder, such as a scene's: a new one appears whole, by one rename.

    With `overwrite`, files of an existing folder are replaced one by one, if this program made the room there
    (`check_made`), and others in it stay. None says that the caller has no option for it, which no error then offers.

    Raises
    ------
    SceneError
        The folder exists and `overwrite` is not True, it holds files of these names that this program did not make, or
        its place is taken by a file.
    StoreError
        The disk refused.
    """
    folder = Path(folder)
    try:
        there = folder.exists() or os.path.exists(os.path.realpath(folder))  # `x/..` is there though `x` is not
    except OSError as error:
        raise SceneError(f"{str(folder)[:80]}: cannot be used ({error.strerror}); give another folder") from None
    if there and not overwrite:
        other = (
            ", or --overwrite (in Python overwrite=True)"
            if overwrite is False and _holds_our_room(folder, files)
            else ""
        )
        raise SceneError(f"{folder}: exists already; give a folder that does not exist yet{other}")
    taken = next((place for place in (folder, *folder.parents) if os.path.lexists(place)), folder)
    if os.path.exists(taken) and not os.path.isdir(taken):
        raise SceneError(f"{taken}: is not a folder; give another")
    if there:
        check_made(folder, files)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        staged = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
        try:
            _write_staged(files, staged)
            _publish(staged, folder, files)
        finally:
            shutil.rmtree(staged, ignore_errors=True)
    except OSError as error:
        raise StoreError(f"{folder}: cannot be written ({error.strerror}); check permissions and free space") from None
    return folder


def check_made(folder: Path, names: Iterable[str]) -> None:
    """Check that files of these names (relative to a folder) may be written over: that what is there this program made.

    A room of its making is known by a line of its README, or, without one, by a scene file just as it writes it. An
    empty file may be replaced.

    Raises
    ------
    SceneError
        One of them is of another's making, or cannot be read.
    """
    empty = {name for name in names if (folder / name).is_file() and (folder / name).stat().st_size == 0}
    there = [name for name in names if os.path.lexists(folder / name) and name not in empty]
    if not there or MADE.search(_content(folder / README)):
        return
    text = _content(folder / SCENE_FILE)
    try:
        written = bool(text) and toml_bytes(parse_toml(text)).decode() == text
    except ValueError:
        written = False
    foreign = README if README in there else "" if written else SCENE_FILE if SCENE_FILE in there else there[0]
    if foreign:
        what = f"'{foreign}' there is not of this program's making, and would be replaced"
        raise SceneError(f"{folder}: {what}; give another folder, or move it away")


def _holds_our_room(folder: Path, names: Iterable[str]) -> bool:
    """Whether a folder holds a room whose files of these names may be written over."""
    try:
        check_made(folder, names)
    except SceneError:
        return False
    return (folder / SCENE_FILE).is_file()


def _content(path: Path) -> str:
    """Text of a file in a scene's folder before it is written over; empty where there is none to read."""
    try:
        return path.read_bytes().decode(errors="replace")
    except OSError:
        return ""


def tum_bytes(time: Floats, position: Floats, heading: Floats) -> bytes:
    """Path file to write (TUM), `timestamp x y z qx qy qz qw` a line; the quaternion is the heading about z."""
    lines = ["# timestamp x y z qx qy qz qw"]
    for t, point, angle in zip(time, position, heading, strict=True):
        row = [*point, 0.0, 0.0, np.sin(angle / 2.0), np.cos(angle / 2.0)]
        # times may count from the epoch: all digits down to a nanosecond; nine digits of a place are a nanometre
        lines.append(" ".join([repr(round(float(t), 9)).removesuffix(".0"), *(f"{value:.9g}" for value in row)]))
    return ("\n".join(lines) + "\n").encode()


def _write_staged(files: Mapping[str, bytes], staged: Path) -> None:
    """Write a scene's files into a temporary folder, each synchronised with the disk."""
    for name, content in files.items():
        target = staged / name
        target.parent.mkdir(parents=True, exist_ok=True)
        with target.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())


def _publish(staged: Path, folder: Path, files: Mapping[str, bytes]) -> None:
    """Write a scene's folder to its place by one rename of a temporary one, or file by file into one that exists."""
    if not folder.exists():
        staged.chmod(0o755)
        staged.rename(folder)
        return
    for name in files:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (staged / name).replace(folder / name)


def _scene_table(scene: Scene, agent: dict[str, Any]) -> dict[str, Any]:
    """Table of `scene.toml` as it is written for a scene, with the table of its agent."""
    table: dict[str, Any] = {"name": scene.name}
    table["reflector"] = [
        {"name": r.name, "mesh": mesh_file(r.name), "material": _material_table(r.material)} for r in scene.reflectors
    ]
    table["scatterer"] = [_scatterer_table(scatterer) for scatterer in scene.scatterers]
    table["shade"] = [{"name": shade.name, "mesh": mesh_file(shade.name)} for shade in scene.occluders]
    panels = [_panel_table(panel) for panel in scene.panels]
    table["ris"] = panels[0] if len(panels) == 1 else panels
    table["agent"] = agent
    return {key: value for key, value in table.items() if value != []}


def _panel_table(panel: RisPanel) -> dict[str, Any]:
    """Table of `scene.toml` as it is written for a RIS panel."""
    spec, table = panel.spec, {"name": panel.name, "center": panel.center.tolist()}
    table |= {"normal": spec.normal.tolist(), "up": spec.up.tolist()}
    table |= {"rows": spec.rows, "cols": spec.cols, "spacing_m": spec.spacing.tolist()}
    table |= {"levels": spec.levels, "element": spec.element, "amplitude": spec.amplitude}
    return table | ({"host": panel.host} if panel.host else {})


def _scatterer_table(scatterer: Scatterer) -> dict[str, Any]:
    """Table of `scene.toml` as written for a scatterer: a cross-section where shape and law do not give it."""
    radius, table = scatterer.radius, {"name": scatterer.name, "position": scatterer.position.tolist()}
    table |= {"radius": radius} if radius is not None else {}
    if scatterer.height is not None:
        table |= {"height_m": scatterer.height, "axis": scatterer.axis.tolist()}
    if scatterer.law == "mie":
        table["mie"] = True
    elif scatterer.law == "constant" and (
        radius is None or scatterer.height is not None or scatterer.rcs != np.pi * radius**2
    ):
        table["rcs_m2"] = scatterer.rcs
    if scatterer.shade is not None:
        table |= {"shadow": True} if _has_own_shadow(scatterer) else {"mesh": mesh_file(scatterer.name)}
    return table


def _has_own_shadow(scatterer: Scatterer) -> bool:
    """Whether a scatterer's occluder, as the scene is written, is the mesh of its own solid: `shadow = true`."""
    if scatterer.shade is None or scatterer.radius is None:
        return False
    own, shade = solid_mesh(scatterer.position, scatterer.radius, scatterer.height, scatterer.axis), scatterer.shade
    return np.array_equal(own.vertices, shade.vertices) and np.array_equal(own.faces, shade.faces)


def _material_table(material: Material) -> dict[str, Any]:
    """Table of `scene.toml` as it is written for a material."""
    thick = {"thickness_m": material.thickness}
    if material.reflection is not None:
        own: dict[str, Any] = {"reflection": material.reflection}
    elif material.itu is not None:
        own = {"itu": material.itu} | thick
    elif material.reflection_te is not None:
        own = {"reflection_te": material.reflection_te, "reflection_tm": material.reflection_tm}
    else:
        own = {"permittivity": material.permittivity, "conductivity_s_m": material.conductivity} | thick
    return own | ({"scattering": material.scattering} if material.scattering > 0.0 else {})


def _agent_table(agent: Trajectory) -> dict[str, Any]:
    """Table of `scene.toml` as written for the agent: a straight motion by velocity, any other by path file."""
    offsets = {"tx_offset_m": agent.body.tx_offset.tolist(), "rx_offset_m": agent.body.rx_offset.tolist()}
    cycles, velocity = len(agent), agent.velocity[0]
    heading = float(np.arctan2(velocity[1], velocity[0])) if velocity[:2].any() else 0.0
    line = agent.position[0] + agent.time[:, None] * velocity
    steady = agent.time[0] == 0.0 and np.ptp(np.diff(agent.time)) < 1e-9 if cycles > 1 else False
    if steady and np.abs(agent.position - line).max() < 1e-9 and np.abs(agent.heading - heading).max() < 1e-9:
        motion = {"start": agent.position[0].tolist(), "velocity": velocity.tolist(), "cycles": cycles}
        return motion | {"cycle_s": float(agent.time[1])} | offsets
    return {"trajectory": TRAJECTORY_FILE} | offsets
