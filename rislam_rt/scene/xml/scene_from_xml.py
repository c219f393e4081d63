"""Import of a Mitsuba or Sionna scene file (XML) as a scene, or a scene folder, of ours."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError, SceneError
from rislam_rt.model import Body, Material, Occluder, Reflector, RisPanel, Scene, Trajectory
from rislam_rt.scene.check import find_errors
from rislam_rt.scene.findings import Fault, raise_errors
from rislam_rt.scene.importing.free_space import FreeSpace
from rislam_rt.scene.importing.room_draft import RoomDraft, propose_panel
from rislam_rt.scene.load import build_panel, load_scene
from rislam_rt.scene.meshes import MAX_FACES, Mesh
from rislam_rt.scene.motion.agent_motion import straight_motion
from rislam_rt.scene.motion.suggested_motion import suggest_agent
from rislam_rt.scene.scene_folder import SCENE_FILE
from rislam_rt.scene.schema import RisSection
from rislam_rt.scene.write import room_name, write_scene
from rislam_rt.scene.xml.materials import material_element, read_material
from rislam_rt.scene.xml.read_scene import find_xml, read_xml
from rislam_rt.scene.xml.write import SHADE_OF

CITY_FACES = 1_000_000
"""Most faces of an XML scene file that are read where only those within a window are kept."""


def new_from_xml(
    source: str, folder: str | Path, *, within: Sequence[float] = (), overwrite: bool = False, carrier_ghz: float = 10.0
) -> list[str]:
    """Make a scene folder from an XML scene file, or from `sionna:NAME`, with a RIS panel for a carrier [GHz]; returns
    remarks on what was left out or supplied.

    Parameters
    ----------
    within
        `x0, y0, x1, y1` [m]: only what lies in this window of the plan is taken, walls cut at its sides.

    Raises
    ------
    SceneError
        The file cannot be used, or the folder exists and `overwrite` is False.
    """
    path = find_xml(source)
    scene, notes = scene_of_xml(path, room_name(Path(folder), path.stem), within, carrier_ghz)
    raise_errors(list(find_errors(scene, str(path))))
    origin = f"Made by `rislam-rt new --from {path.name}`."
    about = "\n".join([origin, "", *(f"- {note}" for note in notes)] if notes else [origin])
    write_scene(scene, folder, overwrite=overwrite, about=about)
    return notes


def scene_of_xml(
    path: Path, name: str, within: Sequence[float] = (), carrier_ghz: float = 10.0
) -> tuple[Scene, list[str]]:
    """Make a scene from an XML scene file; also remarks. A RIS panel that it proposes is one for that carrier [GHz].

    Where a `scene.toml` lies beside the file (as `rislam-rt export --xml` leaves it), agent, panel and scatterers are
    its, and a material that the XML file still has as it was written there is the exact one. Without it the agent gets
    a motion of its own.

    Raises
    ------
    SceneError
        The file, or the scene file beside it, cannot be used.
    """
    found = read_xml(path, CITY_FACES if within else MAX_FACES, _window(within))
    notes = list(found.notes)
    beside = path.with_name(SCENE_FILE)
    whole = load_scene(beside) if beside.is_file() else None
    exact = {r.name: r.material for r in whole.reflectors} if whole else {}
    solid = [(part, part.material) for part in found.parts if part.material is not None]
    reflectors = tuple(Reflector(p.name, *p.mesh, _exact(material, exact.get(p.name))) for p, material in solid)
    if not reflectors:
        raise SceneError(f"{path}: nothing in it reflects; give a scene with radio materials")
    own = {SHADE_OF + s.name for s in whole.scatterers} if whole else set()
    hiding = [part for part in found.parts if part.material is None and part.name not in own]
    occluders = tuple(Occluder(*part.mesh, part.name) for part in hiding)
    if whole is not None:
        notes.append(f"agent, panel and {len(whole.scatterers)} scatterers are those of the {SCENE_FILE} beside it")
        return replace(whole, name=name, reflectors=reflectors, occluders=occluders, digest=""), notes
    try:
        table = suggest_agent(np.concatenate([r.triangles for r in reflectors] + [s.triangles for s in occluders]))
    except Fault as fault:
        raise SceneError(fault.at(str(path), "").line) from None
    body = Body(np.array(table["tx_offset_m"]), np.array(table["rx_offset_m"]))
    agent = straight_motion(table["start"], table["velocity"], table["cycles"], table["cycle_s"], body)
    panel, about = _panel(reflectors, occluders, agent, carrier_ghz)
    way = float(np.linalg.norm(agent.position[-1] - agent.position[0]))
    notes.append(f"proposed way: {way:.2g} m in {agent.time[-1]:.0f} s, to be edited in [agent]; {about}")
    return Scene(name, reflectors, (), panel, agent, "", occluders), notes


def _window(within: Sequence[float]) -> Floats | None:
    """Window (2, 2) [m] of an XML scene to keep, lowest and highest x, y; None for everything."""
    if not within:
        return None
    window = np.array(within, dtype=np.float64)
    if window.shape != (4,) or not np.isfinite(window).all() or (window[2:] <= window[:2]).any():
        raise ConfigError(f"--within: {list(within)} received; give x0,y0,x1,y1 in metres, x0 < x1 and y0 < y1")
    return window.reshape(2, 2)


def _exact(read: Material, exact: Material | None) -> Material:
    """An XML scene's material as the scene file beside it has it, if it was written so; else as read."""
    if exact is not None and read_material(material_element(exact, "written"))[0] == read:
        return exact
    return read


def _panel(
    reflectors: Sequence[Reflector], occluders: Sequence[Occluder], agent: Trajectory, carrier_ghz: float
) -> tuple[RisPanel | None, str]:
    """Propose a RIS panel for an XML scene above or beside the agent's path, if there is a place; and a remark."""
    hiding = {s.name: Mesh(s.vertices, s.faces) for s in occluders}
    draft = RoomDraft({r.name: (Mesh(r.vertices, r.faces), {}) for r in reflectors}, hiding)
    way = agent.position[[0, -1]]
    table, about = propose_panel(draft, FreeSpace(way, way, 0.0, 0.0), carrier_ghz)
    return (build_panel(RisSection(**table)) if table else None), about
