"""The scene check: errors and warnings of rooms that the tracer would accept in silence and answer with nonsense."""

from rislam_rt.model import RadioConfig, Scene
from rislam_rt.scene.check import meshes
from rislam_rt.scene.check.agent import agent_errors, agent_warnings
from rislam_rt.scene.check.meshes import faint_slabs, material_errors
from rislam_rt.scene.check.occluders import cylinder_warnings, occluder_errors
from rislam_rt.scene.check.panel import panel_errors, panel_warnings
from rislam_rt.scene.check.triangle_array import START_KEY, build_triangle_array
from rislam_rt.scene.check.walls import wall_findings
from rislam_rt.scene.findings import Finding

__all__ = ["faint_slabs", "find_errors", "find_warnings", "material_errors"]


def find_errors(scene: Scene, file: str, start_key: str = START_KEY) -> list[Finding]:
    """Find what makes a scene unusable. Damaged meshes hide the rest, which could not be computed.

    Parameters
    ----------
    start_key
        Key of the scene file that says where the agent starts.
    """
    room = build_triangle_array(scene, file, start_key)
    return [*meshes.name_errors(room), *meshes.face_errors(room)] or [
        *meshes.scatterer_errors(room), *occluder_errors(room), *panel_errors(room), *agent_errors(room),
    ]  # fmt: skip


def find_warnings(scene: Scene, file: str, radio: RadioConfig) -> list[Finding]:
    """Find what may be meant but seldom is, and what is worth knowing, of a scene whose meshes are not damaged."""
    room = build_triangle_array(scene, file)
    return [
        *meshes.mesh_warnings(room), *wall_findings(room), *panel_warnings(room, radio),
        *cylinder_warnings(room, radio), *agent_warnings(room, radio),
    ]  # fmt: skip
