"""Reasons why a landmark is not heard at a place."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.measurement.received import HORIZON_MARGIN
from rislam_rt.model import Paths, Scene
from rislam_rt.pipeline.specification.spec import Settings
from rislam_rt.scene.check.mesh_queries import crossings

WEAK = "too weak"
CLEARANCE = 1e-6
"""Share of a line of sight left out at the landmark's end, where a panel lies on its own wall."""


class Reasons(NamedTuple):
    """A room at K places, to be asked."""

    scene: Scene
    paths: Paths
    settings: Settings
    triangles: Floats
    """(T, 3, 3) [m] of all that hides."""
    owner: tuple[str, ...]
    """(T,) names."""

    def why(self, number: int, place: int, margin_db: float, covered: int) -> str:
        """The reason, in a few words."""
        point, agent = self.scene.landmark_positions[number], self.scene.agent
        panel = self.scene.panel_number(number)
        front = self.scene.panels[panel] if panel >= 0 else None
        if front is not None and (agent.position[place] - front.center) @ front.spec.normal <= 0.0:
            return "the agent is behind the panel"
        hider = self._hider(point, place, number)
        weak = margin_db < 0.0
        own = (self.paths.landmark == number) & self.paths.valid[place]
        if hider and weak:
            return f"shaded by '{hider}'"
        upper = self.settings.radio.array.pattern == "upper"
        if own.any() and upper and (self.paths.arrival[place, own, 2] < -HORIZON_MARGIN).all():
            return "below the array, which hears from above only"
        if not weak and covered >= 0:
            return f"not to be told from {self.paths.label(covered)}"
        if not own.any():
            return "no path"
        return WEAK if weak else ""

    def _hider(self, point: Floats, place: int, number: int) -> str:
        """Name of what stands in the straight way between a landmark and either end; empty if nothing does."""
        for end in (self.scene.agent.tx[place], self.scene.agent.rx[place]):
            last = point + CLEARANCE * (end - point)
            _, hit = crossings(end[None], last[None], self.triangles)
            names = [self.owner[t] for t in hit]
            names = [name for name in names if name != _occluder_name(self.scene, number)]
            if names:
                return names[0]
        return ""


def build_reasons(scene: Scene, paths: Paths, settings: Settings) -> Reasons:
    """All that may be a reason for not being heard: walls and occluders that hide."""
    meshes = [(r.name, r.triangles) for r in scene.reflectors]
    meshes += [(shade.name, shade.triangles) for shade in scene.occluders]
    meshes += [(s.name, s.shade.triangles) for s in scene.scatterers if s.shade is not None]
    triangles = np.concatenate([triangles for _, triangles in meshes])
    owner = tuple(name for name, triangles in meshes for _ in range(len(triangles)))
    return Reasons(scene, paths, settings, triangles, owner)


def _occluder_name(scene: Scene, number: int) -> str:
    """Occluder that is a reason for not being heard; a scatterer's own shade does not hide its centre."""
    if number < len(scene.scatterers) and scene.scatterers[number].shade is not None:
        return scene.scatterers[number].name
    return ""
