"""Axes of a sweep: the values of one setting each, checked, and their notation on the command line."""

import json
import math
from dataclasses import dataclass
from typing import Any

from rislam_rt.errors import ConfigError
from rislam_rt.toml import parse_toml, parse_value

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
    """Whether a value is text, a finite number or a boolean."""
    return isinstance(value, Scalar) and not (isinstance(value, float) and not math.isfinite(value))


def _kind(value: Value) -> str:
    """Type of an axis value in words."""
    if isinstance(value, bool):
        return "booleans"
    if isinstance(value, list):
        return "lists"
    return "text" if isinstance(value, str) else "numbers"
