"""Recorded poses of the agent: TUM files (`timestamp x y z qx qy qz qw` a line) and CSV files with named columns."""

import csv
import io
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import wrap
from rislam_rt.input_messages import counted, parse_number
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.motion.recorded_columns import QUATERNION, few_names, find_columns, has_unit
from rislam_rt.scene.schema import SMALLEST

MAX_TIME = 1e11
"""Largest time stamp [s] of a recording: three thousand years, where float64 still tells 20 microseconds apart."""
MAX_STEP = 1e6
"""Longest step [s] within a recording, twelve days: longer gaps lie between recordings."""
MAX_TILT = 1e-3
"""Largest angle [rad] of a recorded pose's z axis from the room's: the body turns about z only."""
MAX_HEADING = 6.0 * np.pi
"""Largest recorded heading [rad], three turns one way, that is taken as it is: more has to be one that turns on."""
FIRST_HEADING = 2.0 * np.pi
"""Largest heading [rad] with which a recording begins that turns on beyond `MAX_HEADING`: odometry counts from the
start."""
FASTEST_TURN = np.pi
"""Largest turn [rad] within a second of a heading that turns on: half a turn, a TurtleBot3 makes up to 2.84 rad. Of
degrees 3.2 a second exceed it."""
UNEXPLAINED = 0.5
"""Share of what radians, and one heading all along, leave of the way unexplained: if degrees leave less than that, they
are the way's headings."""
SEPARATORS = {";": "semicolons", "\t": "tabs", " ": "blanks"}
"""What other separators of CSV files than commas are called."""
COMMAS = "separate columns by commas, write decimals with a point"
"""How to mend a CSV file of another country."""


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
    wanted = "give 'timestamp x y z qx qy qz qw' without commas; a file with column names ends in .csv"
    for number, line in enumerate(content.decode("utf-8-sig", errors="replace").splitlines(), start=1):
        words = line.split("#")[0].split()
        if words:
            rows.append(_numbers(words, 8, number, wanted))
    if not rows:
        raise Fault("the trajectory file holds no pose", "give lines 'timestamp x y z qx qy qz qw'")
    table = np.array(rows)
    time, position = _checked(table[:, 0], table[:, 1:4])
    return time, position, _heading(table[:, 4:])


def parse_csv(content: bytes, named: Mapping[str, str]) -> RecordedPoses:
    """Parse recorded poses from a CSV file with one line of column names; `named` says which columns hold what, where
    they are not called `time`, `x`, `y`, `z`, `heading`, `qx` to `qw` anyway.

    A name's last word tells its unit: `stamp_ns`, `x_mm`, `yaw_deg`. Other columns are left alone.

    Raises
    ------
    Fault
        The file is no CSV, a column is missing, a line is longer than the header, a number is none, or time does not
        grow.
    """
    lines = _csv_lines(content)
    header = [name.strip() for name in lines[0]]
    place = find_columns(header, named)
    _check_lengths(lines)
    wanted = f"give a number in each column that is read, of {few_names(header)}"
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
        heading = table["heading"]
        if not has_unit("heading", header[place["heading"][0]]):
            _check_radians(heading, time, position)
        return RecordedPoses(time, position, wrap(heading) if np.abs(heading).max() > MAX_HEADING else heading)
    turned = all(part in table for part in QUATERNION)
    return RecordedPoses(time, position, _heading(np.column_stack([table[q] for q in QUATERNION])) if turned else None)


def _csv_lines(content: bytes) -> list[list[str]]:
    """Lines of a CSV file of recorded poses, each a list of entries; of the first one, the names, at least one.

    Raises
    ------
    Fault
        It is empty, or no CSV file in UTF-8 with commas.
    """
    if b"\0" in content:
        raise Fault("the trajectory file is not text in UTF-8", "save it as CSV in UTF-8")
    try:
        lines = list(csv.reader(io.StringIO(content.decode("utf-8-sig", errors="replace"), newline=None)))
    except csv.Error as error:
        mend = "give a line of column names, then one a pose"
        raise Fault(f"the trajectory is no CSV file ({error})", mend) from None
    if not lines or not any(lines[0]):
        raise Fault("the trajectory file does not begin with column names", "give 'time,x,y,z', then one line a pose")
    alone = lines[0][0].strip() if len(lines[0]) == 1 else "#"
    used = next((words for mark, words in SEPARATORS.items() if mark in alone and not alone.startswith("#")), "")
    if used:
        raise Fault(f"{used} between the columns of the trajectory", COMMAS)
    return lines


