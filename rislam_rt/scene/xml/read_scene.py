"""Reading of a Mitsuba or Sionna RT scene file (XML) as meshes with names and materials."""

import importlib.util
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import SceneError
from rislam_rt.model import Material
from rislam_rt.scene.check.triangle_array import without_area
from rislam_rt.scene.findings import Fault, one_line
from rislam_rt.scene.meshes import MAX_FACES, Mesh
from rislam_rt.scene.xml.materials import read_material
from rislam_rt.scene.xml.shapes import clip_mesh, shape_mesh
from rislam_rt.scene.xml.untrusted_xml import MAX_XML_BYTES, children, parse_xml

SIONNA = "sionna:"
"""Prefix of a source's name that is one of the scenes which Sionna brings along."""
PICTURE_ONLY = ("default", "integrator", "sensor", "emitter", "film", "texture", "medium", "path", "string", "float",
                "integer", "boolean", "rgb", "spectrum", "sampler")  # fmt: skip
"""Elements of an XML scene file that only a camera needs, and that are passed over."""
MAX_NAME = 64
"""Most characters of a reflector's name."""


@dataclass(frozen=True, slots=True, eq=False)
class XmlPart:
    """One shape of a Mitsuba or Sionna scene file: name, mesh and material."""

    name: str
    mesh: Mesh
    """In the room's frame [m]."""
    material: Material | None
    """None where it only hides: an absorber, or a slab of air."""


@dataclass(slots=True)
class XmlScene:
    """Shapes of a Mitsuba or Sionna scene file (XML) that a radio sees, and notes on what was left out."""

    parts: list[XmlPart] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """What was left out or changed, each in one line."""


def find_xml(source: str) -> Path:
    """Path of the XML scene file to read that a source names: a path, or `sionna:NAME` for one of Sionna RT's own.

    Raises
    ------
    SceneError
        No such scene or file; the line says which there are.
    """
    if not source.startswith(SIONNA):
        path = Path(source)
        if path.exists() and not path.is_file():
            what = "is a folder" if path.is_dir() else "is a pipe or a device"
            raise SceneError(f"{source[:120]}: {what}; give an XML scene, the file itself")
        if not path.is_file():
            raise SceneError(f"{source[:120]}: no such file; give an XML scene, or {SIONNA}NAME for one of Sionna's")
        return path
    name, known = source.removeprefix(SIONNA), sionna_scenes()
    if name not in known:
        there = f"give one of {', '.join(known)}" if known else "install sionna-rt, which brings them"
        raise SceneError(f"--from: Sionna has no scene '{one_line(name)[:40]}'; {there}")
    return known[name]


def sionna_scenes() -> dict[str, Path]:
    """Paths of the scene files that the installed Sionna RT brings along, by name; it is not imported for that."""
    found = importlib.util.find_spec("sionna")
    folders = [Path(place) / "rt" / "scenes" for place in (found.submodule_search_locations or ())] if found else []
    return {file.stem: file for folder in folders for file in sorted(folder.glob("*/*.xml"))}


def read_xml(path: Path, max_faces: int = MAX_FACES, window: Floats | None = None) -> XmlScene:
    """Read the shapes of a Mitsuba or Sionna scene file, with radio materials; of a window, what lies in it.

    Parameters
    ----------
    max_faces
        Of all shapes together, before the window.
    window
        (2, 2) lowest and highest x and y [m].

    Raises
    ------
    SceneError
        The file or something in it cannot be used; one line with file, element and how to mend it.
    """
    where = ""
    try:
        root = _root(path)
        materials, found = _XmlMaterials(root), XmlScene()
        count = 0
        for number, shape in enumerate(_shapes(root)):
            identity = one_line(shape.get("id") or shape.get("name") or f"shape_{number}")
            where = f"shape '{identity[:60]}'"
            mesh = shape_mesh(shape, path.parent, max_faces)
            count += len(mesh.faces)
            if count > max_faces:
                part = f"the first {number + 1} of {sum(1 for _ in _shapes(root))} shapes"
                mend = "take a part: --within x0,y0,x1,y1 keeps what lies in that window of the plan [m]"
                raise Fault(f"more than {max_faces} faces in {part}", mend)
            _take(found, identity, mesh if window is None else clip_mesh(mesh, window), materials.of(shape))
        where = ""
        if not found.parts:
            where_not = "no shape in it" if window is None else "no shape within the window"
            raise Fault(where_not, "give a scene with at least one mesh there")
    except Fault as fault:
        raise SceneError(fault.at(str(path), where).line) from None
    found.notes[:0] = materials.notes
    return found


