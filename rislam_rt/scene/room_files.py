"""A room in the making as the files of its scene folder, and the tables of `scene.toml` that most rooms share."""

from dataclasses import dataclass, field
from textwrap import fill
from typing import Any

from rislam_rt.scene.meshes import Mesh, ply_bytes
from rislam_rt.scene.scene_folder import README, SCENE_FILE, mesh_file
from rislam_rt.toml import toml_bytes

PAPER_MATERIAL = {"reflection": 0.85}
"""Material of the paper's walls, as a table of the scene file."""

CYCLES = {"cycles": 600, "cycle_s": 0.1}
"""Number of cycles and their length in the scene file."""


@dataclass(frozen=True, slots=True, eq=False)
class RoomFiles:
    """A room as the files of its scene folder: table of `scene.toml`, meshes, other files, and README."""

    table: dict[str, Any]
    meshes: dict[str, Mesh]
    readme: str
    files: dict[str, bytes] = field(default_factory=dict)


def reflector(name: str, material: dict[str, Any] | None = None) -> dict[str, Any]:
    """Table for a reflector in the files of a room, with a PLY mesh of its own."""
    return {"name": name, "mesh": mesh_file(name), "material": material or PAPER_MATERIAL}


def panel(
    center: list[float], normal: list[float], up: list[float], host: str = "ceiling", size: int = 6,
    element: str = "tang", spacing: float = 0.015,
) -> dict[str, Any]:  # fmt: skip
    """Table for a RIS panel like the paper's, anywhere, in the files of a room; its elements, too, are the paper's
    (`tang`) or reflect as a perfect plate does (`energy`), and their `spacing` [m] is half a wavelength at 10 GHz."""
    lie = {"center": center, "normal": normal, "up": up, "rows": size, "cols": size, "spacing_m": [spacing, spacing]}
    return lie | {"levels": 4, "element": element, "host": host}


def room_files(room: RoomFiles, origin: str) -> dict[str, bytes]:
    """Files of a new room's scene folder: relative name -> content. `origin` says where the room comes from.

    A file's name in the README that is not text has question marks in place of what is none.
    """
    files = {mesh_file(name): ply_bytes(*mesh) for name, mesh in room.meshes.items()}
    readme = f"# {room.table['name']}\n\n{fill(room.readme, 110)}\n\n{origin}\n"
    return files | room.files | {SCENE_FILE: toml_bytes(room.table), README: readme.encode(errors="replace")}
