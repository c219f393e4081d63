"""Floor plans drawn as SVG: lines and closed shapes, told apart by their names, classes or layers."""

import re
import xml.etree.ElementTree as Tree
from collections.abc import Iterator

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.findings import Fault, one_line
from rislam_rt.scene.importing.floor_plans.floor_plan import PlanShape

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_STEP = re.compile(r"([A-Za-z])([^A-Za-z]*(?:[eE][-+]?\d[^A-Za-z]*)*)")
_TRANSFORM = re.compile(r"(\w+)\s*\(([^)]*)\)")
_WORDS = {
    "door": ("door", "doors", "tür", "türen", "porte"),
    "window": ("window", "windows", "fenster"),
    "wall": ("wall", "walls", "wand", "wände", "partition"),
    "room": ("room", "rooms", "zimmer", "raum", "space"),
}
_SHAPES = ("rect", "polygon", "polyline", "line", "path")
_NAMES = ("class", "id", "label", "data-kind")
_KEYS = ("material", "open", "bottom", "top", "name")
_REFUSED = {
    "circle": "a circle; draw it as a polygon, or leave it out",
    "ellipse": "an ellipse; draw it as a polygon, or leave it out",
    "use": "a copy of another shape ('use'); make it a shape of its own (Inkscape: unlink clones)",
    "svg": "a drawing within the drawing; ungroup it, or save it as plain SVG",
}
_HIDDEN = re.compile(r"display\s*:\s*none")
_DEEPEST = 200


def parse_svg(content: bytes) -> list[PlanShape]:
    """Parse an SVG drawing into the shapes of a floor plan, y turned up, its lower left corner at zero.

    A shape is a room, wall, door or window by the words in its `class`, `id`, label or `data-kind`, or those of the
    groups around it; without any, closed shapes are rooms and open ones walls. `data-material`, `data-open`,
    `data-bottom` and `data-top` say more. What is not displayed is not there.

    Raises
    ------
    Fault
        Not SVG, a shape with curves, or one that is drawn by reference.
    """
    if b"<!ENTITY" in content.replace(b"\0", b""):  # in UTF-16 as well
        raise Fault("the drawing defines entities", "save it as plain SVG")
    try:
        root = Tree.fromstring(content)
    except (Tree.ParseError, ValueError, LookupError) as error:
        raise Fault(f"not readable SVG ({one_line(str(error))[:60]})", "export it again as plain SVG") from None
    if not str(root.tag).endswith("svg"):
        raise Fault(f"'{one_line(str(root.tag))[:30]}' is no SVG drawing", "export it as plain SVG")
    with np.errstate(invalid="ignore", over="ignore"):  # what is no number is refused with its shape's name
        shapes = list(_walk(root, np.eye(3), "", 0))
        if not shapes:
            raise Fault("the drawing has no lines", "draw rooms as closed shapes, walls, doors and windows as lines")
        points = np.concatenate([shape.points for shape in shapes])
        left, bottom = points[:, 0].min(), points[:, 1].max()
        return [shape._replace(points=(shape.points - [left, bottom]) * [1.0, -1.0]) for shape in shapes]


def _walk(element: Tree.Element, matrix: Floats, inherited: str, depth: int) -> Iterator[PlanShape]:
    """Shapes of a floor plan in an SVG element and those within, by the transforms and kinds of their groups."""
    if depth > _DEEPEST:
        raise Fault(f"groups {_DEEPEST} deep", "save it as plain SVG")
    tag = str(element.tag).rpartition("}")[2]
    if tag in ("defs", "clipPath", "mask", "symbol", "marker", "pattern", "metadata"):
        return
    if element.get("display", "").strip() == "none" or _HIDDEN.search(element.get("style", "")):
        return
    if tag in _REFUSED and depth > 0:
        raise Fault(*_REFUSED[tag].split("; "))
    matrix = matrix @ _matrix(element.get("transform", ""))
    kind = _kind(element) or inherited
    if tag in _SHAPES:
        about = {key: element.get(f"data-{key}") for key in _KEYS if element.get(f"data-{key}") is not None}
        for points, closed in _outline(tag, element):
            ends = np.column_stack([points, np.ones(len(points))]) @ matrix.T
            yield PlanShape(kind or ("room" if closed else "wall"), ends[:, :2], closed, about)
    for child in element:
        yield from _walk(child, matrix, kind, depth + 1)