def _check_lengths(lines: Sequence[Sequence[str]]) -> None:
    """Check that no line of a CSV file of recorded poses has more entries than the first has names."""
    count = len(lines[0])
    for number, line in enumerate(lines, start=1):
        if any(word.strip() for word in line[count:]):
            what = f"line {number} of the trajectory has {len(line)} entries for {counted(count, 'column')}"
            raise Fault(what, COMMAS)


def _check_radians(heading: Floats, time: Floats, position: Floats) -> None:
    """Check that the headings (K,) [rad] of recorded poses, whose column has no unit in its name, may be radians."""
    largest = float(heading[np.argmax(np.abs(heading))])
    why = "" if abs(largest) <= MAX_HEADING else _reason_for_degrees(heading, time, position)
    if why:
        mend = "call the column 'heading_deg' if these are degrees, or bring them to -pi to pi"
        raise Fault(f"a heading of {largest:.4g} rad in the trajectory, {why}", mend)


def _reason_for_degrees(heading: Floats, time: Floats, position: Floats) -> str:
    """Reason why recorded headings (K,) beyond `MAX_HEADING` are not radians that turn on, as odometry counts them;
    empty if they may be."""
    heading = np.clip(heading, -MAX_TIME, MAX_TIME)  # so that no difference overflows
    step = np.abs(np.diff(heading))
    turn, x, y = (np.interp(time + 1.0, time, one) - one for one in (heading, *position.T[:2]))  # in a second
    if abs(heading[0]) > FIRST_HEADING:
        return f"and it begins at {heading[0]:.4g} rad"
    if step.max(initial=0.0) >= np.pi:
        pose = int(np.argmax(step >= np.pi))
        return f"and {step[pose]:.4g} rad from pose {pose} to the next, more than half a turn"
    if np.abs(turn).max() > FASTEST_TURN:
        pose = int(np.argmax(np.abs(turn) > FASTEST_TURN))
        return f"and {abs(turn[pose]):.4g} rad in the second after pose {pose}"
    way = x + 1j * y
    along = [abs(way @ np.exp(-1j * angle)) for angle in (heading, 0.0 * heading, np.radians(heading))]
    radians, one_heading, degrees = np.abs(way).sum() * (1.0 + 1e-9) - np.array(along)  # of a straight way, rounding
    return "and as degrees they point along the way" if degrees < UNEXPLAINED * min(radians, one_heading) else ""


def _numbers(words: Sequence[str], count: int, number: int, mend: str) -> list[float]:
    """Numbers of one line of a recording; an error unless there are `count` finite ones."""
    try:
        row = [parse_number(word) for word in words]
    except ValueError:
        row = []
    if len(row) != count or not np.isfinite(row).all():
        amount = {8: "eight"}.get(count, str(count))
        given = ", ".join(word.strip()[:20] for word in words[:9])
        raise Fault(f"line {number} of the trajectory is not {amount} finite numbers ({given})", mend)
    return row


def _checked(time: Floats, position: Floats) -> tuple[Floats, Floats]:
    """Check that times and positions can be those of recorded poses, and return them as they are."""
    if np.abs(time).max() > MAX_TIME:
        mend = "give seconds, or end the name of a CSV column in its unit: time_ns"
        raise Fault(f"a time of {time[np.argmax(np.abs(time))]:.3g} s in the trajectory", mend)
    step = np.diff(time)
    if (step <= 0.0).any():
        pose = int(np.argmax(step <= 0.0)) + 1
        raise Fault(f"time does not grow at pose {pose} ({time[pose]} s)", "sort the poses and drop repeated ones")
    odd = (step < SMALLEST) | (step > MAX_STEP)
    if odd.any():
        pose = int(np.argmax(odd)) + 1
        mend = f"give steps of {SMALLEST:g} to {MAX_STEP:g} s: cut the file at a gap, thin it out where it is too dense"
        raise Fault(f"{step[pose - 1]:.3g} s from the pose before to pose {pose}", mend)
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
        pose, mend = int(np.argmax(tilt > MAX_TILT)), "give rotations about z only (qx = qy = 0), qw last"
        raise Fault(f"pose {pose} is tilted", mend)
    return np.asarray(2.0 * np.arctan2(z, w))
