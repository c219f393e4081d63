"""Templates of scenes: new scene folders copied from the rooms that come with the package."""

import os
import re
from pathlib import Path

from rislam_rt.errors import SceneError
from rislam_rt.scene.scene_folder import README, SCENE_FILE
from rislam_rt.scene.write import write_files
from rislam_rt.shipped import shipped_missing, shipped_rooms
from rislam_rt.toml import parse_toml, toml_bytes


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
