"""Source files that a user's own methods are made of: their digests, and the copies that a run's folder holds."""

import ast
import csv
import hashlib
import importlib
import os
import sys
import zipimport
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib.machinery import ModuleSpec
from pathlib import Path
from sysconfig import get_path
from typing import Any, NamedTuple

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline.own_methods import defining_module, is_entry_point, is_own, module_of, place_of, text_of

PACKAGE = Path(__file__).parents[1]
"""Folder of this package."""
INSTALLED = {PACKAGE, Path(get_path("stdlib"))}
"""Folders of this package and of Python, whose files are no file of a user's own."""
SITES = ("site-packages", "dist-packages")
"""Names of folders of installed libraries, wherever they are."""
LARGEST = 1_000_000
"""Most bytes of a file of a user's own that is copied to a run's folder."""


class OwnFile(NamedTuple):
    """Source file of a user's own method: where it is, what it holds, and whether it is an installed package's."""

    file: Path
    content: bytes
    installed: bool


_hashed: dict[tuple[str, str], dict[str, OwnFile]] = {}
"""Files of a user's own methods by name and digest, as this process has found them: a run's copies are of these."""


def own_digests(names: Iterable[str]) -> dict[str, str]:
    """SHA-256 of the source files of each of `names` that is a user's own method, by name; empty if it has no file.

    They are those of the named module, of the module that the method is written in, and all that these import of the
    user's own: a run's numbers depend on them.

    Raises
    ------
    ConfigError
        The module is in an archive, so that no file can be looked at.
    """
    files = {name: _files(name) for name in sorted(set(names)) if is_own(name)}
    digests = {name: own_digest(found) for name, found in files.items()}
    _hashed.update(((name, digest), files[name]) for name, digest in digests.items())
    return digests


def own_digest(files: Mapping[str, OwnFile]) -> str:
    """SHA-256 of a user's own files, given by path relative to the folder of import; of its bytes for one file."""
    digests = [(place, hashlib.sha256(file.content).hexdigest()) for place, file in sorted(files.items())]
    if len(digests) < 2:
        return digests[0][1] if digests else ""
    return hashlib.sha256("".join(f"{place}\0{digest}\n" for place, digest in digests).encode()).hexdigest()


def own_sources(digests: Mapping[str, str]) -> dict[str, bytes]:
    """Source files of a user's own methods, given by name with their `own_digests`, and of all that these count.

    Content by path, relative to the folder from which they are imported. Left out are installed ones, those of more
    than `LARGEST` bytes, and files that have changed since: they are not what has run.
    """
    methods = [item for item in digests.items() if item[1] and not is_entry_point(item[0])]
    if unknown := [name for name, digest in methods if (name, digest) not in _hashed]:
        own_digests(unknown)
    found = _copied(_hashed.get(method, {}) for method in methods)
    same = {path: file.content for path, file in found.items() if _content(file.file) == file.content}
    return {path: content for path, content in same.items() if len(content) <= LARGEST}


def large_sources(names: Iterable[str]) -> list[str]:
    """A line for each file of a user's own methods that is too large to be copied to a run's folder."""
    own = [_files(name) for name in sorted(set(names)) if is_own(name) and not is_entry_point(name)]
    return [
        f"{path}: {len(file.content) / 1e6:.1f} MB, and a run's folder holds copies of at most {LARGEST / 1e6:g} MB; "
        "keep it to repeat the run"
        for path, file in _copied(own).items()
        if len(file.content) > LARGEST
    ]


def _copied(methods: Iterable[Mapping[str, OwnFile]]) -> dict[str, OwnFile]:
    """Files of a user's own methods that a run's folder is to hold, by path."""
    return {path: file for files in methods for path, file in files.items() if not file.installed}


def _files(name: str) -> dict[str, OwnFile]:
    """All files that a user's own method is made of, by path relative to the folder of their import.

    Those of a library's class or function that it is an object of do not count.
    """
    defining, place = defining_module(name), place_of(name)
    named = module_of(name)
    if isinstance(_attribute(named, "__loader__"), zipimport.zipimporter):
        at = text_of(named, "__file__")
        raise ConfigError(f"'{name}': {at} is in an archive, where no file can be looked at; unpack it")
    importlib.invalidate_caches()
    found: dict[str, OwnFile] = {}
    # a module may put another object in its place
    at = text_of(named, "__file__")
    file = Path(at) if at else dict(_modules(place)).get(place)
    if file is not None:
        found |= imported_files(place, file)
    at = text_of(defining, "__file__")
    if at and defining is not named and not _is_installed(Path(at)):
        found |= imported_files(text_of(defining, "__name__"), Path(at))
    return found


def _attribute(module: Any, name: str) -> Any:
    """Attribute of a module that a user's own method is in; None if it has none, or raises anything for it."""
    with suppress(Exception):
        return getattr(module, name)
    return None


