"""Import of a mesh of a whole room, parted into walls, objects and clutter, and a report of what became of it."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.constants import COPLANAR_ANGLE, COPLANAR_OFFSET
from rislam_rt.geometry.plane_segmentation import planar_regions
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.importing.free_space import find_free, is_seen
from rislam_rt.scene.importing.import_options import ImportOptions
from rislam_rt.scene.importing.materials import MaterialAssignment, itu_by_word
from rislam_rt.scene.importing.mesh_source import MeshPart, read_source
from rislam_rt.scene.importing.part_names import numbered, plain_name, wall_name
from rislam_rt.scene.importing.placement import place_parts
from rislam_rt.scene.importing.regions.flat_regions import FlatRegions, find_facets, weld
from rislam_rt.scene.importing.regions.region_groups import RegionGroup, find_pieces, spans_room
from rislam_rt.scene.importing.regions.round_surfaces import find_round
from rislam_rt.scene.importing.regions.surfaces import SortedSurfaces, Surface, sort_regions
from rislam_rt.scene.importing.room_draft import RoomDraft
from rislam_rt.scene.importing.scans.scan_room import looks_scanned, sort_scan
from rislam_rt.scene.meshes import Mesh, as_mesh, joined


def import_mesh(path: Path, options: ImportOptions) -> RoomDraft:
    """Import a mesh file as the draft of a room, by flat regions or a scan's planes: reflectors, materials, occluders.

    Raises
    ------
    Fault
        The file cannot be read, is of no room's size, or has nothing that reflects.
    ConfigError
        A material was given for a name that nothing has.
    """
    parts, notes = read_source(path)
    placed, more = place_parts(parts, path.suffix.lower(), options)
    facets = find_facets(weld(placed))
    if not len(facets.area):
        raise Fault("no triangle of the file has an area", "export it again")
    if options.scan or (options.scan is None and looks_scanned(facets, options)):
        found, about = sort_scan(facets.mesh, options)
        pieces = [RegionGroup("", "", np.zeros(0, dtype=np.int64))]
    else:
        pieces, about = find_pieces(facets, [part.node for part in parts]), []
        found = sort_regions(facets, pieces, find_round(facets), options)
    if not found.surfaces:
        what = f"nothing in it is flat and wider than {100 * found.narrow:.2g} cm"
        raise Fault(what, "check --units, or lower --detail")
    surfaces, hidden = _visible_surfaces(found)
    unseen = _unseen(hidden, pieces, parts)
    palette = MaterialAssignment(options.materials, options.rest, 1e9 * options.carrier_ghz)
    reflectors = _reflectors(surfaces, pieces, parts, palette)
    occluders = _occluders(found, pieces, list(reflectors))
    palette.check_used([*reflectors, *sorted({p.material for p in parts if p.material})])
    said = _summary(facets, found, surfaces, unseen, reflectors, occluders, options, scanned=bool(about))
    return RoomDraft(reflectors, occluders, [*notes, *more, *about, *said, *palette.remarks()])


def _visible_surfaces(found: SortedSurfaces) -> tuple[list[Surface], list[Surface]]:
    """Surfaces of a mesh that an agent in the room can see, and the others, as outer skins."""
    triangles = np.concatenate([s.mesh.triangles for s in found.surfaces] + [c.triangles for c in found.clutter])
    free = find_free(triangles)
    if free is None:
        return found.surfaces, []
    seen = is_seen(free.stations, [s.mesh.triangles for s in found.surfaces], triangles)
    kept, hidden = ([found.surfaces[k] for k in np.flatnonzero(seen == wanted)] for wanted in (True, False))
    return (kept, hidden) if kept else (found.surfaces, [])


def _unseen(hidden: list[Surface], pieces: list[RegionGroup], parts: list[MeshPart]) -> list[str]:
    """Report of an import: which surfaces are left out because nobody inside can see them, the widest by name."""
    if not hidden:
        return []
    corners = np.concatenate([s.mesh.vertices for s in hidden])
    room = np.stack([corners.min(axis=0), corners.max(axis=0)])
    area: dict[str, float] = {}
    for s in hidden:
        own = pieces[s.piece].name or plain_name(parts[s.part].node)
        name = own or wall_name(s.normal, s.mesh.triangles.mean(axis=(0, 1)), room)
        area[name] = area.get(name, 0.0) + s.area
    few = ", ".join(f"{name} {area[name]:.3g}" for name in sorted(area, key=lambda name: -area[name])[:6])
    more = f" and {len(area) - 6} more" if len(area) > 6 else ""
    return [f"{sum(area.values()):.3g} m^2 are left out that nobody inside can see: {few}{more}"]


def _reflectors(
    surfaces: list[Surface], pieces: list[RegionGroup], parts: list[MeshPart], palette: MaterialAssignment
) -> dict[str, tuple[Mesh, dict[str, Any]]]:
    """Reflectors of an imported mesh by name: each wall of the room's shell by itself, each object as one."""
    shell = sorted((s for s in surfaces if s.piece == 0), key=lambda s: -s.area)
    corners = np.concatenate([s.mesh.vertices for s in surfaces if s.piece == 0 or not shell])
    room = np.stack([corners.min(axis=0), corners.max(axis=0)])
    uses = [plain_name(parts[s.part].node) for s in shell]
    entries: list[tuple[str, Mesh, int]] = []
    own_names = _own_names(shell, uses, room)
    given = [node in own_names for node in uses]
    for surface, node, own in zip(shell, uses, given, strict=True):
        middle = surface.mesh.triangles.mean(axis=(0, 1))
        place = wall_name(surface.normal, middle, room)
        if itu_by_word(parts[surface.part].material) == "glass":
            place = place.replace("wall", "window")
        entries.append((node if own else place, surface.mesh, surface.part))
    for number, piece in enumerate(pieces[1:], start=1):
        mine = [s for s in surfaces if s.piece == number]
        for part in sorted({s.part for s in mine}):
            entries.append((piece.name, joined([s.mesh for s in mine if s.part == part]), part))
            given.append(bool(piece.node))
    names = numbered([name for name, _, _ in entries], given)
    found = {}
    for name, (_, mesh, number) in zip(names, entries, strict=True):
        found[name] = (mesh, palette.material(name, parts[number].node, parts[number].material))
    return found


