"""The scene check: what the tracer would accept in silence and answer with nonsense."""

from rislam_rt.model import RadioConfig, Scene
from rislam_rt.scene.check.agent import agent_errors, agent_warnings
from rislam_rt.scene.check.materials import material_errors
from rislam_rt.scene.check.meshes import face_errors, mesh_warnings, name_errors, scatterer_errors
from rislam_rt.scene.check.occluder_check import cylinder_warnings, shade_errors, shade_face_errors
from rislam_rt.scene.check.panel import panel_errors, panel_warnings
from rislam_rt.scene.check.triangle_array import build_triangle_array
from rislam_rt.scene.check.walls import wall_findings
from rislam_rt.scene.findings import Finding

__all__ = ["find_errors", "find_warnings", "material_errors"]


def find_errors(scene: Scene, file: str) -> list[Finding]:
    """What makes a scene unusable. Damaged meshes hide the rest, which could not be computed."""
    soup = build_triangle_array(scene, file)
    return [*name_errors(soup), *face_errors(soup), *shade_face_errors(soup)] or [
        *scatterer_errors(soup),
        *shade_errors(soup),
        *panel_errors(soup),
        *agent_errors(soup),
    ]


def find_warnings(scene: Scene, file: str, radio: RadioConfig) -> list[Finding]:
    """What may be meant but seldom is, and what is worth knowing, of a scene whose meshes are not damaged."""
    soup = build_triangle_array(scene, file)
    return [
        *mesh_warnings(soup),
        *wall_findings(soup),
        *panel_warnings(soup, radio),
        *cylinder_warnings(soup, radio),
        *agent_warnings(soup, radio),
    ]
