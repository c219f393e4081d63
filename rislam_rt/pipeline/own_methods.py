"""Methods of one's own: a designer, an estimator or a channel from a user's file or an installed package, by name.

A name is `module:attribute`, as `mine:my_designer` for a function in `mine.py`, or the name of an entry point of one of
`GROUPS`. The command line looks for modules beside the pipeline file and in the working folder too.
"""

import hashlib
import inspect
import re
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from rislam_rt.errors import ConfigError
from rislam_rt.model import Body, Measurement, RadioConfig, RisCode, RisSpec, SensorModel, SlamEstimate
from rislam_rt.slam import StartPrior

GROUPS = ("rislam_rt.schemes", "rislam_rt.designers", "rislam_rt.estimators", "rislam_rt.channels")
"""Entry points under which an installed package offers methods."""
_FORM = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


class OwnDesigner(Protocol):
    """A phase designer: a function."""

    def __call__(
        self, belief: SlamEstimate, panel: RisSpec, radio: RadioConfig, *, rng: np.random.Generator
    ) -> ArrayLike:
        """Levels (N, M), whole numbers from 0 to H - 1, from the belief predicted to the cycle in which they act."""
        ...


class OwnEstimator(Protocol):
    """A filter: an object, or a class without arguments."""

    def init(
        self, start: StartPrior, body: Body, panel: RisSpec | None, sensor: SensorModel, *, rng: np.random.Generator
    ) -> Any:
        """The first state, whatever it is; states are not changed afterwards."""

    def step(
        self,
        state: Any,
        measurement: Measurement,
        code: RisCode | None,
        dt: float,
        heading: float,
        *,
        rng: np.random.Generator,
    ) -> Any:
        """The state after a cycle: `dt` [s] since the last, `heading` [rad] of the compass, `code` in force."""

    def estimate(self, state: Any) -> SlamEstimate:
        """Pose and map (`rislam_rt.model.pose_estimate` makes one of a pose alone)."""


@cache
def load_own(name: str) -> Any:
    """What a name stands for; a class that is made without arguments is made.

    Raises
    ------
    ConfigError
        There is nothing of that name.
    """
    if not _FORM.fullmatch(name):
        return _entry_point(name)
    place, _, attribute = name.partition(":")
    try:
        module = import_module(place)
    except ModuleNotFoundError as error:
        what = f"no module '{place}'" if error.name == place else f"module '{place}' needs '{error.name}'"
        raise ConfigError(f"'{name}': {what}; put {place}.py beside the pipeline file, or install it") from None
    except Exception as error:  # a user's file may raise anything while it is read
        raise ConfigError(f"'{name}': {place} cannot be loaded ({type(error).__name__}: {error}); mend it") from None
    if not hasattr(module, attribute):
        raise ConfigError(f"'{name}': module '{place}' has no '{attribute}'; mend either name")
    found = getattr(module, attribute)
    return found() if inspect.isclass(found) and hasattr(found, "step") else found


def is_own(name: str) -> bool:
    """Whether a name has the form of a method of one's own, or is an entry point's."""
    return bool(_FORM.fullmatch(name)) or name in _offered()


def own_digests(names: Iterable[str]) -> dict[str, str]:
    """SHA-256 of the files behind the names that are methods of one's own: numbers depend on them."""
    found = {}
    for name in sorted(set(names)):
        if is_own(name):
            thing = load_own(name)
            file = inspect.getsourcefile(thing if inspect.isroutine(thing) or inspect.isclass(thing) else type(thing))
            found[name] = hashlib.sha256(Path(file).read_bytes()).hexdigest() if file else ""
    return found


def own_code(
    name: str, belief: SlamEstimate, panel: RisSpec, radio: RadioConfig, *, rng: np.random.Generator
) -> RisCode:
    """The code of a designer of one's own.

    Raises
    ------
    ConfigError
        It returned something else than levels of the panel.
    """
    levels = np.asarray(load_own(name)(belief, panel, radio, rng=rng))
    wanted = f"give whole numbers ({panel.rows}, {panel.cols}) from 0 to {panel.levels - 1}"
    if levels.shape != (panel.rows, panel.cols) or levels.dtype.kind not in "iu":
        raise ConfigError(f"'{name}': {levels.dtype} of shape {levels.shape} returned; {wanted}")
    if levels.min() < 0 or levels.max() >= panel.levels:
        raise ConfigError(f"'{name}': levels {levels.min()} to {levels.max()} returned; {wanted}")
    return RisCode(levels.astype(np.int64), panel.levels)


@cache
def _offered() -> dict[str, Any]:
    return {entry.name: entry for group in GROUPS for entry in entry_points(group=group)}


def _entry_point(name: str) -> Any:
    entry = _offered().get(name)
    if entry is None:
        raise ConfigError(f"'{name}': no such method; give a built-in name, or module:attribute, as mine:my_designer")
    found = entry.load()
    return found() if inspect.isclass(found) and hasattr(found, "step") else found
