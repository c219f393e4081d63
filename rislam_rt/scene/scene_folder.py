"""Files of a scene folder: the scene file, reading those that it names, none outside and none too large, and the file
names of its meshes, which walls and scatterers give.
"""

import hashlib
import os
import re
import unicodedata
from pathlib import Path, PurePosixPath

from rislam_rt.input_messages import did_you_mean, nearest
from rislam_rt.scene.findings import Fault, one_line
from rislam_rt.shipped import find_room

SCENE_FILE = "scene.toml"
"""Name of the scene file in a scene folder."""
README = "README.md"
"""Name of the file in a scene folder that says where the room comes from."""

BELOW = "give a relative path below it, with / between folders"
"""How to mend the path of a scene's file; a backslash in quotes is no separator, and often another character."""


def scene_file(path: str | Path) -> Path:
    """Path of the scene file in a scene folder, given by the folder, the file itself or the name of a built-in room."""
    path = find_room(path)
    return path if path.suffix == ".toml" and not path.is_dir() else path / SCENE_FILE


def read_inside(folder: Path, name: str, limit: int) -> bytes:
    """Read a file that a scene names, which must lie inside the scene's folder, links followed.

    Raises
    ------
    Fault
        The name leaves the folder, or the file is missing, too large or unreadable.
    """
    relative = PurePosixPath(name)
    if not name or relative.is_absolute() or ".." in relative.parts or "\\" in name or not name.isprintable():
        raise Fault(f"'{one_line(name)[:80]}' does not stay inside the scene's folder", BELOW)
    path = folder / relative
    try:
        if not path.resolve().is_relative_to(folder.resolve()):
            raise Fault(f"'{name[:80]}' leads out of the scene's folder by a link", "copy the file into the folder")
        if not path.is_file():
            kind = "is not a file" if path.exists() else "does not exist"
            beside = {str(relative.parent / one.name) for one in path.parent.glob("*")} - {str(relative)}
            hint = did_you_mean(nearest(str(relative), sorted(beside)))
            raise Fault(f"'{name[:80]}' {kind}", f"{hint} put the file there or mend the path".lstrip())
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            content = file.read(limit + 1) if size <= limit else b""
    except (OSError, ValueError, RuntimeError) as error:
        cause = one_line(getattr(error, "strerror", None) or str(error))[:60]
        raise Fault(f"'{name[:80]}' cannot be read ({cause})", "check the file and its permissions") from None
    if max(size, len(content)) > limit:
        raise Fault(f"'{name[:80]}' is larger than {limit} bytes", "give a smaller file")
    return content


PLAIN = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.\-]*")
"""Names that every file system takes."""


def safe_name(name: str) -> str:
    """File name for a name in any script: the name itself if every file system takes it, else its plain letters with a
    hash that tells it from others.

    >>> safe_name("wall_x0"), safe_name("Wände")
    ('wall_x0', 'Wande-8cc563f3')
    """
    if PLAIN.fullmatch(name) and not name.endswith("."):
        return name
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", plain).strip("_")
    return f"{plain or 'name'}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def mesh_file(name: str) -> str:
    """Relative path in a scene folder of the PLY file of a reflector's or occluder's mesh."""
    return f"meshes/{safe_name(name)}.ply"
