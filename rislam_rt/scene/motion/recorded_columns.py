"""Columns of a recording, a CSV file of the agent's poses: which holds what, and in which unit."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from rislam_rt.input_messages import nearest
from rislam_rt.scene.findings import Fault

QUATERNION = ("qx", "qy", "qz", "qw")
COLUMNS = ("time", "x", "y", "z", "heading", *QUATERNION)
"""Quantities of each pose that a CSV file may hold."""
ALIASES = {"time": ("time", "timestamp", "t"), "heading": ("heading", "yaw")}
"""Names of CSV columns that are looked for where the scene file names no column."""
LENGTHS = {"m": 1.0, "km": 1e3, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
UNITS = {
    "time": {"s": 1.0, "sec": 1.0, "min": 60.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "heading": {"rad": 1.0, "deg": np.pi / 180.0, "radians": 1.0, "degrees": np.pi / 180.0},
    **dict.fromkeys("xyz", LENGTHS),
}
"""Units of CSV columns by the last word of their names; seconds, radians and metres without one."""
TURNED = (
    "heading", "yaw", "bearing", "azimuth", "course", "compass", "direction", "orientation", "rotation", "angle",
    "theta", "psi", "quat",
)  # fmt: skip
"""Beginnings of names under which recordings hold a heading."""
NO_HEADING = ("rate", "vel", "speed", "acc", "dot", "std", "sigma", "var", "cov", "err")
"""Parts of names of what is told about a heading and is none."""


def find_columns(header: Sequence[str], named: Mapping[str, str]) -> dict[str, tuple[int, float]]:
    """Find the column of each quantity of a recording by its line of names, from 0, and its unit in SI; `named` are
    those that the scene names.

    Raises
    ------
    Fault
        A column is missing or stands there twice, or one that seems to hold the heading would not be read.
    """
    twice = [what for what, name in named.items() if list(named.values()).count(name) > 1]
    if twice:
        both = " and ".join(f"'{what}'" for what in named if named[what] == named[twice[0]])
        raise Fault(f"column '{named[twice[0]][:20]}' of the trajectory is named for {both}", "give each its own")
    found = {what: at for what in COLUMNS if (at := _find(what, header, named)) is not None}
    lacking = [part for part in QUATERNION if part not in found]
    if "heading" in found or not lacking:
        return found
    if len(lacking) < len(QUATERNION):
        raise Fault(f"a quaternion without '{lacking[0]}' in the trajectory", f"give it; {_named_in_scene(lacking[0])}")
    unread = next((name for name in header if _may_be_heading(name)), None)
    if unread is not None:
        last = _words(unread)[-1]
        meant = f"q{last}" if f"q{last}" in QUATERNION else "heading"
        what = f"column '{unread[:20]}' of the trajectory seems to be a heading, and would not be read"
        mend = f"did you mean '{meant}'? {_named_in_scene(meant, unread)}"
        raise Fault(what, f"{mend}, its unit the last word of the name (_deg, _rad), or leave the column out")
    return found


def has_unit(what: str, name: str) -> bool:
    """Whether the name of a recording's column that holds one quantity says its unit."""
    return _words(name)[-1] in UNITS.get(what, {})


def few_names(header: Sequence[str]) -> str:
    """Names of a recording's columns for an error message, a dozen at most."""
    return ", ".join(f"'{name[:20]}'" for name in header[:12]) or "no columns"


def _find(what: str, header: Sequence[str], named: Mapping[str, str]) -> tuple[int, float] | None:
    """Column of a recording that holds one quantity, and its unit in SI; None for one that may be left out."""
    if what in named and named[what] not in header:
        raise Fault(f"no column '{named[what]}' for '{what}' in the trajectory", f"it has {few_names(header)}")
    places = [at for at, name in enumerate(header) if _quantity(what, name) in ALIASES.get(what, (what,))]
    if what in named:
        places = [header.index(named[what])]
    if len(places) > 1:
        both = " and ".join(f"'{header[at][:20]}'" for at in places[:2])
        raise Fault(f"columns {both} of the trajectory may both be '{what}'", f"{_named_in_scene(what)}, or drop one")
    if places:
        return places[0], UNITS.get(what, {}).get(_words(header[places[0]])[-1], 1.0)
    if what in ("time", "x", "y", "z"):
        mend = f"{_named_in_scene(what, _likeliest(what, header))}; the file has {few_names(header)}"
        raise Fault(f"no column '{what}' in the trajectory", mend)
    return None


def _named_in_scene(what: str, name: str = "...") -> str:
    """How the scene names a recording's column, for an error message."""
    return f'name it in agent.columns, e.g. columns = {{ {what} = "{name[:20]}" }}'


def _likeliest(what: str, header: Sequence[str]) -> str:
    """Name of a recording's column that may hold the time or a coordinate: `px`, `pos_x`, `x_map`; dots without one."""
    marks = ("time", "stamp") if what == "time" else (what,)
    ends = ((name, word) for name in header if name not in COLUMNS for word in _words(name))
    return next((name for name, word in ends if word.startswith(marks) or word.endswith(marks)), "...")


def _words(name: str) -> list[str]:
    """Words of the name of a recording's column in lower case: `Yaw [deg]` and `yaw_deg` are `yaw`, `deg`."""
    return re.findall(r"[^\W_]+", name.lower()) or [""]


def _quantity(what: str, name: str) -> str:
    """Name of a recording's column without its unit, if that is one of the quantity `what`."""
    *words, last = _words(name)
    return "_".join(words if words and last in UNITS.get(what, {}) else [*words, last])


def _may_be_heading(name: str) -> bool:
    """Whether a recording's column that is not read holds the heading, or a quaternion, by its name."""
    first = _words(name)[0]
    told = first.startswith(TURNED) or bool(nearest(first, TURNED))
    return told and not any(part in name.lower() for part in NO_HEADING)