def _kind(element: Tree.Element) -> str:
    """Kind of a floor plan's shape, by the first word for one in an SVG element's own names; empty if there is none."""
    own = " ".join(value for key, value in element.attrib.items() if key.rpartition("}")[2] in _NAMES)
    words = set(re.split(r"[\W\d_]+", own.lower()))
    return next((kind for kind, known in _WORDS.items() if words & set(known)), "")


def _outline(tag: str, element: Tree.Element) -> Iterator[tuple[Floats, bool]]:
    """Points (n, 2) of an SVG shape of a floor plan, and whether it is closed."""
    if tag == "path":
        yield from _path(element.get("d", ""))
        return
    if tag == "rect":
        if any(_length(element, key) > 0.0 for key in ("rx", "ry") if element.get(key, "auto").strip() != "auto"):
            raise Fault("a rectangle with round corners", "take its rx and ry away")
        x, y, w, h = (_length(element, key) for key in ("x", "y", "width", "height"))
        if w > 0.0 and h > 0.0:
            yield np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]]), True
        return
    if tag == "line":
        yield np.array([_length(element, key) for key in ("x1", "y1", "x2", "y2")]).reshape(2, 2), False
        return
    numbers = [float(word) for word in _NUMBER.findall(element.get("points", ""))]
    if len(numbers) % 2 or len(numbers) < 4:
        raise Fault(f"a {tag} of {len(numbers)} numbers", "give x,y pairs")
    yield np.array(numbers).reshape(-1, 2), tag == "polygon"


def _length(element: Tree.Element, key: str) -> float:
    """Number in an attribute of an SVG element."""
    text = element.get(key, "0")
    found = _NUMBER.fullmatch(text.strip().removesuffix("px"))
    if found is None:
        raise Fault(f"{key} = '{one_line(text)[:30]}'", "give numbers in the drawing's units, without a unit")
    return float(found[0])


def _path(text: str) -> Iterator[tuple[Floats, bool]]:
    """Straight parts of an SVG path of a floor plan: (points (n, 2), closed)."""
    here = np.zeros(2)
    points: list[Floats] = []
    for letter, rest in _STEP.findall(text):
        numbers = [float(word) for word in _NUMBER.findall(rest)]
        key, relative = letter.upper(), letter.islower()
        if key == "Z":
            if len(points) > 1:
                yield np.array(points), True
            here, points = (points[0] if points else here), points[:1]
            continue
        if key not in "MLHV":
            raise Fault(f"a path with curves ('{letter}')", "draw with straight lines (Inkscape: flatten Beziers)")
        if key in "HV":
            axis = "HV".index(key)
            steps = [np.array([n, 0.0] if axis == 0 else [0.0, n]) for n in numbers]
            keep = np.array([0.0, 1.0] if axis == 0 else [1.0, 0.0])
        else:
            steps, keep = [np.array(pair) for pair in zip(numbers[::2], numbers[1::2], strict=False)], np.zeros(2)
        for count, step in enumerate(steps):
            here = here + step if relative else here * keep + step
            if key == "M" and count == 0:
                if len(points) > 1:
                    yield np.array(points), False
                points = []
            points.append(here)
    if len(points) > 1:
        yield np.array(points), False


def _matrix(text: str) -> Floats:
    """Matrix (3, 3) of an SVG element's `transform` attribute."""
    total = np.eye(3)
    for name, rest in _TRANSFORM.findall(text):
        n = [float(word) for word in _NUMBER.findall(rest)]
        part = np.eye(3)
        if name == "matrix" and len(n) == 6:
            part[:2] = np.array(n).reshape(3, 2).T
        elif name == "translate" and n:
            part[:2, 2] = [n[0], n[1] if len(n) > 1 else 0.0]
        elif name == "scale" and n:
            part[0, 0], part[1, 1] = n[0], n[-1]
        elif name == "rotate" and n:
            c, s = np.cos(np.radians(n[0])), np.sin(np.radians(n[0]))
            part[:2, :2] = [[c, -s], [s, c]]
            if len(n) == 3:
                part[:2, 2] = np.array(n[1:]) - part[:2, :2] @ np.array(n[1:])
        else:
            raise Fault(f"transform '{one_line(name)[:20]}'", "apply the transforms, or save as plain SVG")
        total = total @ part
    return total
