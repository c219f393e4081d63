"""Scene check, the part of meshes and point scatterers: names, degenerate and doubled faces, size, place."""

from collections import Counter
from collections.abc import Iterator

import numpy as np

from rislam_rt.scene.check.probe import touching
from rislam_rt.scene.check.triangle_array import MIN_CLEARANCE, TriangleArray, without_area
from rislam_rt.scene.findings import Finding


def name_errors(soup: TriangleArray) -> Iterator[Finding]:
    """Two parts of one name."""
    names = [r.name for r in soup.scene.reflectors] + list(soup.scene.landmarks)
    names += [shade.name for shade in soup.scene.shades]
    for name, count in Counter(names).items():
        if count > 1:
            yield soup.error("name", f"{count} parts are called '{name}'", "give every part a name of its own")


def face_errors(soup: TriangleArray) -> Iterator[Finding]:
    """Faces without area."""
    bad = without_area(soup.triangles)
    for number in np.unique(soup.owner[bad]):
        name, mine = soup.scene.reflectors[number].name, bad[soup.owner == number]
        message = f"{int(mine.sum())} faces without area, the first is face {int(np.argmax(mine))}"
        yield soup.error(f"reflector[{number}].mesh ({name})", message, "remove degenerate faces from the mesh")


def scatterer_errors(soup: TriangleArray) -> Iterator[Finding]:
    """Outside the meshes' bounds, on a surface, or larger than the room."""
    diagonal = float(np.linalg.norm(soup.bounds[1] - soup.bounds[0]))
    for number, scatterer in enumerate(soup.scene.scatterers):
        field, at = f"scatterer[{number}].position ({scatterer.name})", scatterer.position
        if scatterer.radius is not None and scatterer.radius > diagonal:
            message = f"{scatterer.radius:g} m, and the room measures {diagonal:.3g} m across"
            yield soup.error(f"scatterer[{number}].radius ({scatterer.name})", message, "give its radius in metres")
            continue
        if len(soup.outside(at[None])):
            yield soup.error(field, f"{at.tolist()} lies outside the meshes' bounds {_box(soup)}", "move it inside")
            continue
        _, near = touching(at[None], soup.triangles, MIN_CLEARANCE)
        if len(near):
            message = f"{at.tolist()} lies on '{soup.name(int(near[0]))}'"
            yield soup.error(field, message, f"keep {MIN_CLEARANCE * 1e3:g} mm away from surfaces")


def mesh_warnings(soup: TriangleArray) -> Iterator[Finding]:
    """A size in wrong units, doubled faces."""
    yield from _size(soup)
    yield from _coincident(soup)


def _size(soup: TriangleArray) -> Iterator[Finding]:
    diagonal = float(np.linalg.norm(soup.bounds[1] - soup.bounds[0]))
    if diagonal > 200.0 or diagonal < 0.2:
        guess = "millimetres" if diagonal > 200.0 else "kilometres"
        yield soup.warning(
            "reflector", f"the room measures {diagonal:.3g} m across", f"metres wanted: is it in {guess}?"
        )


def _coincident(soup: TriangleArray) -> Iterator[Finding]:
    """Doubled faces of one mesh; those of two meshes are for the check of walls."""
    corners = np.round(soup.triangles, 6) + 0.0
    order = np.lexsort(np.moveaxis(corners, -1, 0)[::-1], axis=-1)
    keys = np.take_along_axis(corners, order[..., None], axis=1).reshape(len(corners), 9)
    _, first, count = np.unique(np.column_stack([keys, soup.owner]), axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        name = soup.name(int(first[np.argmax(count > 1)]))
        message = f"{int((count - 1).sum())} faces lie exactly on others of their mesh, the first in '{name}'"
        yield soup.warning("reflector", message, "leave the doubles out")


def _box(soup: TriangleArray) -> str:
    low, high = np.round(soup.bounds, 3).tolist()
    return f"{low} to {high}"
