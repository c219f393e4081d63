"""Phase codes of every designer at one position of the agent, on the true paths: for the command `rislam-rt design`."""

from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design import DESIGNERS, Design, panel_columns, problem_from_paths
from rislam_rt.errors import ConfigError
from rislam_rt.model import PathKind, RadioConfig, Scene, Trajectory
from rislam_rt.pipeline.channels import build_channel
from rislam_rt.scene.check.mesh_queries import touching
from rislam_rt.scene.check.triangle_array import MIN_CLEARANCE


class DesignsAt(NamedTuple):
    """Phase codes that all designers find for one position of the agent, and the gains of panel paths under them."""

    designs: dict[str, Design]
    """By method. Their gains are those of the `target`."""
    target: str
    """Panel path that single-path methods aim at: the one without walls or, where that is hidden, the first other."""
    is_direct: bool
    """Whether the `target` has no walls."""
    panels: dict[str, dict[str, float]]
    """By method and panel, where there are several: gain [dB] of the panel's first path, without walls if visible."""


def design_at(
    scene: Scene, radio: RadioConfig, point: Floats, *, channel: str, depth: int, rng: np.random.Generator
) -> DesignsAt:
    """Design the panel's phase code with every method for an agent at `point` (3,) [m], heading as the scene's first.

    Raises
    ------
    ConfigError
        The scene has no panel, no path over it is visible from there, or agent, Tx or Rx lies on it or on its host.
    """
    if scene.ris is None:
        raise ConfigError(f"design: scene '{scene.name}' has no panel; give a scene with a [ris] section")
    agent = scene.agent
    here = Trajectory(np.zeros(1), point[None], np.zeros((1, 3)), agent.heading[:1], agent.body)
    _check_off_panels(scene, np.stack([point, here.tx[0], here.rx[0]]))
    paths = build_channel(channel, scene, radio, depth).paths(here)
    problem = problem_from_paths(paths, here.tx[0], here.rx[0], radio, scene.ris.spec.levels)
    target = panel_columns(paths, 0)[0]
    children = rng.spawn(len(DESIGNERS))
    designs = {
        name: design(problem, rng=child) for (name, design), child in zip(DESIGNERS.items(), children, strict=True)
    }
    gains: dict[str, dict[str, float]] = {name: {} for name in designs}
    places = list(zip(scene.panels, problem.targets, problem.panels, strict=True))
    for name, design in designs.items() if len(places) > 1 else ():
        weight = np.exp(-1j * design.xi.ravel())
        for panel, own, (_, span) in places:
            gains[name][panel.name] = float(20.0 * np.log10(max(abs(own @ weight[span]), 1e-20)))
    return DesignsAt(designs, paths.label(int(target)), bool(paths.kind[target] == PathKind.RIS), gains)


def _check_off_panels(scene: Scene, points: Floats) -> None:
    """Raise an error if agent, Tx or Rx, points (3, 3) [m], lie on a RIS panel or on the wall that it hangs on."""
    for panel in scene.panels:
        spec = panel.spec
        offset = points - panel.center
        away = np.linalg.norm(offset[:, None] - spec.offsets().reshape(-1, 3), axis=-1).min(axis=1)
        beside = away <= 0.5 * np.linalg.norm(spec.spacing) + MIN_CLEARANCE
        if (beside & (np.abs(offset @ spec.normal) < MIN_CLEARANCE)).any():
            raise ConfigError(f"--at: {points[0].tolist()} lies on the panel '{panel.name}'; move it off")
        host = next((one for one in scene.reflectors if one.name == panel.host), None)
        if host is not None and len(touching(points, host.triangles, MIN_CLEARANCE)[0]):
            raise ConfigError(
                f"--at: {points[0].tolist()} lies on '{host.name}', which holds the panel '{panel.name}'; keep "
                f"{1e3 * MIN_CLEARANCE:g} mm away"
            )


def design_table(found: DesignsAt) -> dict[str, Any]:
    """JSON table of the designs at one position: gain, CRLB and gap by method, and the bound of all methods.

    Null where the position is not observable.
    `gain_db` and `gap_db` are those of the panel path without walls, null where it is hidden; `target_gain_db` and
    `target_gap_db` are those of the path that `target` names, whichever it is.
    """
    designs = found.designs
    methods = {
        name: {
            "gain_db": design.gain_db if found.is_direct else None,
            "crlb_m2": design.crlb if np.isfinite(design.crlb) else None,
            "gap_db": design.gap_db if found.is_direct else None,
            "target_gain_db": design.gain_db,
            "target_gap_db": design.gap_db,
            "seconds": design.seconds,
            "outcome": design.outcome.name,
            "code": design.code.index.tolist(),
            **({"panel_gain_db": found.panels[name]} if found.panels[name] else {}),
        }
        for name, design in designs.items()
    }
    bound = max(design.bound for design in designs.values())
    about = {"target": found.target, "direct_path": found.is_direct}
    return {**about, "methods": methods, "bound": bound if bound > 0.0 else None}
