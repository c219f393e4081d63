"""Exports of a run in common formats: trajectories (TUM), maps and scores (JSON), configuration (TOML), scene."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rislam_rt.model import MapEstimate, Scene, SlamResult
from rislam_rt.pipeline.own_method_files import own_sources
from rislam_rt.pipeline.run_datasets import part_name
from rislam_rt.scene.write import scene_files, tum_bytes
from rislam_rt.storage.files import json_file
from rislam_rt.toml import toml_bytes

SUMMARY_FILE = "summary.json"
ROOM = "scene"
"""Folder of an exported room; the exported configuration names it, so that the run can be repeated from its folder."""


def export_files(result: SlamResult, summary: Mapping[str, Any], own: Mapping[str, str]) -> dict[str, bytes]:
    """Exported files of a run by name: trajectories, maps, scene, configuration and scores."""
    motion = result.scene.agent
    files = {"truth.tum": tum_bytes(motion.time, motion.position, motion.heading)}
    for name, scheme in result.schemes.items():
        files[part_name("estimate", name, ".tum")] = tum_bytes(motion.time, scheme.position, scheme.heading)
    return files | record_files(result, result.scene, summary, own)


def record_files(
    result: SlamResult, scene: Scene, summary: Mapping[str, Any], own: Mapping[str, str]
) -> dict[str, bytes]:
    """Exported files of a run by name that do not grow with its cycles: maps, configuration, scores, scene, and the
    sources of methods of the user's own (`own`: by name, with their SHA-256) beside the configuration, where they are
    looked for."""
    maps = {name: map_table(scheme.map) for name, scheme in result.schemes.items()}
    settings = _without_none({**result.config, "scene": ROOM})
    files = {"map.json": json_file(maps, indent=2), "config.toml": toml_bytes(settings)}
    files |= {f"{ROOM}/{name}": content for name, content in scene_files(scene).items()}
    files |= own_sources(own)
    return files | {SUMMARY_FILE: json_file(summary, indent=2)}


def map_table(estimate: MapEstimate) -> dict[str, Any]:
    """Export of an estimated map as a table for JSON: landmarks, their mirror images, walls."""
    std = np.sqrt(np.einsum("nii->ni", estimate.covariance))
    features = [
        {
            "ident": int(estimate.ident[row]),
            "position_m": estimate.position[row].tolist(),
            "std_m": std[row].tolist(),
            "image_of": int(estimate.ident[estimate.parent[row]]) if estimate.parent[row] >= 0 else None,
            "ris_probability": float(estimate.ris_probability[row]),
            **({} if estimate.panel is None else {"panel": int(estimate.panel[row])}),
            "strength": float(estimate.strength[row]),
        }
        for row in range(len(estimate.ident))
    ]
    walls = [
        {"normal": normal.tolist(), "offset_m": float(offset), "angle_std_rad": float(a), "offset_std_m": float(b)}
        for normal, offset, (a, b) in zip(estimate.wall_normal, estimate.wall_offset, estimate.wall_std, strict=True)
    ]
    return {"landmarks": features, "walls": walls}


def _without_none(table: dict[str, Any]) -> dict[str, Any]:
    """Configuration to export without the settings that are None: TOML has no null."""
    return {
        key: _without_none(value) if isinstance(value, dict) else value
        for key, value in table.items()
        if value is not None
    }
