"""A user's own methods: a code designer, an estimator or a channel from a file or an installed package, by name.

A name is `module:attribute`, as `mine:my_designer` for a function in `mine.py`, or the name of an entry point of one of
`GROUPS`. The command line looks for modules beside the pipeline file and in the working folder too.
"""

import ast
import hashlib
import inspect
import re
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from site import getusersitepackages
from sysconfig import get_path
from typing import Any

import numpy as np

from rislam_rt.errors import ConfigError, RislamError, expect
from rislam_rt.model import DataSheet, Paths, RadioConfig, RisCode, Scene, SlamEstimate, Trajectory

GROUPS = ("rislam_rt.schemes", "rislam_rt.designers", "rislam_rt.estimators", "rislam_rt.channels")
"""Entry point groups under which an installed package offers schemes, designers, estimators and channels."""
INSTALLED = {
    Path(__file__).parents[1], Path(getusersitepackages()), *map(Path, map(get_path, ("stdlib", "purelib", "platlib"))),
}  # fmt: skip
"""Folders of this package, of Python and of installed libraries, whose files are no file of a user's own."""
LARGEST = 1_000_000
"""Most bytes of a file of a user's own that is copied to a run's folder."""
_FORM = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


@cache
def load_own(name: str) -> Any:
    """Import a user's own designer, estimator, channel or scheme by name; a class is returned as such.

    Raises
    ------
    ConfigError
        There is nothing of that name, or it cannot be imported.
    """
    if not _FORM.fullmatch(name):
        return _entry_point(name)
    place, _, attribute = name.partition(":")
    try:
        module = import_module(place)
    except ModuleNotFoundError as error:
        absent = f"{place}.".startswith(f"{error.name}.")  # it, or the folder or package that it is to be in
        what = f"no module '{place}'" if absent else f"module '{place}' needs '{error.name}'"
        file = f"{place.replace('.', '/')}.py"
        raise ConfigError(f"'{name}': {what}; put {file} beside the pipeline file, or install it") from None
    except (Exception, SystemExit) as error:  # a user's file may raise anything while it is read
        raise ConfigError(f"'{name}': {place} cannot be loaded ({type(error).__name__}: {error}); mend it") from None
    if not hasattr(module, attribute):
        where = f" ({module.__file__})" if getattr(module, "__file__", None) else ""
        raise ConfigError(f"'{name}': module '{place}'{where} has no '{attribute}'; mend either name")
    return _made(name, getattr(module, attribute))


def fresh_own(name: str) -> Any:
    """A user's own designer or estimator, ready to be called; a class is instantiated each time, so that what an object
    of it remembers of one run is not there in the next.

    Raises
    ------
    ConfigError
        There is nothing of that name, it cannot be imported, or the class cannot be instantiated.
    """
    found = load_own(name)
    return _instance(name, found) if inspect.isclass(found) else found


@contextmanager
def own_method_errors(name: str) -> Iterator[None]:
    """Turn whatever a user's own method raises within this context into a one-line error that names file and line.

    Raises
    ------
    ConfigError
        The method raised.
    """
    try:
        yield
    except RislamError as error:  # ours, from what the method gave us
        if str(error).startswith(f"'{name}'"):
            raise
        raise ConfigError(f"'{name}': {error}") from error
    except (Exception, SystemExit) as error:  # a user's method may raise anything
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in frames if frame.filename == _file(load_own(name))]
        where = f" in line {own[-1].lineno} of {own[-1].filename}" if own else ""
        cause = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise ConfigError(f"'{name}': raised {cause}{where}; mend it") from error


def is_own(name: str) -> bool:
    """Whether a name has the form of a user's own method (`module:attribute`), or is that of an entry point."""
    return bool(_FORM.fullmatch(name)) or name in _offered()


def own_digests(names: Iterable[str]) -> dict[str, str]:
    """SHA-256 of the source files of each of `names` that is a user's own method, by name; empty if it has no file.

    Files of its own package that it imports are part of it: a run's numbers depend on them.
    """
    files = {name: _file(load_own(name)) for name in sorted(set(names)) if is_own(name)}
    return {name: own_digest(Path(file)) if file else "" for name, file in files.items()}


