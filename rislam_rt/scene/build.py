"""Build the rooms under `scenes/` (and new ones from them): `python -m rislam_rt.scene.build NAME --out DIR`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rislam_rt.errors import RislamError, SceneError
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
    readme = f"# {name}\n\n{room.readme}\n\nWritten by `python -m rislam_rt.scene.build {name} --out scenes`.\n"
    return files | room.files | {SCENE_FILE: toml_bytes(room.table), "README.md": readme.encode()}


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the named rooms, or all of them, each into its folder below `--out`; returns the exit code."""
    parser = argparse.ArgumentParser(prog="rislam_rt.scene.build", description="Write the built-in rooms.")
    parser.add_argument("name", nargs="+", help=f"'all', or of: {', '.join(ROOMS)}")
    parser.add_argument("--out", type=Path, default=Path("scenes"), help="folder that holds the rooms' folders")
    parser.add_argument("--overwrite", action="store_true", help="replace the files of folders that exist")
    options = parser.parse_args(arguments)
    try:
        for name in list(ROOMS) if options.name == ["all"] else options.name:
            print(new_scene(name, options.out / name, overwrite=options.overwrite))
    except RislamError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