def _own_names(shell: list[Surface], uses: list[str], room: Floats) -> set[str]:
    """Names of an imported mesh's nodes, `uses` those of each surface of the shell, that its surfaces keep: of nodes
    that are one surface, or span less than the room (2, 3) [m], as the reveal of a door."""
    named = set()
    for node in set(uses) - {""}:
        corners = np.concatenate([s.mesh.vertices for s, use in zip(shell, uses, strict=True) if use == node])
        if uses.count(node) == 1 or not spans_room(np.stack([corners.min(axis=0), corners.max(axis=0)]), room):
            named.add(node)
    return named


def _occluders(found: SortedSurfaces, pieces: list[RegionGroup], taken: list[str]) -> dict[str, Mesh]:
    """Occluders of an imported mesh by name: its clutter, by the object that it belongs to."""
    by_piece: dict[int, list[Floats]] = {}
    for clutter in found.clutter:
        by_piece.setdefault(clutter.piece, []).append(clutter.triangles)
    names = [f"{pieces[piece].name or 'room'}_clutter" for piece in by_piece]
    names = numbered([*taken, "ris", *names])[len(taken) + 1 :]
    return {name: as_mesh(np.concatenate(triangles)) for name, triangles in zip(names, by_piece.values(), strict=True)}


def _summary(
    facets: FlatRegions, found: SortedSurfaces, surfaces: list[Surface], unseen: list[str], reflectors: dict[str, Any],
    occluders: dict[str, Mesh], options: ImportOptions, *, scanned: bool,
) -> list[str]:  # fmt: skip
    """Report of an import: numbers, areas and errors of what became of a mesh, one line each."""
    parted = (planar_regions(mesh.triangles, COPLANAR_ANGLE, COPLANAR_OFFSET) for mesh, _ in reflectors.values())
    walls = sum(len(regions.offset) for regions in parted)
    total, waves = float(facets.area.sum()), found.narrow / options.wavelength
    triangles = sum(len(mesh.faces) for mesh in occluders.values())
    mirror = sum(s.area for s in surfaces)
    remarks = [
        f"{len(facets.mesh.faces)} triangles, {total:.4g} m^2: {walls} walls of {mirror:.4g} m^2 in {len(reflectors)} "
        f"reflectors, {len(occluders)} occluders of {triangles} triangles",
        f"walls are within {max(1e3 * max(s.error for s in surfaces), 0.01):.2g} mm of the mesh",
    ]
    if found.shading:
        width = f"{100 * found.narrow:.2g} cm ({waves:.2g} wavelengths at {options.carrier_ghz:g} GHz)"
        narrow = f"narrower than {width}" + (" or round" if options.curved == "shade" else "")
        why = "that lie on no plane" if scanned else narrow
        remarks.append(f"{found.shading:.3g} m^2 {why} shade and do not reflect")
    if found.shade_error:
        how = f"corners joined in cells of {1e3 * found.cell:.2g} mm, moved {1e3 * found.shade_error:.2g} mm at most"
        remarks.append(f"clutter is thinned: {how}")
    alike = Counter((round(radius, 3), sides, round(error, 4)) for radius, sides, error in found.cylinders)
    for (radius, sides, error), count in alike.most_common(8):
        what = "reflect" if options.curved == "planes" else "shade (--curved planes: reflect)"
        many = "a cylinder" if count == 1 else f"each of {count} cylinders"
        off = f"{1e3 * error:.2g} mm"
        remarks.append(f"{many} of {radius:.3g} m became {sides} flat sides within {off} that {what}")
    if found.gone > 1e-4 * total:
        remarks.append(f"{found.gone:.3g} m^2 are left out: faces that stand on walls, things below the detail")
    remarks += unseen
    if found.narrow > options.narrow * (1.0 + 1e-9):
        remarks.append(f"the {options.max_walls} widest walls reflect (--max-walls)")
    return remarks