def own_sources(digests: Mapping[str, str]) -> dict[str, bytes]:
    """Source files of a user's own methods, given by name with their `own_digests`, and of all that these count.

    Content by path, relative to the folder from which they are imported; of two of one path, that which Python finds.

    Left out are installed ones, those of more than `LARGEST` bytes, and files that have changed since: they are not
    what has run.
    """
    same = [
        name for name, digest in digests.items()
        if digest and _FORM.fullmatch(name) and own_digest(Path(_file(load_own(name)) or "")) == digest
    ]  # fmt: skip
    return {path: file.read_bytes() for path, file in _copied(same).items() if file.stat().st_size <= LARGEST}


def large_sources(names: Iterable[str]) -> list[str]:
    """A line for each file of a user's own methods that is too large to be copied to a run's folder."""
    copied = _copied(name for name in sorted(set(names)) if _FORM.fullmatch(name))
    return [
        f"{path}: {file.stat().st_size / 1e6:.1f} MB, and a run's folder holds copies of at most {LARGEST / 1e6:g} MB; "
        "keep it to repeat the run"
        for path, file in copied.items()
        if file.stat().st_size > LARGEST
    ]


def _copied(names: Iterable[str]) -> dict[str, Path]:
    """Files of a user's own methods that a run's folder is to hold, by path relative to the folder of their import."""
    found: dict[str, Path] = {}
    installed = _installed()
    path = [folder for folder in _import_path() if folder not in installed]
    for name in names:
        named = Path(import_module(name.partition(":")[0]).__file__ or "")  # it may import what it names
        for file in (named, Path(_file(load_own(name)) or "")):
            if file.is_file() and INSTALLED.isdisjoint(file.parents):
                root = _root(file)
                packages = {folder / "__init__.py" for folder in file.parents if root in folder.parents}
                for one in sorted(_closure(file) | {one for one in packages if one.is_file()}):
                    place = one.relative_to(root).as_posix()
                    first = next((folder / place for folder in path if (folder / place).is_file()), one)
                    found[place] = first
    return found


def own_code(
    name: str, belief: SlamEstimate, panel: DataSheet, radio: RadioConfig, *, rng: np.random.Generator,
    designer: Callable[..., Any] | None = None,
) -> RisCode:  # fmt: skip
    """Phase code that a user's own designer returns for a belief, checked; `designer` is the object made of a class.

    Raises
    ------
    ConfigError
        It raised, or returned something else than phase levels of the panel.
    """
    with own_method_errors(name):
        levels = np.asarray((fresh_own(name) if designer is None else designer)(belief, panel, radio, rng=rng))
    wanted = f"give whole numbers ({panel.rows}, {panel.cols}) from 0 to {panel.levels - 1}"
    if levels.shape != (panel.rows, panel.cols) or levels.dtype.kind not in "iu":
        raise ConfigError(f"'{name}': {levels.dtype} of shape {levels.shape} returned; {wanted}")
    if levels.min() < 0 or levels.max() >= panel.levels:
        raise ConfigError(f"'{name}': levels {levels.min()} to {levels.max()} returned; {wanted}")
    return RisCode(levels.astype(np.int64), panel.levels)


class OwnChannel:
    """Channel that takes its paths from a user's own channel class, and checks them."""

    def __init__(self, name: str, scene: Scene, radio: RadioConfig, depth: int) -> None:
        self.name, self.scene, self.radio, self.depth = name, scene, radio, depth
        with own_method_errors(name):
            self.inner = load_own(name)(scene, radio, depth)

    def paths(self, trajectory: Trajectory) -> Paths:
        """Paths of all cycles of a trajectory from the user's own channel, with the RIS panel at phase level 0.

        Raises
        ------
        ConfigError
            The channel raised, or gave something else.
        """
        with own_method_errors(self.name):
            found = self.inner.paths(trajectory)
        expect(f"'{self.name}': paths", found, Paths)
        if found.num_cycles != len(trajectory):
            raise ConfigError(f"'{self.name}': paths of {found.num_cycles} cycles returned for {len(trajectory)}")
        return found

    def respond(self, paths: Paths, code: RisCode) -> Paths:
        """The same paths with the gains that the user's own channel gives under another phase code."""
        with own_method_errors(self.name):
            return self.inner.respond(paths, code)


