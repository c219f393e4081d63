"""The shipped pipelines and rooms, which come with the package, by name."""

import os
import re
from collections.abc import Iterator
from pathlib import Path

_PACKAGE = Path(__file__).parent
_ROOT = _PACKAGE / "shipped" if (_PACKAGE / "shipped").is_dir() else _PACKAGE.parent
"""An installed package carries them; in a checkout they stand beside it."""


def shipped_pipelines() -> dict[str, Path]:
    """Shipped pipeline files by name."""
    return {file.stem: file for file in sorted((_ROOT / "pipelines").glob("*.toml"))}


def shipped_rooms() -> dict[str, Path]:
    """Shipped scene folders by name."""
    return {file.parent.name: file.parent for file in sorted((_ROOT / "scenes").glob("*/scene.toml"))}


def find_pipeline(name: str | Path) -> Path:
    """A file as it is given, or the pipeline of that name that comes with the package; the file comes first."""
    given = Path(name)
    return given if given.is_file() else shipped_pipelines().get(str(name), given)


def find_room(name: str | Path) -> Path:
    """A scene folder as it is given, or the room of that name that comes with the package; the folder comes first."""
    given = Path(name)
    return given if given.exists() else shipped_rooms().get(str(name), given)


def room_beside(folder: Path, name: str) -> Path:
    """The scene folder that a pipeline file names: relative to the folder of the file, or the room of that name that
    comes with the package; the folder comes first."""
    given = Path(os.path.normpath(folder / name))
    return given if given.exists() else shipped_rooms().get(name, given)


def name_from_here(folder: Path) -> str:
    """What a pipeline file in the working folder calls a scene folder: a built-in room's name, or the way there."""
    built_in = shipped_rooms().get(folder.name)
    if built_in is not None and folder.resolve() == built_in.resolve() and not Path(folder.name).exists():
        return folder.name
    return os.path.relpath(folder)


def first_sentence(pipeline: Path) -> str:
    """What a pipeline file says of itself: its leading comment, up to the first full stop."""
    return re.split(r"(?<=(?<!Fig)\.) ", " ".join(_leading_comment(pipeline)))[0]


def _leading_comment(file: Path) -> Iterator[str]:
    for line in file.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            return
        yield line.removeprefix("#").strip()
