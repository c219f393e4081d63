"""Reading of TOML from users who may be mistaken or mean harm (one kind of exception, bounded time), and writing of
TOML."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from numbers import Integral
from typing import Any

from rislam_rt.errors import ConfigError

MAX_LEVELS = 100
"""Most parts of a dotted key; the time to read a longer one grows with its square."""

MAX_DIGITS = 100
"""Most digits of a hexadecimal, octal or binary number, for which Python sets no limit when it reads and one when it
prints."""

_LONG_NUMBER = re.compile(r"0[xob][0-9A-Fa-f_]{" + str(MAX_DIGITS + 1) + "}")
_LONG_KEY = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+)""" + f"{{{MAX_LEVELS}}}")


def parse_toml(text: str) -> dict[str, Any]:
    """Parse a TOML text into a table, after a byte order mark if there is one; numbers beyond 64 bits and keys of very
    many parts are refused.

    Raises
    ------
    ValueError
        It is not TOML, or is nested too deeply; the message says where.
    """
    text = text.removeprefix("\ufeff")
    if _LONG_NUMBER.search(text) is not None:
        raise ValueError(f"a number of more than {MAX_DIGITS} digits; TOML has whole numbers of 64 bits")
    long_key = _LONG_KEY.search(text)
    if long_key is not None:
        line = text.count("\n", 0, long_key.start()) + 1
        raise ValueError(f"a key of more than {MAX_LEVELS} parts (at line {line}); take shorter ones")
    try:
        table = tomllib.loads(text)
        too_long = next(_too_long(table, ""), None)
    except (RecursionError, OverflowError) as error:
        raise ValueError(f"nested too deeply, or a number too long ({type(error).__name__})") from None
    if too_long is not None:
        raise ValueError(f"{too_long.lstrip('.')}: TOML has whole numbers of 64 bits, write a larger one as 1e30")
    return table


def _too_long(value: Any, place: str) -> Iterator[str]:
    """Places in a parsed TOML table of whole numbers that 64 bits do not hold."""
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        yield place
    for name, part in value.items() if isinstance(value, dict) else ():
        yield from _too_long(part, f"{place}.{name}")
    for number, part in enumerate(value if isinstance(value, list) else ()):
        yield from _too_long(part, f"{place}[{number}]")


def parse_value(text: str) -> Any:
    """Value of a setting that is given as text: parsed as TOML, or the text itself if it is no TOML, so that strings
    need no quotes."""
    try:
        return parse_toml(f"value = {text}")["value"]
    except (ValueError, KeyError):
        return text


def put_dotted(settings: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Copy of nested settings (a TOML table) with the value at one dotted key (`a.b.c`) replaced; missing tables on the
    way are made.

    Raises
    ------
    ConfigError
        The key leads through a value that is no table.
    """
    head, dot, rest = key.partition(".")
    if not dot:
        return {**settings, head: value}
    inner = settings.get(head, {})
    if not isinstance(inner, Mapping):
        raise ConfigError(f"'{key}': '{head}' holds {inner!r}, which is no table; check the key")
    return {**settings, head: put_dotted(inner, rest, value)}


def toml_bytes(table: Mapping[str, Any]) -> bytes:
    """Write a table as TOML: plain keys first, then (lists of) tables; text and numbers read back equal."""
    lines = [f"{_toml_key(key)} = {toml_value(value)}" for key, value in table.items() if not _is_table(value)]
    for key, value in table.items():
        for section in value if isinstance(value, list) and _is_table(value) else [value]:
            if isinstance(section, Mapping):
                lines += ["", f"[[{_toml_key(key)}]]" if isinstance(value, list) else f"[{_toml_key(key)}]"]
                lines += [f"{_toml_key(name)} = {toml_value(item)}" for name, item in section.items()]
    return ("\n".join(lines) + "\n").encode()


def toml_value(value: Any) -> str:
    """Write one value as TOML text, tables inline; text and numbers read back equal."""
    if isinstance(value, str):
        # TOML's strings are JSON's, but for DEL.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Integral):
        return str(value).lower()
    if isinstance(value, float):
        return repr(float(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_toml_key(key)} = {toml_value(item)}" for key, item in value.items()) + " }"
    return "[" + ", ".join(toml_value(item) for item in value) + "]"


def _is_table(value: Any) -> bool:
    """Whether a value is written to TOML as a section: a table, or a list of tables."""
    return isinstance(value, Mapping) or (isinstance(value, list) and bool(value) and isinstance(value[0], Mapping))


def _toml_key(key: str) -> str:
    """Key of a TOML table as it is written: bare where TOML allows it, else quoted."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else str(toml_value(key))
