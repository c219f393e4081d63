"""Loading of a scene folder as a `Scene`."""

import hashlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import expect
from rislam_rt.geometry.angles import unit
from rislam_rt.model import Material, Occluder, RadioConfig, Reflector, RisPanel, RisSpec, Scatterer, Scene, join_panels
from rislam_rt.scene.check import faint_slabs, find_errors, find_warnings, material_errors, units
from rislam_rt.scene.check.triangle_array import START_KEY
from rislam_rt.scene.findings import Fault, Finding, panel_key, raise_errors, warning_at
from rislam_rt.scene.mesh_placement import MeshFiles
from rislam_rt.scene.motion.agent_motion import build_motion
from rislam_rt.scene.read_scene_file import MAX_SCENE_BYTES, read_spec
from rislam_rt.scene.scene_folder import scene_file
from rislam_rt.scene.schema import AgentSection, RisSection, ScattererSection, SceneSpec
from rislam_rt.scene.shapes import solid_mesh
from rislam_rt.toml import parse_toml


class SceneDraft(NamedTuple):
    """A scene folder as far as it could be read: the scene, None if it is unusable, and what is wrong with it."""

    file: str
    scene: Scene | None
    findings: list[Finding]
    bounds: Floats | None = None
    """(2, 3) [m] of the meshes that could be read."""
    start_key: str = START_KEY
    """Key of the scene file that says where the agent starts."""


def load_scene(path: str | Path) -> Scene:
    """Load a scene from its folder, its `scene.toml`, or the name of a built-in room.

    Raises
    ------
    SceneError
        The scene file, a mesh or the trajectory is unusable; one line that says where, what and how to mend it.
    """
    expect("path", path, (str, Path))
    draft = read_draft(path)
    raise_errors(draft.findings)
    assert draft.scene is not None
    raise_errors(find_errors(draft.scene, draft.file, draft.start_key))
    return draft.scene


def check_scene(scene: Scene | str | Path, radio: RadioConfig | None = None) -> list[Finding]:
    """Load a scene to check it: find everything wrong (errors), suspicious (warnings) or worth knowing (notes) about it
    or its folder.

    A bad scene is an answer, not an exception. Materials are held against the carrier of a radio that is given;
    warnings about the panel depend on the radio too, the default one if none is given. Where there are errors, of the
    warnings only those about units are looked for: such a mistake often is what the errors come from.
    """
    if isinstance(scene, Scene):
        return _check_read(scene, scene.name, START_KEY, radio)
    draft = read_draft(scene)
    findings = draft.findings
    if draft.scene is not None:
        findings = findings + _check_read(draft.scene, draft.file, draft.start_key, radio)
    of_units = _unit_findings(draft)
    if any(finding.severity == "error" for finding in findings):
        return findings + of_units
    if any(".units" in finding.field for finding in of_units):
        findings = [finding for finding in findings if finding.field != units.ROOM_FIELD]  # they know the unit
    # of a speed, the motion's own warning says it
    return findings + [finding for finding in of_units if finding.field != units.SPEED_FIELD]


def _unit_findings(draft: SceneDraft) -> list[Finding]:
    """Warnings of a loaded scene folder about units: of its file, its recording, and each of its meshes."""
    scene, bounds, table = draft.scene, draft.bounds, {}
    with suppress(OSError, ValueError):  # what cannot be read has been said
        table = parse_toml(Path(draft.file).read_bytes()[: MAX_SCENE_BYTES + 1].decode())
    lone = [] if scene is None else list(units.lone_mesh_warnings(draft.file, scene.reflectors))
    found = [*lone, *units.unit_warnings(draft.file, table, None if lone else bounds)]
    if scene is not None and bounds is not None and "trajectory" in table.get("agent", {}):
        found += units.recording_unit_warnings(draft.file, scene.agent, bounds)
    return found


def _check_read(scene: Scene, file: str, start_key: str, radio: RadioConfig | None) -> list[Finding]:
    """Check a scene that has been loaded: its errors, or if it has none its warnings and notes."""
    errors = find_errors(scene, file, start_key)
    if radio is not None:
        errors += material_errors(scene, file, radio)
    faint = [] if radio is None else faint_slabs(scene, file, radio)
    return errors or [*find_warnings(scene, file, radio or RadioConfig()), *faint]


def read_draft(path: str | Path) -> SceneDraft:
    """Load a scene folder, collecting what is wrong with it instead of raising."""
    file = scene_file(path)
    try:
        spec, content = read_spec(file)
    except Fault as fault:
        return SceneDraft(str(file), None, [one.at(str(file), "") for one in fault.faults])
    return assemble(spec, file, content)


