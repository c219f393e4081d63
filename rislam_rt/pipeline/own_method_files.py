"""Source files that a user's own methods are made of: their digests, and the copies that a run's folder holds."""

import ast
import csv
import hashlib
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from sysconfig import get_path
from types import ModuleType

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline.own_methods import defining_module, is_entry_point, is_own, module_of

PACKAGE = Path(__file__).parents[1]
"""Folder of this package."""
INSTALLED = {PACKAGE, Path(get_path("stdlib"))}
"""Folders of this package and of Python, whose files are no file of a user's own."""
SITES = ("site-packages", "dist-packages")
"""Names of folders of installed libraries, wherever they are."""
LARGEST = 1_000_000
"""Most bytes of a file of a user's own that is copied to a run's folder."""


def own_digests(names: Iterable[str]) -> dict[str, str]:
    """SHA-256 of the source files of each of `names` that is a user's own method, by name; empty if it has no file.

    They are those of the named module, of the module that the method is written in, and all that these import of the
    user's own: a run's numbers depend on them.

    Raises
    ------
    ConfigError
        The module is in an archive, so that no file can be looked at.
    """
    return {name: own_digest(_files(name)) for name in sorted(set(names)) if is_own(name)}


def own_digest(files: Mapping[str, Path]) -> str:
    """SHA-256 of a user's own files, given by path relative to the folder of import; of its bytes for one file."""
    digests = [(place, hashlib.sha256(file.read_bytes()).hexdigest()) for place, file in sorted(files.items())]
    if len(digests) < 2:
        return digests[0][1] if digests else ""
    return hashlib.sha256("".join(f"{place}\0{digest}\n" for place, digest in digests).encode()).hexdigest()


def own_sources(digests: Mapping[str, str]) -> dict[str, bytes]:
    """Source files of a user's own methods, given by name with their `own_digests`, and of all that these count.

    Content by path, relative to the folder from which they are imported. Left out are installed ones, those of more
    than `LARGEST` bytes, and files that have changed since: they are not what has run.
    """
    same = [name for name, digest in digests.items() if digest and own_digests([name]).get(name) == digest]
    return {path: file.read_bytes() for path, file in _copied(same).items() if file.stat().st_size <= LARGEST}


def large_sources(names: Iterable[str]) -> list[str]:
    """A line for each file of a user's own methods that is too large to be copied to a run's folder."""
    return [
        f"{path}: {file.stat().st_size / 1e6:.1f} MB, and a run's folder holds copies of at most {LARGEST / 1e6:g} MB; "
        "keep it to repeat the run"
        for path, file in _copied(name for name in sorted(set(names)) if is_own(name)).items()
        if file.stat().st_size > LARGEST
    ]


def _copied(names: Iterable[str]) -> dict[str, Path]:
    """Files of a user's own methods that a run's folder is to hold, by path relative to the folder of their import."""
    found: dict[str, Path] = {}
    for name in names:
        if not is_entry_point(name):  # found by its name where its package is installed, not by its files
            found = {place: file for place, file in _files(name).items() if not _is_installed(file)} | found
    return found


def _files(name: str) -> dict[str, Path]:
    """All files that a user's own method is made of, by path relative to the folder of their import."""
    modules = [module_of(name), defining_module(name)]
    found: dict[str, Path] = {}
    for module in modules:
        file = Path(getattr(module, "__file__", None) or "")
        if module is None or file == Path():
            continue
        if not file.is_file():
            raise ConfigError(f"'{name}': {file} is no file that can be looked at; unpack the archive that it is in")
        found = imported_files(file, _import_folder(module, file)) | found
    return found


def _import_folder(module: ModuleType, file: Path) -> Path:
    """Folder from which the module of a user's own method is imported, by its dotted name."""
    parts = module.__name__.count(".") + (file.stem == "__init__")
    return file.parents[min(parts, len(file.parents) - 1)]


def imported_files(file: Path, root: Path) -> dict[str, Path]:
    """A user's own Python file, imported from folder `root`, and all of their own that it imports, directly or not.

    By path relative to the folder of their import. The `__init__.py` of packages that they are in count: importing runs
    them. Of an installed file those of its distribution count, and no library beside it; what is imported by names that
    are computed at run time is not seen.
    """
    installed = _is_installed(file)
    mine = _distribution_files(file, root) if installed else None
    folders = [root] if installed else [*_own_folders(), root]
    place = file.relative_to(root).as_posix()
    files, left = {place: file}, [place]
    while left:
        place = left.pop()
        for start, one in _imported(place, files[place], folders):
            where = one.relative_to(start).as_posix()
            if where not in files and (mine is None or one.resolve() in mine):
                files[where] = one
                left.append(where)
    return files


def _imported(place: str, file: Path, folders: list[Path]) -> Iterator[tuple[Path, Path]]:
    """Files that a file at `place` imports, with the folder of their import, those of the packages it is in first."""
    root = file.parents[place.count("/")]
    package = place.split("/")[:-1]
    yield from _modules([root], package)
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):  # whoever imports it says so
        return
    for node in _statements(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _modules(folders, alias.name.split("."))
        elif isinstance(node, ast.ImportFrom):
            # level 1 is the file's own package, each further one the package above
            above = package[: len(package) - node.level + 1] if node.level else []
            for alias in node.names:
                names = [*above, *filter(None, (node.module or "").split(".")), alias.name]
                yield from _modules([root] if node.level else folders, names)


def _statements(tree: ast.AST) -> Iterator[ast.AST]:
    """All statements of a user's own file, in whatever block they stand."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.stmt | ast.excepthandler | ast.match_case):
            yield node
            yield from _statements(node)


def _modules(folders: list[Path], names: list[str]) -> Iterator[tuple[Path, Path]]:
    """Python files of a dotted name in a user's own method, and of every package on the way, in the first of the
    folders that has the first of its names."""
    if not names or names[0] == PACKAGE.name:
        return
    heads = [(one / names[0], one) for one in folders]
    # as Python: a package or module in any folder before a folder that is no package
    found = [one for head, one in heads if (head / "__init__.py").is_file() or head.with_suffix(".py").is_file()]
    found += [one for head, one in heads if head.is_dir()]
    place = root = next(iter(found), Path())
    for name in names if found else []:
        place = place / name
        for file in (place.with_suffix(".py"), place / "__init__.py"):
            if file.is_file():
                yield root, file


def _is_installed(file: Path) -> bool:
    """Whether a file is of this package, of Python or of an installed library, and not a user's own."""
    parents, installed = file.resolve().parents, {folder.resolve() for folder in INSTALLED}
    return any(one in installed or one.name in SITES for one in parents)


def _own_folders() -> list[Path]:
    """Folders in which Python looks for modules of a user's own, the first one first."""
    folders = [Path(one).resolve() for one in sys.path]
    return [folder for folder in folders if not _is_installed(folder / "module.py")]


def _distribution_files(file: Path, root: Path) -> set[Path]:
    """Files of the distribution that an installed file of a user's own is in; of its package alone if none names it."""
    place = file.relative_to(root)
    for record in sorted(root.glob("*.dist-info/RECORD")):
        text = record.read_text(encoding="utf-8", errors="replace")
        places = {row[0] for row in csv.reader(text.splitlines()) if row} if place.as_posix() in text else set()
        if place.as_posix() in places:
            return {(root / one).resolve() for one in places}
    own = root / place.parts[0]
    return {one.resolve() for one in own.rglob("*.py")} if own.is_dir() else {file.resolve()}
