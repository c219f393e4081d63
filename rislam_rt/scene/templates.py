"""New scene folders from the built-in rooms."""

from pathlib import Path
from textwrap import fill

from rislam_rt.errors import SceneError
from rislam_rt.scene.load import SCENE_FILE
from rislam_rt.scene.meshes import ply_bytes
from rislam_rt.scene.rooms import ROOMS, Room
from rislam_rt.scene.write import toml_bytes, write_files


def new_scene(template: str, folder: str | Path, *, overwrite: bool = False) -> Path:
    """Write one of the built-in rooms into a folder, the same bytes every time. Returns the folder.

    Raises
    ------
    SceneError
        No such template, or the folder exists and `overwrite` is False.
    StoreError
        The disk refused.
    """
    if template not in ROOMS:
        raise SceneError(f"template: '{template}' received; give one of {', '.join(ROOMS)}")
    return write_files(room_files(ROOMS[template]()), folder, overwrite=overwrite)


def room_files(room: Room) -> dict[str, bytes]:
    """The files of a scene folder: relative name -> content."""
    files = {f"meshes/{name}.ply": ply_bytes(mesh.vertices, mesh.faces) for name, mesh in room.meshes.items()}
    name = room.table["name"]
    readme = (
        f"# {name}\n\n{fill(room.readme, 110)}\n\nWritten by `python -m rislam_rt.scene.build {name} --out scenes`.\n"
    )
    return files | room.files | {SCENE_FILE: toml_bytes(room.table), "README.md": readme.encode()}
