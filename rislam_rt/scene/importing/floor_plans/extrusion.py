"""Extrusion of a floor plan to walls, floor and ceiling: doors and windows are cut out, and closed where they are."""

from itertools import pairwise
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.input_messages import counted
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.importing.floor_plans.floor_plan import FloorPlan, Opening
from rislam_rt.scene.importing.floor_plans.wall_lines import SAME_LINE, Line, Spans, wall_lines, without_span
from rislam_rt.scene.importing.import_options import ImportOptions
from rislam_rt.scene.importing.materials import MaterialAssignment
from rislam_rt.scene.importing.part_names import compass_side, numbered, plain_name
from rislam_rt.scene.importing.room_draft import RoomDraft
from rislam_rt.scene.meshes import Mesh, as_mesh, joined
from rislam_rt.scene.polygons import inside_loop, triangulate
from rislam_rt.scene.shapes import quad

THICKEST = 0.6
"""Thickest wall [m]: an opening goes through all parallel walls this near, as both faces of a thick wall are."""
ALONG = np.radians(5.0)
"""Largest angle [rad] between an opening of a floor plan and the wall that it goes through."""

Entry = tuple[str, Mesh, dict[str, Any] | None]
"""Name, mesh and own material of a reflector that was extruded."""


def extrude(plan: FloorPlan, height: float, options: ImportOptions) -> RoomDraft:
    """Extrude a floor plan to a room of a given height [m].

    Raises
    ------
    Fault
        An opening lies on no wall, or a material was given for a name that nothing has.
    """
    lines = wall_lines(plan)
    cuts = [_cut_lines(opening, lines) for opening in plan.openings]
    entries: list[Entry] = []
    flat = _floor_triangles(plan, lines)
    thresholds: dict[float, list[Mesh]] = {0.0: [], height: []}
    for opening, cut in zip(plan.openings, cuts, strict=True):
        if len(cut) > 1:
            frame = _frame(opening, [lines[n] for n in cut], thresholds)
            if frame:
                entries.append((f"{opening.name}_frame", joined(frame), None))
        if opening.material is not None:
            line = min((lines[n] for n in cut), key=lambda k: float(np.abs(k.distance(opening.ends)).mean()))
            low, high = _reach(opening, line)
            entries.append((opening.name, _rectangle(line, low, high, opening.bottom, opening.top), opening.material))
    walls: list[Entry] = []
    for number, line in enumerate(lines):
        holes = [o for o, cut in zip(plan.openings, cuts, strict=True) if number in cut]
        cells = _cells(line, [(*_reach(o, line), o.bottom, o.top) for o in holes], height)
        if cells:
            walls.append((_line_name(line, plan), joined(cells), line.material))
    levels: list[Entry] = []
    for name, level in (("floor", 0.0), ("ceiling", height)):
        whole = as_mesh(np.concatenate([flat, np.full((*flat.shape[:2], 1), level)], axis=-1))
        levels.append((name, as_mesh(joined([whole, *thresholds[level]]).triangles), None))
    return _named([*levels, *walls, *entries], plan, options)


def _named(entries: list[Entry], plan: FloorPlan, options: ImportOptions) -> RoomDraft:
    """Draft of a room from extruded meshes, each with a name of its own and a material."""
    palette = MaterialAssignment(options.materials, options.rest, 1e9 * options.carrier_ghz)
    names = numbered([plain_name(name) or "wall" for name, _, _ in entries])
    reflectors = {}
    for name, (_, mesh, own) in zip(names, entries, strict=True):
        by_hand = palette.by_hand(name)
        reflectors[name] = (mesh, by_hand or own or palette.material(name, "", ""))
    palette.check_used(names)
    closed = sum(o.material is not None for o in plan.openings)
    remarks = [
        f"floor plan of {counted(len(plan.rooms), 'room')}: {counted(len(names), 'reflector')}, "
        f"{counted(len(plan.openings) - closed, 'opening')}, {closed} closed doors and windows"
    ]
    return RoomDraft(reflectors, {}, remarks + palette.remarks())


