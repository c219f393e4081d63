"""Shipped pipeline files and scene folders, those that come with the package, found by name."""

import os
import re
from itertools import takewhile
from pathlib import Path

_PACKAGE = Path(__file__).parent
_ROOT = _PACKAGE / "shipped" if (_PACKAGE / "shipped").is_dir() else _PACKAGE.parent
"""Folder of the shipped `pipelines` and `scenes`: inside an installed package, beside the package in a checkout."""


def shipped_pipelines() -> dict[str, Path]:
    """Paths of the pipeline files that come with the package, by name."""
    return {file.stem: file for file in sorted((_ROOT / "pipelines").glob("*.toml"))}


def shipped_rooms() -> dict[str, Path]:
    """Paths of the scene folders that come with the package, by name."""
    return {file.parent.name: file.parent for file in sorted((_ROOT / "scenes").glob("*/scene.toml"))}


def find_pipeline(name: str | Path) -> Path:
    """Path of a pipeline file from a path or a name: the file if there is one, else the pipeline of that name that
    comes with the package."""
    given = Path(name)
    return given if given.is_file() else shipped_pipelines().get(str(name), given)


def find_room(name: str | Path) -> Path:
    """Path of a scene from a path or a name: the file or folder if there is one, else the room of that name that comes
    with the package."""
    given = Path(name)
    return given if given.exists() else shipped_rooms().get(str(name), given)


def room_beside(folder: Path, name: str) -> Path:
    """The scene folder that a pipeline file names: relative to the folder of the file, or the room of that name that
    comes with the package; the folder comes first."""
    given = Path(os.path.normpath(folder / name))
    return given if given.exists() else shipped_rooms().get(name, given)


def name_from_here(folder: Path) -> str:
    """What a pipeline file in the working folder calls a shipped scene (its name) or a folder (the way there)."""
    built_in = shipped_rooms().get(folder.name)
    if built_in is not None and folder.resolve() == built_in.resolve() and not Path(folder.name).exists():
        return folder.name
    return os.path.relpath(folder)


def first_sentence(pipeline: Path) -> str:
    """Description of a shipped pipeline file: the first sentence of its leading comment."""
    lines = takewhile(lambda line: line.startswith("#"), pipeline.read_text(encoding="utf-8").splitlines())
    return re.split(r"(?<=(?<!Fig)\.) ", " ".join(line.removeprefix("#").strip() for line in lines))[0]
