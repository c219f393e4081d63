"""A user's own methods: a code designer, an estimator or a channel from a file or an installed package, by name.

A name is `module:attribute`, as `mine:my_designer` for a function in `mine.py`, or the name of an entry point of one of
`GROUPS`. The command line looks for modules beside the pipeline file and in the working folder too.
"""

import inspect
import re
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from importlib import import_module
from importlib.metadata import entry_points
from types import ModuleType
from typing import Any

import numpy as np

from rislam_rt.errors import ConfigError, RislamError, expect
from rislam_rt.model import DataSheet, Paths, RadioConfig, RisCode, Scene, SlamEstimate, Trajectory

GROUPS = ("rislam_rt.schemes", "rislam_rt.designers", "rislam_rt.estimators", "rislam_rt.channels")
"""Entry point groups under which an installed package offers schemes, designers, estimators and channels."""
WRAPPERS = 20
"""Most wrappers about a function of a user's own that are taken off to find where it is written."""
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
        files = [text_of(module, "__file__") for module in (defining_module(name), module_of(name))]
        own = [frame for frame in frames if frame.filename in files]
        where = f" in line {own[-1].lineno} of {own[-1].filename}" if own else ""
        cause = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise ConfigError(f"'{name}': raised {cause}{where}; mend it") from error


def is_own(name: str) -> bool:
    """Whether a name has the form of a user's own method (`module:attribute`), or is that of an entry point."""
    return bool(_FORM.fullmatch(name)) or name in _offered()


def is_entry_point(name: str) -> bool:
    """Whether a name is that of a user's own method in an installed package's entry points."""
    return not _FORM.fullmatch(name) and name in _offered()


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


def module_of(name: str) -> ModuleType | None:
    """Module that is named for a user's own method, once it is loaded; it may import the method from another one."""
    return sys.modules.get(place_of(name))


def place_of(name: str) -> str:
    """Dotted name of the module that is named for a user's own method."""
    return name.partition(":")[0] if _FORM.fullmatch(name) else str(_offered()[name].module)


def defining_module(name: str) -> ModuleType | None:
    """Module in which a user's own method, or its class, is written; None if that is not known.

    Raises
    ------
    ConfigError
        The method cannot be loaded.
    """
    found = load_own(name)
    for _ in range(WRAPPERS):
        with suppress(Exception):
            found = found.func if isinstance(found, partial) else found.__wrapped__
    return sys.modules.get(text_of(found, "__module__"))


def text_of(thing: Any, name: str) -> str:
    """Attribute of an object of a user's own that is a text; empty if it has none, or raises anything for it."""
    with suppress(Exception):
        found = getattr(thing, name)
        return found if isinstance(found, str) else ""
    return ""
