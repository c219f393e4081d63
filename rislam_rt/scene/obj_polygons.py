"""Faces of OBJ files, rewritten as triangles where a reader would not give what is drawn."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from rislam_rt.scene.findings import Fault, one_line
from rislam_rt.scene.mesh_polygons import MEND, PolygonFault, covered_by_fan, is_fan, polygon_triangles

_COUNTED = re.compile(rb"^f[^\n]*[ \t]-\d|^f[^\n]*#|^[ \t]+[fv][ \t]|\\\n", re.MULTILINE)
"""Where an OBJ file has corners counted backwards, comments behind faces, indented or continued lines."""
_CUT = re.compile(rb"^[ \t]*f(?:[ \t]+[^\s#]+){4}", re.MULTILINE)
"""Where an OBJ file has polygons."""
LONGEST = 40
"""Most digits of a number in an OBJ file of many that are read at once: each takes as much memory as the longest."""


def obj_with_triangles(content: bytes) -> bytes:
    """Content of an OBJ file, rewritten where a reader that fans its faces would not give the faces drawn in it.

    Faces that a fan does not cover become triangles, corners counted backwards are numbered from the first; lines
    lose what continues, indents and comments them. A file without such faces keeps its lines.

    Raises
    ------
    Fault
        A corner or a face cannot be read, or a face crosses itself.
    """
    content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if not _CUT.search(content) and not _COUNTED.search(content):
        return content
    if _plainly_covered(content):
        return content
    lines = content.replace(b"\\\n", b" ").split(b"\n")
    words_of = [line.partition(b"#")[0].split() for line in lines]
    total = sum(words[:1] == [b"v"] for words in words_of)
    points: list[list[float]] = []
    polygons: list[list[int]] = []
    places: list[int] = []
    for number, words in enumerate(words_of):
        key = words[0] if words else b""
        try:
            if key == b"v":
                points.append(obj_point(words[1:]))
            elif key == b"f":
                polygon = obj_corners(words[1:], len(points), total)
                if polygon:
                    polygons.append(polygon)
                    places.append(number)
                else:
                    words = []
        except ValueError as error:
            raise unreadable_line(number, error) from None
        if key in (b"v", b"f"):
            lines[number] = b" ".join(words)
    corners = np.array(points, dtype=np.float64).reshape(-1, 3)
    if not np.isfinite(corners).all():
        return content  # what is not finite is told of the mesh
    try:
        cuts = polygon_triangles(corners, polygons)
    except PolygonFault as fault:
        raise Fault(f"line {places[fault.number] + 1}: a face {fault.what}", MEND) from None
    for number, polygon, cut in zip(places, polygons, cuts, strict=True):
        whole = is_fan(cut, len(polygon))
        if whole and b"-" not in lines[number]:
            continue
        words = [b"%d%s%s" % (corner + 1, *word.partition(b"/")[1:])
                 for corner, word in zip(polygon, lines[number].split()[1:], strict=True)]  # fmt: skip
        rows = [range(len(words))] if whole else cut
        lines[number] = b"\n".join(b" ".join([b"f", *(words[i] for i in row)]) for row in rows)
    return b"\n".join(lines)


def _plainly_covered(content: bytes) -> bool:
    """Whether fans cover all faces of an OBJ file without any of the lines that are to be cleaned: read at once.

    False also where a line is anything but a keyword and numbers, or a corner is not there.
    """
    if b"\t" in content or _COUNTED.search(content):
        return False
    heads, faces = (re.findall(rb"^%s (.*)$" % key, content, re.MULTILINE) for key in (b"v", b"f"))
    numbers = re.sub(rb"/\S*", b"", b" \n".join(faces))
    sizes = np.array([len(line.split()) for line in numbers.split(b"\n")])
    words = (b" ".join(heads).split(), numbers.split())
    if max(max(map(len, some), default=0) for some in words) > LONGEST:
        return False
    try:
        points = np.array(words[0]).astype(np.float64).reshape(len(heads), 3)
        corners = np.array(words[1]).astype(np.int64) - 1
    except (ValueError, OverflowError):
        return False
    if sizes.min() < 3 or corners.min() < 0 or corners.max() >= len(points) or not np.isfinite(points).all():
        return False
    starts = np.cumsum(sizes) - sizes
    return all(
        covered_by_fan(points[corners[starts[sizes == size][:, None] + np.arange(size)]]).all()
        for size in np.unique(sizes)
        if size > 3
    )


def obj_point(words: Sequence[bytes | str]) -> list[float]:
    """Position of a corner in an OBJ file; a ValueError where it has no three numbers."""
    if len(words) < 3:
        raise ValueError("three numbers wanted")
    return [float(word) for word in words[:3]]


def obj_corners(words: Sequence[bytes | str], count: int, total: int) -> list[int]:
    """Corner numbers of a face in an OBJ file, from 0; negative ones count from the last of the `count` so far.

    None of a face of fewer than three. A ValueError where one is no number or names none of the file's `total`.
    """
    if len(words) < 3:
        return []
    slash: Any = b"/" if isinstance(words[0], bytes) else "/"
    numbers = [int(word.partition(slash)[0]) for word in words]
    if min(numbers) > 0 and max(numbers) <= total:
        return [n - 1 for n in numbers]
    for n in numbers:
        if n == 0 or n > total or n < -count:
            raise ValueError(f"a face names corner {n} of {total if n > 0 else count}")
    return [n - 1 if n > 0 else count + n for n in numbers]


def unreadable_line(number: int, error: ValueError) -> Fault:
    """Fault of a line of an OBJ file, its number from 0."""
    return Fault(f"line {number + 1} cannot be read ({one_line(str(error))[:60]})", "export it again")
