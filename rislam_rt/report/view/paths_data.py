"""Data of the interactive view of a scene: its room, and the paths at some poses with the panels aimed at the agent."""

from dataclasses import replace
from typing import Any

import numpy as np

from rislam_rt.adviser.forecast_codes import aimed_paths
from rislam_rt.arrays import Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import PathKind, Paths, Scene, Trajectory
from rislam_rt.pipeline.specification.pipeline_spec import Settings
from rislam_rt.report.room_figures import path_points
from rislam_rt.report.style import KIND
from rislam_rt.report.view.room_data import room_data, rounded, spread

MOST_PATHS = 12_000
"""Largest number of paths of all poses together: some megabytes."""
MOST_POSES = 60
"""Largest number of poses in a view."""


def paths_data(scene: Scene, motion: Trajectory, paths: Paths, settings: Settings) -> dict[str, Any]:
    """Data of the interactive view of a scene, with the paths found at the poses `motion` of its trajectory."""
    posed = replace(scene, agent=motion)
    if scene.ris is not None:
        paths = aimed_paths(paths, scene.ris.spec, settings.radio)
    snr = settings.radio.integrated_snr(paths.gain) / settings.sensor.threshold
    margin = 10.0 * np.log10(np.maximum(snr, 1e-30))
    codes = ", panels aimed at the agent" if scene.ris is not None else ""
    return room_data(scene) | {
        "kind": "scene",
        "first": paths.num_cycles // 2,
        "classes": {kind.name: KIND[kind] for kind in PathKind if (paths.kind == kind).any()},
        "hidden": ["VT", "VS", "VRIS"] if paths.num_paths > 40 else [],
        "about": f"{paths.source}{codes}",
        "time": rounded(motion.time - scene.agent.time[0]),
        "poses": [_pose(posed, paths, margin, pose) for pose in range(paths.num_cycles)],
    }


def poses_of(scene: Scene, paths_a_pose: int) -> Any:
    """Cycles whose poses are shown in the interactive view, fewer where each has many paths."""
    return spread(len(scene.agent), max(3, min(MOST_POSES, MOST_PATHS // max(paths_a_pose, 1))))


def _pose(scene: Scene, paths: Paths, margin: Floats, pose: int) -> dict[str, Any]:
    """Data of one pose: position, and class, label, points, length [m], gain and SNR margin [dB] of its paths."""
    found = []
    for path in np.flatnonzero(paths.valid[pose]):
        gain = max(float(np.abs(paths.gain[pose, path])), 1e-20)
        found.append(
            {
                "k": PathKind(int(paths.kind[path])).name,
                "l": paths.label(int(path)),
                "p": rounded(path_points(scene, paths, pose, int(path))),
                "d": round(SPEED_OF_LIGHT * float(paths.tau[pose, path]), 3),
                "g": round(20.0 * float(np.log10(gain)), 1),
                "s": round(float(margin[pose, path]), 1),
            }
        )
    return {"at": rounded(scene.agent.position[pose]), "paths": found}
