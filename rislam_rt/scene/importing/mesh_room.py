"""Import of a mesh of a whole room, parted into walls, objects and clutter."""

from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.importing.free_space import find_free, is_seen
from rislam_rt.scene.importing.import_report import summarise_import
from rislam_rt.scene.importing.materials import MaterialAssignment, itu_by_word
from rislam_rt.scene.importing.mesh_source import MeshPart, read_source
from rislam_rt.scene.importing.options import ImportOptions
from rislam_rt.scene.importing.placement import place_parts
from rislam_rt.scene.importing.regions.flat_regions import FlatRegions, find_facets
from rislam_rt.scene.importing.regions.region_groups import (
    RegionGroup,
    find_pieces,
    numbered,
    place_free_name,
    wall_name,
)
from rislam_rt.scene.importing.regions.round_surfaces import find_round
from rislam_rt.scene.importing.regions.surfaces import SortedSurfaces, Surface, sort_regions
from rislam_rt.scene.importing.regions.welded_mesh import weld
from rislam_rt.scene.importing.room_draft import RoomDraft
from rislam_rt.scene.importing.scans.scan_room import looks_scanned, sort_scan
from rislam_rt.scene.meshes import Mesh, as_mesh
from rislam_rt.scene.shapes import joined


def import_mesh(path: Path, options: ImportOptions) -> RoomDraft:
    """Import a mesh file as the draft of a room.

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
    return build_draft(facets, parts, [*notes, *more], options)


def build_draft(facets: FlatRegions, parts: list[MeshPart], notes: list[str], options: ImportOptions) -> RoomDraft:
    """Draft of a room from a mesh, by its flat regions or a scan's planes: reflectors with materials, occluders."""
    if options.scan or (options.scan is None and looks_scanned(facets, options)):
        found, about = sort_scan(facets.mesh, options)
        pieces = [RegionGroup("", "", np.zeros(0, dtype=np.int64), True)]
    else:
        pieces, about = find_pieces(facets, [part.node for part in parts]), []
        found = sort_regions(facets, pieces, find_round(facets), options)
    if not found.surfaces:
        raise Fault(
            f"nothing in it is flat and wider than {100 * found.narrow:.2g} cm", "check --units, or lower --detail"
        )
    surfaces, unseen = _visible_surfaces(found)
    palette = MaterialAssignment(options.materials, options.rest)
    reflectors = _reflectors(surfaces, pieces, parts, palette)
    occluders = _occluders(found, pieces, list(reflectors))
    palette.check_used([*reflectors, *sorted({p.material for p in parts if p.material})])
    said = summarise_import(facets, found, surfaces, unseen, reflectors, occluders, options, scanned=bool(about))
    remarks = [*notes, *about, *said]
    return RoomDraft(reflectors, occluders, remarks + palette.remarks())


def _visible_surfaces(found: SortedSurfaces) -> tuple[list[Surface], float]:
    """Surfaces of a mesh that an agent in the room can see, and the area [m^2] of the others, as outer skins."""
    triangles = np.concatenate([
        *(s.mesh.triangles for s in found.surfaces), *(c.triangles for c in found.clutter)
    ])  # fmt: skip
    free = find_free(triangles, float(triangles[..., 2].min()))
    if free is None:
        return found.surfaces, 0.0
    seen = is_seen(free.stations, [s.mesh.triangles for s in found.surfaces], triangles)
    hidden = sum(surface.area for surface, visible in zip(found.surfaces, seen, strict=True) if not visible)
    kept = [surface for surface, visible in zip(found.surfaces, seen, strict=True) if visible]
    return (kept, hidden) if kept else (found.surfaces, 0.0)


def _reflectors(
    surfaces: list[Surface], pieces: list[RegionGroup], parts: list[MeshPart], palette: MaterialAssignment
) -> dict[str, tuple[Mesh, dict[str, Any]]]:
    """Reflectors of an imported mesh by name: each wall of the room's shell by itself, each object as one."""
    shell = sorted((s for s in surfaces if s.piece == 0), key=lambda s: -s.area)
    corners = np.concatenate([s.mesh.vertices for s in surfaces if s.piece == 0 or not shell])
    room = np.stack([corners.min(axis=0), corners.max(axis=0)])
    uses = [place_free_name(parts[s.part].node) for s in shell]
    entries: list[tuple[str, Mesh, int]] = []
    for surface, node in zip(shell, uses, strict=True):
        middle = surface.mesh.triangles.mean(axis=(0, 1))
        place = wall_name(surface.normal, middle, room)
        if itu_by_word(parts[surface.part].material) == "glass":
            place = place.replace("wall", "window")
        entries.append((node if node and uses.count(node) == 1 else place, surface.mesh, surface.part))
    for number, piece in enumerate(pieces[1:], start=1):
        mine = [s for s in surfaces if s.piece == number]
        for part in sorted({s.part for s in mine}):
            entries.append((piece.name, joined([s.mesh for s in mine if s.part == part]), part))
    names = numbered([name for name, _, _ in entries])
    found = {}
    for name, (_, mesh, number) in zip(names, entries, strict=True):
        material = palette.material(name, parts[number].node, parts[number].material)
        found[name] = (mesh, material)
    return found


def _occluders(found: SortedSurfaces, pieces: list[RegionGroup], taken: list[str]) -> dict[str, Mesh]:
    """Occluders of an imported mesh by name: its clutter, by the object that it belongs to."""
    by_piece: dict[int, list[Floats]] = {}
    for clutter in found.clutter:
        by_piece.setdefault(clutter.piece, []).append(clutter.triangles)
    names = [f"{pieces[piece].name or 'room'}_clutter" for piece in by_piece]
    names = numbered([*taken, "ris", *names])[len(taken) + 1 :]
    return {name: as_mesh(np.concatenate(triangles)) for name, triangles in zip(names, by_piece.values(), strict=True)}