class _XmlMaterials:
    """Materials of an XML scene file by their names, each read when a shape asks for it."""

    def __init__(self, root: Element) -> None:
        self._elements = {bsdf.get("id", ""): bsdf for bsdf in children(root, "bsdf")}
        self._alias = {e.get("as", ""): e.get("id", "") for e in children(root, "alias")}
        self._read: dict[str, Material | None] = {}
        self.notes: list[str] = []

    def of(self, shape: Element) -> Material | None:
        """Material of a shape of an XML scene: its own, or the one that it refers to; None where nothing reflects."""
        for own in children(shape, "bsdf"):
            return self._noted(own)
        for reference in children(shape, "ref"):
            name = reference.get("id", "")
            name = self._alias.get(name, name)
            if name not in self._elements:
                raise Fault(f"it refers to '{one_line(name)[:40]}', which the file does not define", "add that <bsdf>")
            if name not in self._read:
                self._read[name] = self._noted(self._elements[name])
            return self._read[name]
        raise Fault("it has no material", "add <ref id=...> to a <bsdf>, e.g. of type itu-radio-material")

    def _noted(self, bsdf: Element) -> Material | None:
        """Read a material of an XML scene file, and keep the notes on it."""
        material, notes = read_material(bsdf)
        self.notes += notes
        return material


def _root(path: Path) -> Element:
    """Root element of a Mitsuba or Sionna scene file."""
    try:
        with path.open("rb") as file:
            content = file.read(MAX_XML_BYTES + 1)
    except OSError as error:
        raise Fault(f"cannot be read ({error.strerror})", "check the file and its permissions") from None
    root = parse_xml(content)
    if root.tag != "scene":
        raise Fault(f"it begins with <{one_line(str(root.tag))[:40]}>", "give a scene file of Mitsuba 3 or Sionna RT")
    return root


def _shapes(parent: Element) -> Iterator[Element]:
    """All shapes of an XML scene file in order, those within a `merge` too; a Fault for an element of no meaning."""
    for element in parent:
        if element.tag == "shape" and element.get("type") == "merge":
            yield from _shapes(element)
        elif element.tag == "shape":
            yield element
        elif element.tag == "include":
            name = one_line(element.get("filename", ""))[:60]
            raise Fault(f"<include filename='{name}'>: other files are not followed", "put its content in its place")
        elif element.tag not in (*PICTURE_ONLY, "bsdf", "alias"):
            name = one_line(str(element.tag))[:40]
            raise Fault(f"an element <{name}>, which means nothing here", "delete it, or make it shapes and bsdfs")


def _take(found: XmlScene, identity: str, mesh: Mesh, material: Material | None) -> None:
    """Add a shape of an XML scene file under a name of its own, without faces that are no more than a line."""
    bad = without_area(mesh.triangles)
    if bad.any():
        found.notes.append(f"{identity}: {int(bad.sum())} faces without area left out")
    if not bad.all():
        used, compact = np.unique(mesh.faces[~bad], return_inverse=True)
        faces = compact.reshape(-1, 3).astype(np.int64)
        name = _free_name(identity.removeprefix("mesh-"), {part.name for part in found.parts})
        found.parts.append(XmlPart(name, Mesh(mesh.vertices[used], faces), material))


def _free_name(wanted: str, taken: set[str]) -> str:
    """Name of a reflector read from an XML scene file: letters, digits, `_`, `-` and `.`, and nobody else's name."""
    plain = re.sub(r"[^\w.\-]", "_", wanted)[:MAX_NAME]
    plain = plain if re.search(r"\w", plain) else "shape"
    name, number = plain, 1
    while name in taken:
        number += 1
        tail = f"_{number}"
        name = plain[: MAX_NAME - len(tail)] + tail
    return name
