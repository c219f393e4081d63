"""Overrides of a scene: another size of the panel, more or fewer scatterers, or rougher walls than its file says."""

from dataclasses import replace
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import ConfigError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.model import Scatterer, Scene, join_panels
from rislam_rt.pipeline.specification.pipeline_spec import RoomSection

RADIUS = 0.05
"""[m] Radius of an added scatterer, a sphere: the paper's."""
OFF_WALLS, APART, OFF_PATH = 0.4, 0.8, 0.4
"""Least distances [m] of an added sphere from surfaces, other landmarks, and the agent's way."""
ABOVE = 0.2
"""[m] Least height of an added sphere above the agent: an array that looks up receives nothing from below."""
TRIES = 2000
"""Random places tried for added spheres."""


def change_room(scene: Scene, room: RoomSection, *, rng: np.random.Generator) -> Scene:
    """Scene with the panel size, phase levels, scatterers and wall scattering that `[room]` of a pipeline file sets.

    Raises
    ------
    ConfigError
        There is no panel to change, or no place for so many scatterers.
    """
    panels = scene.panels
    if room.panel_rows or room.panel_cols or room.panel_levels:
        if not panels:
            raise ConfigError(f"room.panel_rows: scene '{scene.name}' has no panel to change; leave it out")
        override = {"rows": room.panel_rows, "cols": room.panel_cols, "levels": room.panel_levels}
        given: dict[str, Any] = {name: value for name, value in override.items() if value}
        panels = tuple(replace(panel, spec=replace(panel.spec, **given)) for panel in panels)
    scatterers = scene.scatterers
    if room.scatterers is not None:
        scatterers = _scatterers(scene, room.scatterers, rng=rng)
    ris = scene.ris if panels is scene.panels else join_panels(panels)
    reflectors = scene.reflectors
    if room.scattering is not None:
        reflectors = tuple(replace(r, material=replace(r.material, scattering=room.scattering)) for r in reflectors)
    return replace(scene, ris=ris, scatterers=scatterers, reflectors=reflectors)


def _scatterers(scene: Scene, count: int, *, rng: np.random.Generator) -> tuple[Scatterer, ...]:
    """Scatterers as `[room]` overrides their number: the scene's first `count`, or spheres at random free places."""
    found = list(scene.scatterers[:count])
    walls = build_walls(scene)
    surfaces = np.concatenate([walls.triangles, walls.occluders.triangles])
    low, high = scene.bounds
    low = np.array([low[0], low[1], float(scene.agent.position[:, 2].max()) + ABOVE])
    others = scene.landmark_positions
    for point in rng.uniform(low, np.maximum(low, high), size=(TRIES, 3)):
        if len(found) >= count:
            break
        if _is_free(point, surfaces, others, scene.agent.position):
            found.append(Scatterer(f"added_{len(found)}", point, np.pi * RADIUS**2, RADIUS))
            others = np.vstack([others, point])
    if len(found) < count:
        raise ConfigError(f"room.scatterers: {count} received; '{scene.name}' has room for {len(found)}, give no more")
    return tuple(found)


def _is_free(point: Floats, surfaces: Floats, others: Floats, way: Floats) -> bool:
    """Whether a scatterer added by scene overrides keeps clear of triangles, landmarks and the agent's positions."""
    if float(distance_to_triangles(point[None], surfaces).min()) < OFF_WALLS:
        return False
    nearest = float(np.linalg.norm(others - point, axis=1).min(initial=np.inf))
    return nearest >= APART and float(np.linalg.norm(way - point, axis=1).min()) >= OFF_PATH
