"""Definition of a sweep (function, axes, base settings), and its cells: one evaluation each, with settings and seed."""

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple

from rislam_rt.errors import ConfigError
from rislam_rt.toml import parse_toml, parse_value, put_dotted

Scalar = str | int | float | bool
Value = Scalar | list[Scalar]
"""Type of an axis value: text, number, boolean, or a list of these."""


@dataclass(frozen=True, slots=True)
class Axis:
    """Axis of a sweep: the values that one setting takes."""

    key: str
    """Dotted key of the setting, as `slam.sigma_a`."""
    values: tuple[Value, ...]
    """Values, all of one type (whole numbers pass for real ones), each once."""

    def __post_init__(self) -> None:
        if not self.key or not all(self.key.split(".")):
            raise ConfigError(f"axis '{self.key}': not a dotted key; give e.g. 'slam.sigma_a'")
        if not self.values:
            raise ConfigError(f"axis '{self.key}': no values received; give at least one")
        for value in self.values:
            if not all(_plain(part) for part in (value if isinstance(value, list) else [value])):
                raise ConfigError(f"axis '{self.key}': {value!r} received; give text, finite numbers, true or false")
        kinds = {_kind(value) for value in self.values}
        if len(kinds) > 1:
            raise ConfigError(f"axis '{self.key}': mixes {' and '.join(sorted(kinds))}; give values of one type")
        if len({json.dumps(value) for value in self.values}) < len(self.values):
            raise ConfigError(f"axis '{self.key}': a value comes twice; give each once")


def parse_axis(text: str) -> Axis:
    """Axis of a sweep from text `key=v1,v2,...`: values in TOML notation, anything else is text.

    Raises
    ------
    ConfigError
        It is not of that form.
    """
    key, equals, values = text.partition("=")
    parts = [part.strip() for part in values.split(",")]
    if not equals or not key.strip() or not all(parts):
        raise ConfigError(f"axis '{text[:80]}': not of the form key=v1,v2,...; give e.g. slam.sigma_a=0.01,0.1")
    try:
        found = parse_toml(f"values = [{values}]")["values"]
    except (ValueError, KeyError):
        found = [parse_value(part) for part in parts]
    if {type(value) for value in found} == {int, float}:
        found = [float(value) for value in found]
    return Axis(key.strip(), tuple(found))


def _plain(value: Any) -> bool:
    """Whether a value of a sweep's axis is text, a finite number or a boolean."""
    return isinstance(value, Scalar) and not (isinstance(value, float) and not math.isfinite(value))


def _kind(value: Value) -> str:
    """Type of a sweep's axis value in words."""
    if isinstance(value, bool):
        return "booleans"
    if isinstance(value, list):
        return "lists"
    return "text" if isinstance(value, str) else "numbers"


@dataclass(frozen=True, slots=True)
class Sweep:
    """Definition of a sweep: a function, its base settings, the axes to vary and the number of repetitions.

    Only the order of the table depends on the order of axes and values.
    """

    function: str
    """Name `module:function`, importable in every worker process. The function takes (settings, seed) and returns a
    mapping of names to numbers, text, lists and mappings of these; times, which differ from run to run, are under
    `timing`."""
    axes: tuple[Axis, ...] = ()
    base: Mapping[str, Any] = field(default_factory=dict)
    """Settings common to all cells: nested mappings of plain values, as from a TOML file."""
    repetitions: int = 1
    seed: int = 0
    """Seed of the whole sweep."""
    paired: tuple[str, ...] = ()
    """Axes that the cells' seeds do not depend on, so that cells which differ in them only draw the same numbers."""
    local: Mapping[str, Any] = field(default_factory=dict)
    """Settings that results do not depend on, such as folders: the function gets them, no file has them."""
    depends: Callable[[Mapping[str, Any]], Mapping[str, Any]] | None = None
    """Function that returns what else a cell's result depends on: versions, the hash of a scene."""
    name: str = "sweep"

    def __post_init__(self) -> None:
        module, colon, function = self.function.partition(":")
        if not (colon and all(part.isidentifier() for part in [*module.split("."), function])):
            raise ConfigError(f"sweep function: '{self.function}' received; give 'package.module:function'")
        if self.repetitions < 1:
            raise ConfigError(f"repetitions: {self.repetitions} received; give at least 1")
        keys = [axis.key for axis in self.axes]
        for key in keys:
            clash = [other for other in keys if other != key and other.startswith(key + ".")]
            if keys.count(key) > 1 or clash:
                raise ConfigError(f"axis '{key}': set twice ({', '.join(clash) or key}); give each setting one axis")
        for key in self.paired:
            if key not in keys:
                raise ConfigError(f"paired: '{key}' is no axis; give some of {', '.join(keys) or 'none'}")


class Cell(NamedTuple):
    """One cell of a sweep: one evaluation of its function, with settings and seed."""

    ident: str
    """Name of its file: 32 hexadecimal digits of a hash over the function's name and all entries below."""
    point: Mapping[str, Value]
    """Values along the axes, by key."""
    repetition: int
    """Number of the repetition, from 0."""
    settings: Mapping[str, Any]
    """Base settings with the point's values, nested."""
    seed: int
    """63 bits, from a hash of the sweep's seed, the repetition, and the values along the axes that are not paired."""
    depends: Mapping[str, Any]
    """What else the result depends on: versions, the hash of a scene."""


def build_cells(sweep: Sweep) -> list[Cell]:
    """List all cells of a sweep with settings and seeds; the last axis varies fastest, repetitions faster still.

    Raises
    ------
    ConfigError
        A key leads through a value that is no table, or the settings are no plain data.
    """
    cells = []
    for values in product(*(axis.values for axis in sweep.axes)):
        point = dict(zip((axis.key for axis in sweep.axes), values, strict=True))
        settings = dict(sweep.base)
        for key, value in point.items():
            settings = put_dotted(settings, key, value)
        depends = dict(sweep.depends(settings)) if sweep.depends else {}
        drawn = {key: value for key, value in point.items() if key not in sweep.paired}
        for repetition in range(sweep.repetitions):
            seed = int.from_bytes(_digest([drawn, repetition, sweep.seed])[:8]) >> 1
            ident = _digest([sweep.function, settings, repetition, seed, depends]).hex()[:32]
            cells.append(Cell(ident, point, repetition, settings, seed, depends))
    return cells


def _digest(content: Any) -> bytes:
    """SHA-256 of a sweep's settings as plain data, encoded as JSON with sorted keys and shortest numbers that read back
    the same."""
    try:
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"sweep settings: not plain data ({error}); give numbers, text, lists and tables") from None
    return hashlib.sha256(text.encode()).digest()