def _cut_lines(opening: Opening, lines: list[Line]) -> list[int]:
    """Numbers of the wall lines of an extruded floor plan that a door or window goes through."""
    along = (opening.ends[1] - opening.ends[0]) / np.linalg.norm(opening.ends[1] - opening.ends[0])
    near = []
    for number, line in enumerate(lines):
        turn = abs(float(line.along[0] * along[1] - line.along[1] * along[0]))
        low, high = _reach(opening, line)
        meets = any(a < high - 0.01 and low + 0.01 < b for a, b in line.spans)
        if turn < np.sin(ALONG) and meets:
            near.append((float(np.abs(line.distance(opening.ends)).max()), number))
    near = [pair for pair in sorted(near) if pair[0] < THICKEST]
    if not near:
        x, y = opening.ends.mean(axis=0)
        raise Fault(f"'{opening.name[:40]}' at {x:.2f},{y:.2f} m lies on no wall", "draw it along a wall")
    # a wall has two faces: what is farther than the second belongs to another one
    return [number for _, number in near[:2]]


def _reach(opening: Opening, line: Line) -> tuple[float, float]:
    """Interval [m] along a wall's line that a door or window of the floor plan takes."""
    low, high = sorted(float(x) for x in (opening.ends - line.start) @ line.along)
    return low, high


def _cells(line: Line, holes: list[tuple[float, float, float, float]], height: float) -> list[Mesh]:
    """Rectangles of an extruded wall about its openings (from, to, bottom, top) [m]."""
    found = []
    for low, high in line.spans:
        cuts = sorted({low, high, *(min(max(x, low), high) for hole in holes for x in hole[:2])})
        for a, b in pairwise(cuts):
            if b - a < 1e-6:
                continue
            open_here = [hole for hole in holes if hole[0] < 0.5 * (a + b) < hole[1]]
            solid: Spans = [(0.0, height)]
            for hole in open_here:
                solid = without_span(solid, hole[2], hole[3])
            found += [_rectangle(line, a, b, bottom, top) for bottom, top in solid]
    return found


def _rectangle(line: Line, low: float, high: float, bottom: float, top: float) -> Mesh:
    """Mesh of an upright rectangle of an extruded wall, between two places along its line [m] and two heights [m]."""
    return quad([line.at(low, bottom), line.at(high, bottom), line.at(high, top), line.at(low, top)])


def _frame(opening: Opening, lines: list[Line], thresholds: dict[float, list[Mesh]]) -> list[Mesh]:
    """Faces of the frame through a thick extruded wall about an opening; those at floor and ceiling join them."""
    first, second = lines
    if abs(float(second.distance(first.start + _reach(opening, first)[0] * first.along))) < SAME_LINE:
        return []
    edges = [[line.start + float((p - line.start) @ line.along) * line.along for line in lines] for p in opening.ends]
    bottom, top = opening.bottom, opening.top
    found = [quad([np.append(p, z) for p, z in ((a, bottom), (b, bottom), (b, top), (a, top))]) for a, b in edges]
    (a, b), (c, d) = edges
    for level in (bottom, top):
        part = quad([np.append(p, level) for p in (a, b, d, c)])
        thresholds[level].append(part) if level in thresholds else found.append(part)
    return found


def _floor_triangles(plan: FloorPlan, lines: list[Line]) -> Floats:
    """Floors of an extruded plan's rooms, triangles (T, 3, 2) [m]; without rooms, the rectangle about all walls."""
    found = []
    for room in plan.rooms:
        triangles = triangulate(room, [])
        assert triangles is not None  # was tried when the plan was read
        found.append(room[triangles])
    if not found:
        ends = np.array([line.at(p, 0.0)[:2] for line in lines for span in line.spans for p in span])
        (x0, y0), (x1, y1) = ends.min(axis=0), ends.max(axis=0)
        if min(x1 - x0, y1 - y0) < 0.5:
            raise Fault("the walls enclose nothing", "draw rooms as closed shapes, or walls around them")
        box = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        found.append(box[np.array([[0, 1, 2], [0, 2, 3]])])
    return np.concatenate(found)


def _line_name(line: Line, plan: FloorPlan) -> str:
    """Name of an extruded wall: the drawn one, else `wall_north` with a room on one side only, or `partition`."""
    if line.name:
        return line.name
    low, high = line.spans[int(np.argmax([high - low for low, high in line.spans]))]
    middle = line.start + 0.5 * (low + high) * line.along
    sides = [any(inside_loop(room, middle + s * 0.02 * line.across) for room in plan.rooms) for s in (1.0, -1.0)]
    if sides[0] == sides[1]:
        return "partition"
    outward = -line.across if sides[0] else line.across
    return f"wall_{compass_side(outward)}"