@cache
def _offered() -> dict[str, Any]:
    """A user's own methods that installed packages offer: entry points in `GROUPS`, by name."""
    return {entry.name: entry for group in GROUPS for entry in entry_points(group=group)}


def _entry_point(name: str) -> Any:
    """Load a user's own method from the entry point of an installed package."""
    entry = _offered().get(name)
    if entry is None:
        raise ConfigError(f"'{name}': no such method; give a built-in name, or module:attribute, as mine:my_designer")
    try:
        found = entry.load()
    except (Exception, SystemExit) as error:  # as a user's file
        raise ConfigError(f"'{name}': cannot be loaded ({type(error).__name__}: {error}); mend it") from None
    return _made(name, found)


def _made(name: str, found: Any) -> Any:
    """Check a loaded method of the user's own, and return it."""
    if not hasattr(found, "step"):
        if hasattr(found, "init") and hasattr(found, "estimate"):
            raise ConfigError(f"'{name}': has 'init' and 'estimate' and no 'step'; a filter has all three")
        if callable(found) or hasattr(found, "estimator"):
            return found
        raise ConfigError(f"'{name}': {type(found).__name__} received; give a function, a filter or a channel's class")
    lacks = [part for part in ("init", "estimate") if not hasattr(found, part)]
    if lacks:
        raise ConfigError(f"'{name}': has 'step' and no '{lacks[0]}'; a filter has init, step and estimate")
    if inspect.isclass(found):
        _instance(name, found)  # what cannot be made is told before anything is traced
    return found


def _instance(name: str, found: type) -> Any:
    """Object of the class of a user's own filter or designer."""
    try:
        return found()
    except (Exception, SystemExit) as error:
        raise ConfigError(
            f"'{name}': cannot be made ({type(error).__name__}: {error}); it takes no arguments"
        ) from None


def _file(thing: Any) -> str | None:
    """Path of the source file of a user's own method; None if it has none."""
    with suppress(TypeError):  # built into Python
        return inspect.getsourcefile(thing if inspect.isroutine(thing) or inspect.isclass(thing) else type(thing))
    return None


def own_digest(file: Path) -> str:
    """SHA-256 of a Python file and of all that it imports, directly or not, from its own folder or package.

    Of its bytes alone if there is nothing of that kind. Installed libraries are left out, as are imports by names that
    are computed at run time.
    """
    files = _closure(file)
    if len(files) == 1:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    root = _root(file)
    parts = [f"{one.relative_to(root)}\0{hashlib.sha256(one.read_bytes()).hexdigest()}\n" for one in sorted(files)]
    return hashlib.sha256("".join(parts).encode()).hexdigest()


def _closure(file: Path) -> set[Path]:
    """The file of a user's own method, and all that it imports, directly or not, from its own folder or package.

    Its own package alone where it is installed: beside it lie all other libraries.
    """
    files, left, root = {file}, [file], _root(file)
    own = root / file.relative_to(root).parts[0] if root.resolve() in _installed() else root
    while left:
        fresh = {one for one in _imported(left.pop()) if own in (one, *one.parents)} - files
        files |= fresh
        left += fresh
    return files


def _imported(file: Path) -> Iterator[Path]:
    """Files of the same folder or package that a user's own method imports, `__init__.py` of packages included."""
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
    """Existing Python files of a dotted module name in a user's own method, and of every package on the way."""
    place = folder
    for name in filter(None, names):
        place = place / name
        for file in (place.with_suffix(".py"), place / "__init__.py"):
            if file.is_file():
                yield file


def _root(file: Path) -> Path:
    """Folder from which Python imports the file of a user's own method: that of the outermost package that it is in,
    or, where that is not looked in for modules, the nearest above that is; the former if none is."""
    folder = file.parent
    while (folder / "__init__.py").is_file() and folder != folder.parent:
        folder = folder.parent
    path = set(_import_path())
    return next((one for one in (folder, *folder.parents) if one.resolve() in path), folder)


def _installed() -> set[Path]:
    """`INSTALLED`, without symbolic links."""
    return {folder.resolve() for folder in INSTALLED}


def _import_path() -> list[Path]:
    """Folders in which Python looks for modules, a user's own methods among them, the first one first."""
    return [Path(one).resolve() for one in sys.path]
