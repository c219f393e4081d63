"""Shipped pipeline files and scene folders, those that come with the package, found by name."""

import os
import re
from collections import Counter
from collections.abc import Iterable
from itertools import takewhile
from pathlib import Path
from typing import Any

_PACKAGE = Path(__file__).parent
_ROOT = _PACKAGE / "shipped" if (_PACKAGE / "shipped").is_dir() else _PACKAGE.parent
"""Folder of the shipped `pipelines` and `scenes`: inside an installed package, beside the package in a checkout."""


def shipped_pipelines() -> dict[str, Path]:
    """Paths of the pipeline files that come with the package, by name."""
    return {file.stem: file for file in sorted((_ROOT / "pipelines").glob("*.toml"))}


def shipped_rooms() -> dict[str, Path]:
    """Paths of the scene folders that come with the package, by name."""
    return {file.parent.name: file.parent for file in sorted((_ROOT / "scenes").glob("*/scene.toml"))}


def shipped_missing(kind: str) -> str:
    """What a message says where none of the shipped `pipelines` or `scenes` is there: where they were looked for, and
    the mend; empty if there are any."""
    if shipped_pipelines() if kind == "pipelines" else shipped_rooms():
        return ""
    inside, beside = _PACKAGE / "shipped" / kind, _PACKAGE.parent / kind
    place = f"{inside} (of an installed package) and {beside} (of a checkout)"
    return f"the {kind} that come with the package were not found in {place}: install it whole, or copy '{kind}' there"


def is_shipped(pipeline: Path) -> bool:
    """Whether a pipeline file is one of those that come with the package."""
    return pipeline.resolve() in {file.resolve() for file in shipped_pipelines().values()}


def find_pipeline(name: str | Path) -> Path:
    """Path of a pipeline file from a path or a name: the file if there is one, else the pipeline of that name that
    comes with the package."""
    given = Path(os.path.expanduser(name))
    return given if given.is_file() else shipped_pipelines().get(str(name), given)


def find_room(name: str | Path) -> Path:
    """Path of a scene from a path or a name: the file or folder if there is one, else the room of that name that comes
    with the package."""
    given = Path(os.path.expanduser(name))
    return given if given.exists() else shipped_rooms().get(str(name), given)


def room_beside(folder: Path, name: str) -> Path:
    """The scene folder that a pipeline file names: relative to the folder of the file, or the room of that name that
    comes with the package; the folder comes first."""
    given = Path(os.path.normpath(folder / os.path.expanduser(name)))
    return given if given.exists() else shipped_rooms().get(name, given)


def beside_of(folder: Path, value: Any, key: str) -> Any:
    """What a pipeline file in a folder calls what a setting of the command line names, as seen from the working folder:
    shipped scenes and scene folders under the keys `scene` and `scenes`, the folder `results`; other values stay.

    The name of a shipped scene stays as well, where no folder has it: a pipeline file may name it, too. So does a
    path that is there as seen from the file alone, as one copied from it.
    """
    if isinstance(value, list):
        return [beside_of(folder, item, key) for item in value]
    if isinstance(value, dict):
        return {name: beside_of(folder, item, name) for name, item in value.items()}
    if key not in ("scene", "scenes", "results") or not isinstance(value, str) or os.path.isabs(value):
        return value
    if "/" in value and not Path(value).exists() and (folder / value).exists():
        return value
    built_in = None if Path(value).exists() or key == "results" else shipped_rooms().get(value)
    if built_in is None:
        return os.path.relpath(value, folder)
    return value if room_beside(folder, value) == built_in else str(built_in)


def short_names(names: Iterable[str], between: str = os.sep) -> dict[str, str]:
    """Short name of each path of a scene, shipped or not, or of each setting (parts stand with a dot `between` them):
    its last part, and as many before it as tell it from the others."""
    paths = list(dict.fromkeys(names))
    parts = {path: Path(path).parts if between == os.sep else tuple(path.split(between)) for path in paths}
    tails = {path: [between.join(own[-n:]) for n in range(1, len(own) + 1)] for path, own in parts.items()}
    every = Counter(tail for found in tails.values() for tail in found)
    return {path: next((tail for tail in tails[path] if every[tail] == 1), path) for path in paths}


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