def _content(file: Path) -> bytes | None:
    """What a file of a user's own holds; None if it cannot be read."""
    with suppress(OSError):
        return file.read_bytes()
    return None


def imported_files(name: str, file: Path) -> dict[str, OwnFile]:
    """A user's own module, given by its dotted name and file, and all of their own that it imports, directly or not.

    By path relative to the folder of their import. The `__init__.py` of packages that they are in count: importing runs
    them. Of an installed module the files of its distribution count, and no library beside it. What is imported by
    names that are computed at run time is not seen, and what cannot be read is left out.
    """
    installed = _is_installed(file)
    mine = _distribution_files(name, file) if installed else None
    files: dict[str, OwnFile] = {}
    left = [(name, file)]
    while left:
        name, file = left.pop()
        is_package = _is_package(file)
        place = f"{name.replace('.', '/')}{'/__init__' if is_package else ''}{file.suffix}"
        if place in files or (_is_installed(file) if mine is None else file.resolve() not in mine):
            continue
        content = _content(file)
        if content is None:
            continue
        files[place] = OwnFile(file, content, installed)
        package = name if is_package else name.rpartition(".")[0]
        for wanted in (package, *_imported_names(content, package)):
            left += _modules(wanted)
    return files


def _is_package(file: Path) -> bool:
    """Whether a file of a user's own is what runs when its package is imported, compiled or not."""
    return file.name.partition(".")[0] == "__init__"


@cache
def _imported_names(content: bytes, package: str) -> list[str]:
    """Dotted names that a user's own file, in a package, imports; the last part may be no module, or `*`."""
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # whoever imports it says so
        return []
    names = []
    for node in _statements(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            # level 1 is the file's own package, each further one the package above
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            whole = [*above, *filter(None, [node.module])]
            names += [".".join([*whole, alias.name]) for alias in node.names]
    return list(dict.fromkeys(name for name in names if name.partition(".")[0] != PACKAGE.name))


def _statements(tree: ast.AST) -> Iterator[ast.AST]:
    """All statements of a user's own file, in whatever block they stand."""
    left = [tree]
    while left:
        for node in ast.iter_child_nodes(left.pop()):
            if isinstance(node, ast.stmt | ast.excepthandler | ast.match_case):
                yield node
                left.append(node)


def _modules(wanted: str) -> Iterator[tuple[str, Path]]:
    """Names and files of the module of a dotted name in a user's own method, and of every package on the way."""
    path: list[str] | None = None
    name = ""
    for part in filter(None, wanted.split(".")):
        if part == "*":  # the package may name any of its modules
            for one in sorted({one.stem for folder in path or () for one in Path(folder).glob("[!_]*.py")}):
                yield from _modules(f"{name}.{one}")
            return
        name = f"{name}.{part}" if name else part
        spec = _spec(name, path)
        if spec is not None and spec.has_location and spec.origin:
            yield name, Path(spec.origin)
        folders = _attribute(sys.modules.get(name), "__path__") or (spec and spec.submodule_search_locations)
        if not folders and path:  # a namespace within one, which nothing has imported yet
            folders = [folder for one in path if os.path.isdir(folder := os.path.join(one, part))]
        if not folders:
            return
        try:
            path = list(map(str, folders))
        except Exception:  # an object in a module's place may give anything for a path
            return


def _spec(name: str, path: list[str] | None) -> ModuleSpec | None:
    """How Python has imported a module that a user's own method names, or would: nothing is imported."""
    spec = _attribute(sys.modules.get(name), "__spec__")
    for finder in () if isinstance(spec, ModuleSpec) else sys.meta_path:
        with suppress(Exception):  # a finder of any package may be among them
            spec = finder.find_spec(name, path, None)
            if isinstance(spec, ModuleSpec):
                break
    return spec if isinstance(spec, ModuleSpec) else None


def _is_installed(file: Path) -> bool:
    """Whether a file, or what it links to, is of this package, of Python or of an installed library."""
    installed = {one for folder in INSTALLED for one in (folder, folder.resolve())}
    with suppress(OSError, RuntimeError):  # links in a circle
        file = file.absolute()
        return any(one in installed or one.name in SITES for one in (*file.parents, *file.resolve().parents))
    return True


def _distribution_files(name: str, file: Path) -> set[Path]:
    """Files of the distribution that an installed module of a user's own is in; of its package if none names it."""
    root = file.parents[name.count(".") + _is_package(file)]
    place = file.relative_to(root)
    for record in sorted(root.glob("*.dist-info/RECORD")):
        with suppress(OSError, csv.Error):
            text = record.read_text(encoding="utf-8", errors="replace")
            places = {row[0] for row in csv.reader(text.splitlines()) if row} if place.as_posix() in text else set()
            if place.as_posix() in places:
                return {(root / one).resolve() for one in places}
    own = root / place.parts[0]
    whole = own.rglob("*") if own.is_dir() else ()
    return {file.resolve(), *(one.resolve() for one in whole if "__pycache__" not in one.parts)}
