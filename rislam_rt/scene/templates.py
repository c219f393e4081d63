"""New scene folders from the built-in rooms."""

import re
from dataclasses import replace
from pathlib import Path
from textwrap import fill

from rislam_rt.errors import SceneError
from rislam_rt.scene.built_in_rooms import ROOMS, RoomFiles
from rislam_rt.scene.load import SCENE_FILE
from rislam_rt.scene.meshes import ply_bytes
from rislam_rt.scene.write import write_files
from rislam_rt.toml import toml_bytes


def new_scene(template: str, folder: str | Path, *, overwrite: bool = False) -> Path:
    """Write one of the built-in rooms into a folder, the same bytes every time, named after it. Returns the folder.

    Raises
    ------
    SceneError
        No such template, or the folder exists and `overwrite` is False.
    StoreError
        The disk refused.
    """
    if template not in ROOMS:
        raise SceneError(f"template: '{template}' received; give one of {', '.join(ROOMS)}")
    room = ROOMS[template]()
    named = replace(room, table={**room.table, "name": room_name(Path(folder), template)})
    origin = f"Made by `rislam-rt new --template {template}`."
    return write_files(room_files(named, origin), folder, overwrite=overwrite)


def room_name(folder: Path, template: str) -> str:
    """What a room is called that lies in a folder: the folder's name, with what a room's name cannot hold as `_`."""
    name = re.sub(r"[^A-Za-z0-9_.\-]", "_", folder.resolve().name)[:64]
    return name if name.strip("._-") else template


def room_files(room: RoomFiles, origin: str = "") -> dict[str, bytes]:
    """The files of a scene folder: relative name -> content. `origin`: where it comes from, if not from the build."""
    files = {f"meshes/{name}.ply": ply_bytes(mesh.vertices, mesh.faces) for name, mesh in room.meshes.items()}
    name = room.table["name"]
    origin = origin or f"Written by `python -m rislam_rt.scene.build {name} --out scenes`."
    readme = f"# {name}\n\n{fill(room.readme, 110)}\n\n{origin}\n"
    return files | room.files | {SCENE_FILE: toml_bytes(room.table), "README.md": readme.encode()}
