"""A new room from a file to import, mesh or floor plan: a scene folder, checked before it appears."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from rislam_rt.errors import SceneError
from rislam_rt.model import RadioConfig
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.importing.floor_plans.extrusion import extrude
from rislam_rt.scene.importing.floor_plans.floor_plan import PlanShape, build_plan, parse_corners, parse_geojson
from rislam_rt.scene.importing.floor_plans.svg_drawing import parse_svg
from rislam_rt.scene.importing.import_options import ImportOptions
from rislam_rt.scene.importing.mesh_room import import_mesh
from rislam_rt.scene.importing.mesh_source import read_content
from rislam_rt.scene.importing.placement import check_near, check_size
from rislam_rt.scene.importing.room_draft import RoomDraft, finish_room
from rislam_rt.scene.load import check_scene
from rislam_rt.scene.mesh_placement import UNITS
from rislam_rt.scene.room_files import room_files
from rislam_rt.scene.write import room_name, write_files

PLANS = (".svg", ".geojson", ".json")
"""Endings of the files that are imported as floor plans."""
MAX_PLAN_BYTES = 10_000_000
"""Most bytes of a floor plan's file."""
IMMEASURABLE = 1e12
"""Largest coordinate of a floor plan whose size is looked at."""


def import_room(
    file: Path, folder: Path, options: ImportOptions, *, height: float = 2.7, overwrite: bool = False
) -> list[str]:
    """Import a mesh file or a floor plan as a scene folder; returns remarks on what became of it.

    The folder appears whole, and only if its check finds no error. `height` [m] is that of a floor plan's rooms.

    Raises
    ------
    SceneError
        The file cannot be made a room, or the folder exists.
    StoreError
        The disk refused.
    """
    try:
        draft = _read_plan(file, options, height) if file.suffix.lower() in PLANS else import_mesh(file, options)
        return write_room(draft, folder, f"Made from `{file.name}`.", options, overwrite=overwrite)
    except Fault as fault:
        raise SceneError(f"{file}: {fault}") from None


def import_corners(
    corners: str, folder: Path, options: ImportOptions, *, height: float = 2.7, overwrite: bool = False
) -> list[str]:
    """Import one room given by its corners `0,0 4,0 4,3 0,3` [m] as a scene folder; returns remarks.

    Raises
    ------
    SceneError
        The corners enclose nothing or have no room's size, or the folder exists.
    StoreError
        The disk refused.
    """
    shapes = parse_corners(corners)
    try:
        draft = _draft_of_plan(shapes, options, height)
        return write_room(draft, folder, "Made from the corners of a floor plan.", options, overwrite=overwrite)
    except Fault as fault:
        raise SceneError(f"--floorplan: {fault}") from None


def _read_plan(file: Path, options: ImportOptions, height: float) -> RoomDraft:
    """Import a floor plan (SVG or GeoJSON) as the draft of a room of a given height [m]."""
    content = read_content(file, MAX_PLAN_BYTES)
    shapes = parse_svg(content) if file.suffix.lower() == ".svg" else parse_geojson(content)
    return _draft_of_plan(shapes, options, height)


def _draft_of_plan(shapes: list[PlanShape], options: ImportOptions, height: float) -> RoomDraft:
    """Draft of a room of a given height [m] by the shapes of a floor plan, whose options of a mesh are refused."""
    for name, given in (("--up", options.up), ("--scan", options.scan)):
        if given is not None:
            raise Fault(f"{name}: it says how a mesh lies or was made, and this is a floor plan", "leave it out")
    origin, unit = np.array(options.origin[:2]), UNITS[options.units or "m"]
    points = np.concatenate([np.zeros((0, 2)), *(shape.points for shape in shapes)])
    doubts: list[str] = []
    if len(points) and (np.abs(points) < IMMEASURABLE).all():  # what is beyond is refused with its shape's name
        doubts = check_size(float(np.linalg.norm(np.ptp(points, axis=0))), options.units)
        check_near(points * unit - origin, origin)
    shapes = [shape._replace(points=shape.points - origin / unit) for shape in shapes]
    draft = extrude(build_plan(shapes, unit, height), height, options)
    return replace(draft, remarks=[*doubts, *draft.remarks])


def write_room(
    draft: RoomDraft, folder: Path, origin: str, options: ImportOptions, *, overwrite: bool = False
) -> list[str]:
    """Write the draft of an imported room as a scene folder if its check finds no error; returns its remarks.

    Raises
    ------
    Fault
        There is no place for an agent, or the check finds an error.
    """
    room, remarks = finish_room(draft, room_name(folder, "room"), origin, options.carrier_ghz)
    made = f"Made by `rislam-rt new` for a carrier of {options.carrier_ghz:g} GHz"
    files = room_files(room, f"{made}: start, way and panel are proposals.")
    with tempfile.TemporaryDirectory() as place:
        trial = write_files(files, Path(place) / "room")
        carrier = 1e9 * options.carrier_ghz
        findings = check_scene(trial, RadioConfig(carrier=carrier, bandwidth=min(1e9, carrier)))
        errors = [finding for finding in findings if finding.severity == "error"]
    if errors:
        by_hand = "give another with --material NAME=... or --rest, or --carrier-ghz in that range"
        mend = by_hand if ".material." in errors[0].field else errors[0].mend
        place = f"{errors[0].field}: " if errors[0].field else ""
        raise Fault(f"the room would not pass its check: {place}{errors[0].message}", mend)
    write_files(files, folder, overwrite=overwrite)
    how = "(--material NAME=itu:MATERIAL:THICKNESS_M or NAME=reflection:VALUE)"
    return remarks + [f"{f.field}: {f.message}; {f.mend} {how}" for f in findings if ".material." in f.field]
