"""Every designer at one position of a room, on the true paths: what the command line's `design` shows."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design import DESIGNERS, Design, problem_from_paths
from rislam_rt.errors import ConfigError
from rislam_rt.model import RadioConfig, Scene, Trajectory
from rislam_rt.pipeline.run import build_channel


def design_at(
    scene: Scene, radio: RadioConfig, point: Floats, *, channel: str, depth: int, rng: np.random.Generator
) -> dict[str, Design]:
    """Designs by method for the agent's midpoint (3,) [m], its body and first heading as in the scene.

    Raises
    ------
    ConfigError
        The scene has no panel, or no path meets it from there.
    """
    if scene.ris is None:
        raise ConfigError(f"design: scene '{scene.name}' has no panel; give a scene with a [ris] section")
    agent = scene.agent
    here = Trajectory(np.zeros(1), point[None], np.zeros((1, 3)), agent.heading[:1], agent.body)
    paths = build_channel(channel, scene, radio, depth).paths(here)
    problem = problem_from_paths(paths, here.tx[0], here.rx[0], radio, scene.ris.spec.levels)
    children = rng.spawn(len(DESIGNERS))
    return {name: design(problem, rng=child) for (name, design), child in zip(DESIGNERS.items(), children, strict=True)}


def design_table(designs: Mapping[str, Design]) -> dict[str, Any]:
    """For JSON: figures by method, and the bound of all methods; null where the position is not observable."""
    methods = {
        name: {
            "gain_db": design.gain_db,
            "crlb_m2": design.crlb if np.isfinite(design.crlb) else None,
            "gap_db": design.gap_db,
            "seconds": design.seconds,
            "outcome": design.outcome.name,
            "code": design.code.index.tolist(),
        }
        for name, design in designs.items()
    }
    bound = max(design.bound for design in designs.values())
    return {"methods": methods, "bound": bound if bound > 0.0 else None}