def assemble(spec: SceneSpec, file: Path, content: bytes) -> SceneDraft:
    """Load a scene from the validated content of its file and its meshes, and collect what is wrong with them."""
    mesh_files = MeshFiles(file.parent, spec.limits, spec.meshes)
    findings: list[Finding] = []

    def made(kind: str, sections: Sequence[Any], build: Callable[[Any], Any]) -> list[Any]:
        """Parts made from their sections of the scene file; what is wrong with a section goes to the findings."""
        found = []
        for number, section in enumerate(sections):
            try:
                found.append(build(section))
            except Fault as fault:
                of_mesh = f"{kind}[{number}].mesh ({section.name})"
                field = panel_key(number, len(sections)) if kind == "ris" else of_mesh
                findings.append(fault.at(str(file), field))
        return found

    def reflector(one: Any) -> Reflector:
        units = {"thickness_m": "thickness", "conductivity_s_m": "conductivity"}
        given = one.material.model_dump(exclude_none=True)
        material = Material(**{units.get(key, key): value for key, value in given.items()})
        return Reflector(one.name, *mesh_files.mesh(one.mesh, one), material)

    reflectors = made("reflector", spec.reflector, reflector)
    scatterers = made("scatterer", spec.scatterer, lambda one: _scatterer(one, mesh_files))
    occluders = made("shade", spec.shade, lambda one: Occluder(*mesh_files.mesh(one.mesh, one), one.name))
    panels = made("ris", spec.ris, build_panel)
    try:
        if not (findings and spec.agent.random_walk):  # which needs the whole room
            meshes = [*reflectors, *occluders, *(s.shade for s in scatterers if s.shade)]
            surfaces = np.concatenate([np.zeros((0, 3, 3)), *(mesh.triangles for mesh in meshes)])
            agent, mesh_files.contents["trajectory"] = build_motion(spec.agent, file.parent, surfaces)
    except Fault as fault:
        findings.append(fault.at(str(file), "agent"))
    corners = np.concatenate([np.zeros((0, 3)), *(reflector.vertices for reflector in reflectors)])
    bounds = np.stack([corners.min(axis=0), corners.max(axis=0)]) if len(corners) else None
    if findings:
        return SceneDraft(str(file), None, findings, bounds)
    digest = hashlib.sha256()
    for name, data in [("", content), *sorted(mesh_files.contents.items())]:  # name and length before each
        digest.update(f"{name}\0{len(data)}\0".encode())
        digest.update(data)
    ris = join_panels(tuple(panels))
    scene = Scene(spec.name, tuple(reflectors), tuple(scatterers), ris, agent, digest.hexdigest(), tuple(occluders))
    start = {"waypoints": "agent.waypoints[0]", "trajectory": "agent.trajectory"}
    start_key = next((key for motion, key in start.items() if getattr(spec.agent, motion) is not None), START_KEY)
    return SceneDraft(str(file), scene, _idle_keys(spec.agent, str(file)), bounds, start_key)


def _idle_keys(agent: AgentSection, file: str) -> list[Finding]:
    """Warnings of keys of the agent's section that change nothing in the scene to load."""
    if agent.turn_deg_s is None or any((agent.halt_s or [])[1:-1]):
        return []
    message = "it changes nothing without a halt between the ends, where the agent would turn on the spot"
    return [warning_at(file, "agent.turn_deg_s", message, "give one in 'halt_s', or leave it out")]


def _scatterer(section: ScattererSection, mesh_files: MeshFiles) -> Scatterer:
    """Scatterer, loaded from its section of the scene file: a sphere has the cross-section pi r^2, as in the paper,
    unless the file gives another one.

    A cylinder's nominal one, pi r h / 2, is the mean of its backscattering over all directions.
    """
    position, radius, height = np.array(section.position), section.radius, section.height_m
    axis = unit(np.array(section.axis)) if section.axis is not None else np.array([0.0, 0.0, 1.0])
    law, rcs = ("mie" if section.mie else "constant"), section.rcs_m2
    if rcs is None and height is not None:
        law, rcs = "cylinder", np.pi * (radius or 0.0) * height / 2.0
    elif rcs is None:
        rcs = np.pi * (radius or 0.0) ** 2
    shade = None
    if section.mesh is not None:
        shade = Occluder(*mesh_files.mesh(section.mesh, section))
    elif section.shadow:
        shade = Occluder(*solid_mesh(position, radius or 0.0, height, axis))
    return Scatterer(section.name, position, rcs, radius, law, height, axis, shade)


def build_panel(section: RisSection) -> RisPanel:
    """RIS panel, loaded from its section of the scene file.

    Raises
    ------
    Fault
        Its directions have no length, or are not at right angles.
    """
    normal, up = unit(np.array(section.normal)), unit(np.array(section.up))
    for key, direction in (("normal", normal), ("up", up)):
        if not direction.any():
            raise Fault(f"{getattr(section, key)} has no length", "give a direction", key)
    if abs(normal @ up) > 1e-6:
        angle = np.degrees(np.arccos(np.clip(normal @ up, -1.0, 1.0)))
        raise Fault(f"{angle:.3f} degrees from ris.normal", "give a direction at right angles to it", "up")
    up = unit(up - (normal @ up) * normal)
    size = section.rows, section.cols, np.array(section.spacing_m)
    spec = RisSpec(*size, normal, up, section.levels, section.element, section.amplitude)
    return RisPanel(spec, np.array(section.center), section.host, section.name)
