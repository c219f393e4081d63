"""Messages on bad input, in a file or on the command line: what to give instead, in the setting's unit, and spelling
suggestions for an unknown word.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from rislam_rt.toml import toml_value

UNITS = {
    "_m_s2": "m/s^2", "_m_s": "m/s", "_deg_s": "degrees/s", "_bits_s": "bit/s", "_ns_s": "ns/s", "_s_m": "S/m",
    "_m2": "m^2", "_ghz": "GHz", "_db": "dB", "_deg": "degrees", "_ns": "ns", "_s": "s", "_m": "m", "_j": "J",
    "_wavelengths": "wavelengths",
}  # fmt: skip
"""Units by the suffix of a name; the longest that fits. A name without one has its unit in its meaning."""

BOUNDS = {
    "greater than or equal to": "at least", "less than or equal to": "at most", "greater than": "more than",
    "less than": "less than",
}  # fmt: skip
"""Bounds of a range as the models say them, and in plain words; the longer first."""

KINDS = {
    "int_": "a whole number", "float_": "a number", "bool_": "true or false", "string_type": "text in quotes",
}  # fmt: skip
"""What a value of a wrong type must be, by the beginning of the fault's type."""


def unit_of(name: str) -> str:
    """Unit of a setting by its name, for messages about input; empty if the name does not say it."""
    return next((unit for suffix, unit in UNITS.items() if name.endswith(suffix)), "")


def expected_input(item: Mapping[str, Any], typed: bool = False) -> str:
    """What to give instead, of a fault of pydantic's: `give at most 3000 GHz`; `typed` on the command line, a list
    needs quotes."""
    message = " ".join(str(item["msg"]).removeprefix("Value error, ").split())
    names = [part for part in item["loc"] if isinstance(part, str)]
    name = names[-1] if names else ""
    if item["type"] == "list_type":
        words = str(item["input"]).strip("[]()").replace('"', "").replace("'", "").split(",")
        values = f"[{', '.join(_entry(word.strip()) for word in words)}]"[:100]
        return f"give a list, in quotes: '{name}={values}'" if typed else f"give a list, {name} = {values}"
    if item["type"] in ("model_type", "dict_type"):
        return f"give a table, {name} = {{ key = value }}, or one alone: [{name}]"
    if item["type"] == "literal_error":
        near = nearest(str(item["input"]).lower(), re.findall("'([^']*)'", message))
        if near:
            return did_you_mean(near)
    if item["type"] in ("too_short", "too_long"):
        most, number, given = re.findall("at (least|most) ([0-9]+).* not ([a-z0-9]+)", message)[0]
        return f"give at {most} {counted(int(number), 'item')}, not {given}"
    if isinstance(item["input"], float) and item["input"] != item["input"]:
        return "give a finite number"
    if item["type"].startswith("int_") and str(item["input"]).strip("+-").isdigit():
        return "give a whole number that 64 bits hold"
    kind = next((text for begins, text in KINDS.items() if item["type"].startswith(begins)), None)
    if kind is not None:
        return f"give {kind}"
    text = message.removeprefix("Input should be ")
    for long, plain in BOUNDS.items():
        if text.startswith(long) and text != message:
            return f"give {plain}{text.removeprefix(long)} {unit_of(name)}".rstrip()
    return f"give {text}" if text != message else f"{message[:1].lower()}{message[1:]}"


def _entry(word: str) -> str:
    """A word as an entry of a list that a message proposes: numbers as they are, text in quotes."""
    try:
        float(word)
    except ValueError:
        return toml_value(word)
    return word


def parse_number(text: str) -> float:
    """Number in a user's file or on the command line; a `ValueError` for `1_5`, which Python takes for 15."""
    if "_" in text:
        raise ValueError(text)
    return float(text)


LEAST_LIKE = 0.75
"""Least similarity (share of letters in common) of two spellings of one word; `num_particles` and `num_samples` have
0.67."""


def nearest(word: str, known: Iterable[str], most: int = 1) -> list[str]:
    """Known words that are spelled nearly like a given word, the nearest first, at most `most` of them."""
    return get_close_matches(word, list(known), n=most, cutoff=LEAST_LIKE)


def did_you_mean(near: Sequence[str]) -> str:
    """Question `did you mean 'x' or 'y'?` for an error message from suggested words; empty if there are none."""
    return f"did you mean {' or '.join(repr(word) for word in near)}?" if near else ""


EXACT = 1e-12
"""Largest error by rounding of a share of none or of all."""


def counted(number: int, thing: str) -> str:
    """Spelling of a number of things: `1 error`, `2 errors`."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def share_text(share: float) -> str:
    """Spelling of a share in percent without a blank, `37%`: with as many decimals, up to two, as keep a few from
    reading as none, and all but a few as all (1 of 200 is `0.5%`)."""
    for digits in range(3):
        text = f"{100.0 * share:.{digits}f}"
        if float(text) not in (0.0, 100.0) or abs(share - float(text) / 100.0) < EXACT:
            return f"{float(text):.0f}%" if float(text) in (0.0, 100.0) else f"{text}%"
    return "below 0.01%" if share < 0.5 else "above 99.99%"
