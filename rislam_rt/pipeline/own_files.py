"""The files that a method of one's own is made of: its own, and those beside it that it imports."""

import ast
import hashlib
from collections.abc import Iterator
from pathlib import Path


def own_digest(file: Path) -> str:
    """SHA-256 of a file and of all that it imports from its own folder or package, at any remove; of its bytes alone if
    there is nothing of that kind. Installed libraries are no part of it, nor what is imported by a name made up on the
    way."""
    files = sorted(_all_of(file))
    if len(files) == 1:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    root = _root(file)
    parts = [f"{one.relative_to(root)}\0{hashlib.sha256(one.read_bytes()).hexdigest()}\n" for one in files]
    return hashlib.sha256("".join(parts).encode()).hexdigest()


def _all_of(file: Path) -> set[Path]:
    found, left = {file}, [file]
    while left:
        fresh = set(_imported(left.pop())) - found
        found |= fresh
        left += fresh
    return found


def _imported(file: Path) -> Iterator[Path]:
    """Files below the root that a file names in its imports, packages on the way included."""
    root = _root(file)
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):  # whoever imports it says so
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _places(root, alias.name.split("."))
        elif isinstance(node, ast.ImportFrom):
            # level 1 is the file's own folder, each further one the folder above
            folder = file.parents[node.level - 1] if 0 < node.level <= len(file.parents) else root
            for alias in node.names:
                yield from _places(folder, [*(node.module or "").split("."), alias.name])


def _places(folder: Path, names: list[str]) -> Iterator[Path]:
    """The files of a dotted name and of every package on its way, as far as they are there."""
    place = folder
    for name in filter(None, names):
        place = place / name
        for file in (place.with_suffix(".py"), place / "__init__.py"):
            if file.is_file():
                yield file


def _root(file: Path) -> Path:
    """Folder of the outermost package that a file lies in; its own if it lies in none."""
    folder = file.parent
    while (folder / "__init__.py").is_file() and folder != folder.parent:
        folder = folder.parent
    return folder
