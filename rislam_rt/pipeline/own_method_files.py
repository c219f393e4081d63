"""Source files that a user's own method consists of (its own file and those of its package that it imports), and their
digest."""

import ast
import hashlib
from collections.abc import Iterator
from pathlib import Path


def own_digest(file: Path) -> str:
    """SHA-256 of a Python file and of all that it imports, directly or not, from its own folder or package.

    Of its bytes alone if there is nothing of that kind. Installed libraries are left out, as are imports by names that
    are computed at run time.
    """
    files = sorted(_all_of(file))
    if len(files) == 1:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    root = _root(file)
    parts = [f"{one.relative_to(root)}\0{hashlib.sha256(one.read_bytes()).hexdigest()}\n" for one in files]
    return hashlib.sha256("".join(parts).encode()).hexdigest()


def _all_of(file: Path) -> set[Path]:
    """A Python file and all files that it imports, directly or not, from its own folder or package."""
    found, left = {file}, [file]
    while left:
        fresh = set(_imported(left.pop())) - found
        found |= fresh
        left += fresh
    return found


def _imported(file: Path) -> Iterator[Path]:
    """Files of the same folder or package that a Python file imports, `__init__.py` of packages included."""
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
    """Existing Python files of a dotted module name, and of every package that it names on the way."""
    place = folder
    for name in filter(None, names):
        place = place / name
        for file in (place.with_suffix(".py"), place / "__init__.py"):
            if file.is_file():
                yield file


def _root(file: Path) -> Path:
    """Folder that contains the outermost package that a Python file belongs to; the file's folder if it is in none."""
    folder = file.parent
    while (folder / "__init__.py").is_file() and folder != folder.parent:
        folder = folder.parent
    return folder
