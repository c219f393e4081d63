"""Reasons why a landmark is not detected: occluded, behind the panel, below the array, not resolved, outside the
receiver's window, too weak."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.measurement.received_paths import HORIZON_MARGIN
from rislam_rt.model import Paths, Scene
from rislam_rt.pipeline.specification.pipeline_spec import Settings
from rislam_rt.scene.check.mesh_queries import crossings

WEAK = "too weak"
"""Reason where a path comes in that is below the detection threshold."""
OUTSIDE = "beyond the receiver's delays"
"""Reason where all paths arrive outside of the window of delays that the receiver looks at."""
CLEARANCE = 1e-6
"""Share of a line of sight left out at the landmark's end, where a panel lies on its own wall."""


class Reasons(NamedTuple):
    """Room with its paths at K positions and all surfaces that hide, to find why landmarks are not detected."""

    scene: Scene
    paths: Paths
    settings: Settings
    triangles: Floats
    """(T, 3, 3) [m] of all reflectors and occluders."""
    owner: tuple[str, ...]
    """(T,) name of the reflector or occluder of each triangle."""

    def why(self, number: int, place: int, margin_db: float, covered: int) -> str:
        """Reason, in a few words, why a landmark is not detected at a position of the agent; empty if none is found."""
        point, agent = self.scene.landmark_positions[number], self.scene.agent
        panel = self.scene.panel_number(number)
        front = self.scene.panels[panel] if panel >= 0 else None
        if front is not None and (agent.position[place] - front.center) @ front.spec.normal <= 0.0:
            return "the agent is behind the panel"
        blocker = self._blocker(point, place, number)
        weak = margin_db < 0.0
        own = (self.paths.landmark == number) & self.paths.valid[place]
        if blocker and weak:
            return f"shaded by '{blocker}'"
        array = self.settings.radio.array
        if own.any() and not array.receives(self.paths.arrival[place, own, 2], HORIZON_MARGIN).any():
            return "below the array, which hears from above only"
        if not weak and covered >= 0:
            return f"not to be told from {self.paths.label(covered)}"
        if not own.any():
            return "no path"
        if not self.settings.sensor.in_window(self.paths.tau[place, own]).any():
            return OUTSIDE
        return WEAK if weak else ""

    def _blocker(self, point: Floats, place: int, number: int) -> str:
        """Reason why a landmark is not detected: the mesh, not its own, that hides it from Tx or Rx; empty if none."""
        scatterers = self.scene.scatterers
        own = scatterers[number].name if number < len(scatterers) and scatterers[number].shade is not None else ""
        for end in (self.scene.agent.tx[place], self.scene.agent.rx[place]):
            last = point + CLEARANCE * (end - point)
            _, hit = crossings(end[None], last[None], self.triangles)
            names = [self.owner[t] for t in hit if self.owner[t] != own]
            if names:
                return names[0]
        return ""


def build_reasons(scene: Scene, paths: Paths, settings: Settings) -> Reasons:
    """Collect a room's walls and occluders, which may hide a landmark, for the reasons why it is not detected."""
    meshes = [(r.name, r.triangles) for r in scene.reflectors]
    meshes += [(shade.name, shade.triangles) for shade in scene.occluders]
    meshes += [(s.name, s.shade.triangles) for s in scene.scatterers if s.shade is not None]
    triangles = np.concatenate([triangles for _, triangles in meshes])
    owner = tuple(name for name, triangles in meshes for _ in range(len(triangles)))
    return Reasons(scene, paths, settings, triangles, owner)
