"""One cell of a study of the front end: what the receiver reports at some places, and what of it is so."""

from collections.abc import Mapping
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.doppler import doppler_shift
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.measurement import measure
from rislam_rt.model import Measurement, PathKind, Paths, PathTruth, Trajectory
from rislam_rt.pipeline.front_end import prepare_front_end
from rislam_rt.pipeline.run import prepare_channel, set_stage
from rislam_rt.pipeline.signals import panel_codes
from rislam_rt.pipeline.spec import build_settings
from rislam_rt.pipeline.studies.swept.cell import cell_spec
from rislam_rt.ris import rephase
from rislam_rt.scene import load_scene

HALF = 0.683
"""Share of a normal error within one standard deviation."""


def run_cell(settings: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """False components, whether the panel's direct path is heard, and errors over reported deviations."""
    begin, spec = process_time(), cell_spec(settings)
    prepare_channel(spec.channel)
    scene = load_scene(Path(settings["beside"]) / str(settings["scene"]))
    stage = set_stage(scene, spec, rng=np.random.default_rng(seed))
    made, motion = build_settings(spec), stage.scene.agent
    build, noise = (np.random.default_rng(one) for one in (stage.seeds.hardware, stage.seeds.noise))
    front_end = prepare_front_end(stage.paths, motion, stage.body, made, rng=build)
    codes = panel_codes(stage.scene, stage.paths, "focused", rng=np.random.default_rng(stage.seeds.design))
    paths = stage.paths if codes is None else rephase(stage.paths, codes)
    shift = doppler_shift(paths, motion, made.radio.wavelength)
    looks = []
    for cycle in np.linspace(len(motion) // 2, len(motion) - 1, int(settings["places"])).astype(int):
        heading, rng = float(motion.heading[cycle]), noise.spawn(1)[0]
        heard = measure(
            paths, int(cycle), heading, made.radio, made.receiver, None, shift[cycle], front_end, rng=rng
        )  # fmt: skip
        looks.append(_look(heard, paths, motion, int(cycle)))
    left = front_end.correction.left if front_end is not None and front_end.correction is not None else None
    scores = {**_scores(looks), "left": left}
    return {"schemes": {}, "receiver": scores, "timing": {"cpu_seconds": process_time() - begin}}


def _look(heard: tuple[Measurement, PathTruth], paths: Paths, motion: Trajectory, cycle: int) -> dict[str, Any]:
    """Counts and whitened errors of one cycle."""
    measurement, truth = heard
    true = truth.path >= 0
    kind = np.where(true, paths.kind[truth.path], -1)
    arrival = (paths.arrival[cycle, truth.path] @ rotation_z(motion.heading[cycle]))[:, :2]
    error = (measurement.cosines - arrival) / measurement.cosines_std
    return {
        "false": int(np.sum(~true)),
        "components": len(true),
        "panel": bool(np.any(kind == PathKind.RIS)),
        "landmarks": int(np.sum(kind >= PathKind.PS)),
        "error": error[true & (kind != PathKind.LOS)],
    }


def _scores(looks: list[dict[str, Any]]) -> dict[str, Any]:
    error: Floats = np.abs(np.concatenate([look["error"] for look in looks]))
    return {
        "false": float(np.mean([look["false"] for look in looks])),
        "components": float(np.mean([look["components"] for look in looks])),
        "landmarks": float(np.mean([look["landmarks"] for look in looks])),
        "panel": float(np.mean([look["panel"] for look in looks])),
        "error_over_std": float(np.quantile(error, HALF)) if error.size else None,
    }
