"""Recorded poses of the agent: TUM files (`timestamp x y z qx qy qz qw` a line) and CSV files with named columns."""

import csv
import io
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.schema import SMALLEST

MAX_TIME = 1e11
"""Largest time stamp [s] of a recording: three thousand years, where float64 still tells 20 microseconds apart."""
MAX_STEP = 1e6
"""Longest step [s] within a recording, twelve days: longer gaps lie between recordings."""
MAX_TILT = 1e-3
"""Largest angle [rad] of a recorded pose's z axis from the room's: the body turns about z only."""
QUATERNION = ("qx", "qy", "qz", "qw")
COLUMNS = ("time", "x", "y", "z", "heading", *QUATERNION)
"""Quantities of each pose that a CSV file may hold."""
ALIASES = {"time": ("time", "timestamp", "t"), "heading": ("heading", "yaw")}
"""Names of CSV columns that are looked for where the scene file names no column."""
UNITS = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "heading": {"rad": 1.0, "deg": float(np.pi / 180.0)},
    **{axis: {"m": 1.0, "cm": 1e-2, "mm": 1e-3} for axis in "xyz"},
}
"""Units of CSV columns by the endings of their names, after `_`; seconds, radians and metres without one."""


class RecordedPoses(NamedTuple):
    """K recorded poses of the agent."""

    time: Floats
    """(K,) [s]."""
    position: Floats
    """(K, 3) [m]."""
    heading: Floats | None
    """(K,) [rad]; None where the file says nothing of it."""


def parse_tum(content: bytes) -> tuple[Floats, Floats, Floats]:
    """Parse a TUM file into times (K,) [s], positions (K, 3) [m] and headings (K,) [rad]; `#` starts a comment.

    Raises
    ------
    Fault
        A line is not eight finite numbers, time does not grow, or a pose is tilted.
    """
    rows = []
    for number, line in enumerate(content.decode("utf-8", errors="replace").splitlines(), start=1):
        words = line.split("#")[0].split()
        if words:
            rows.append(_numbers(words, 8, number, "give 'timestamp x y z qx qy qz qw'"))
    if not rows:
        raise Fault("the trajectory file holds no pose", "give lines 'timestamp x y z qx qy qz qw'")
    table = np.array(rows)
    time, position = _checked(table[:, 0], table[:, 1:4])
    return time, position, _heading(table[:, 4:])


def parse_csv(content: bytes, named: Mapping[str, str]) -> RecordedPoses:
    """Parse recorded poses from a CSV file with one line of column names; `named` says which columns hold what, where
    they are not called `time`, `x`, `y`, `z`, `heading`, `qx` to `qw` anyway.

    A name's ending tells its unit: `stamp_ns`, `x_mm`, `yaw_deg`. Other columns are left alone.

    Raises
    ------
    Fault
        A column is missing, a line is not as long as the header, a number is none, or time does not grow.
    """
    lines = list(csv.reader(io.StringIO(content.decode("utf-8-sig", errors="replace"))))
    header = [name.strip() for name in lines[0]] if lines else []
    place = {what: at for what in COLUMNS if (at := _column(what, header, named)) is not None}
    wanted = f"give a number in each column that is read, of {_few(header)}"
    rows = [
        _numbers([line[at] if at < len(line) else "" for at, _ in place.values()], len(place), number, wanted)
        for number, line in enumerate(lines[1:], start=2)
        if any(word.strip() for word in line)
    ]
    if not rows:
        raise Fault("the trajectory file holds no pose", "give a line of column names, then one line a pose")
    table = {what: column * scale for (what, (_, scale)), column in zip(place.items(), np.array(rows).T, strict=True)}
    time, position = _checked(table["time"], np.column_stack([table[axis] for axis in "xyz"]))
    if "heading" in table:
        return RecordedPoses(time, position, table["heading"])
    turned = all(part in table for part in QUATERNION)
    return RecordedPoses(time, position, _heading(np.column_stack([table[q] for q in QUATERNION])) if turned else None)


def _column(what: str, header: Sequence[str], named: Mapping[str, str]) -> tuple[int, float] | None:
    """Index and unit in SI of the CSV column that holds a quantity; None for one that may be left out."""
    if what in named:
        if named[what] not in header:
            raise Fault(f"no column '{named[what]}' for '{what}' in the trajectory", f"it has {_few(header)}")
        return header.index(named[what]), _unit(what, named[what])
    for at, name in enumerate(header):
        if re.sub("_[a-z]+$", "", name.lower()) in ALIASES.get(what, (what,)):
            return at, _unit(what, name)
    if what in ("time", "x", "y", "z"):
        mend = f'name it in agent.columns, e.g. columns = {{ {what} = "..." }}; the file has {_few(header)}'
        raise Fault(f"no column '{what}' in the trajectory", mend)
    return None


def _unit(what: str, name: str) -> float:
    """Unit of a recording's CSV column in SI, by the ending of its name."""
    return UNITS.get(what, {}).get(name.lower().rpartition("_")[2], 1.0)


def _few(header: Sequence[str]) -> str:
    """Column names of a CSV file of recorded poses for an error message, a dozen at most."""
    return ", ".join(f"'{name[:20]}'" for name in header[:12]) or "no columns"


def _numbers(words: Sequence[str], count: int, number: int, mend: str) -> list[float]:
    """Numbers of one line of a recording; an error unless there are `count` finite ones."""
    try:
        row = [float(word) for word in words]
    except ValueError:
        row = []
    if len(row) != count or not np.isfinite(row).all():
        amount = {8: "eight"}.get(count, str(count))
        raise Fault(f"line {number} of the trajectory is not {amount} finite numbers", mend)
    return row


def _checked(time: Floats, position: Floats) -> tuple[Floats, Floats]:
    """Check that times and positions can be those of recorded poses, and return them as they are."""
    if np.abs(time).max() > MAX_TIME:
        raise Fault(f"a time of {time[np.argmax(np.abs(time))]:.3g} s in the trajectory", "give seconds")
    step = np.diff(time)
    if (step <= 0.0).any():
        pose = int(np.argmax(step <= 0.0)) + 1
        raise Fault(f"time does not grow at pose {pose} ({time[pose]} s)", "sort the poses and drop repeated ones")
    odd = (step < SMALLEST) | (step > MAX_STEP)
    if odd.any():
        pose = int(np.argmax(odd)) + 1
        raise Fault(
            f"{step[pose - 1]:.3g} s from the pose before to pose {pose}",
            f"give steps of {SMALLEST:g} to {MAX_STEP:g} s: cut the file at a gap, thin it out where it is too dense",
        )
    if np.abs(position).max() > 1e5:
        raise Fault(f"a coordinate of {np.abs(position).max():.3g} m in the trajectory", "give metres")
    return time, position


def _heading(q: Floats) -> Floats:
    """Headings (K,) [rad] of recorded unit quaternions (K, 4), which must be turns about z."""
    length = np.linalg.norm(np.clip(q, -2.0, 2.0), axis=1)  # a wrong length stays one, and no square overflows
    if (np.abs(length - 1.0) > 1e-3).any():
        pose = int(np.argmax(np.abs(length - 1.0) > 1e-3))
        raise Fault(f"quaternion of pose {pose} has not length 1", "normalise it")
    x, y, z, w = (q / length[:, None]).T
    tilt = 2.0 * np.hypot(x, y)
    if (tilt > MAX_TILT).any():
        raise Fault(f"pose {int(np.argmax(tilt > MAX_TILT))} is tilted", "give rotations about z only (qx = qy = 0)")
    return np.asarray(2.0 * np.arctan2(z, w))
