"""From a file to a scene folder, checked before it appears."""

import tempfile
from pathlib import Path

from rislam_rt.errors import SceneError
from rislam_rt.model import RadioConfig
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.importing.draft import RoomDraft, finish_room
from rislam_rt.scene.importing.mesh_room import import_mesh
from rislam_rt.scene.importing.options import ImportOptions
from rislam_rt.scene.load import check_scene
from rislam_rt.scene.templates import room_files, room_name
from rislam_rt.scene.write import write_files


def import_room(file: Path, folder: Path, options: ImportOptions, *, overwrite: bool = False) -> list[str]:
    """Make a scene folder of a mesh file; returns remarks on what became of it.

    The folder appears whole, and only if its check finds no error.

    Raises
    ------
    SceneError
        The file cannot be made a room, or the folder exists.
    StoreError
        The disk refused.
    """
    try:
        draft = import_mesh(file, options)
        return write_room(draft, folder, f"Made from `{file.name}`.", options, overwrite=overwrite)
    except Fault as fault:
        raise SceneError(f"{file}: {fault}") from None


def write_room(
    draft: RoomDraft, folder: Path, origin: str, options: ImportOptions, *, overwrite: bool = False
) -> list[str]:
    """Write a draft as a scene folder if its check finds no error; returns its remarks.

    Raises
    ------
    Fault
        There is no place for an agent, or the check finds an error.
    """
    room, remarks = finish_room(draft, room_name(folder, "room"), origin)
    files = room_files(room, "Made by `rislam-rt new --from`: start, way and panel are proposals.")
    with tempfile.TemporaryDirectory() as place:
        trial = write_files(files, Path(place) / "room")
        carrier = 1e9 * options.carrier_ghz
        errors = [f for f in check_scene(trial, RadioConfig(carrier=carrier, bandwidth=min(1e9, carrier)))
                  if f.severity == "error"]  # fmt: skip
    if errors:
        raise Fault(f"the room would not pass its check: {errors[0].field}: {errors[0].message}", errors[0].mend)
    write_files(files, folder, overwrite=overwrite)
    return remarks
