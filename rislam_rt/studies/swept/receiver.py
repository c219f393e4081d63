"""One cell of the hardware study: the receiver alone at some places, its components compared with the true paths."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.doppler import doppler_shift
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.measurement import FrontEnd, measure
from rislam_rt.model import PathKind, Paths, Trajectory
from rislam_rt.pipeline.channels import prepare_channel
from rislam_rt.pipeline.room.front_end import prepare_front_end
from rislam_rt.pipeline.run import prepare_setup
from rislam_rt.pipeline.signal_simulation import panel_codes
from rislam_rt.pipeline.specification.pipeline_spec import Settings, build_settings
from rislam_rt.ris import rephase
from rislam_rt.scene import load_scene
from rislam_rt.shipped import room_beside
from rislam_rt.studies.swept.cell import cell_spec

HALF = 0.683
"""Probability that a normal error is within one standard deviation."""


def run_cell(settings: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Do one cell of the hardware study: false components, detection of the panel, errors over reported stds.

    Once as set, and once more with a receiver that knows the front end's impairments, on the same front end and noise.
    """
    begin, spec = process_time(), cell_spec(settings)
    prepare_channel(spec.channel)
    scene = load_scene(room_beside(Path(settings["beside"]), str(settings["scene"])))
    setup = prepare_setup(scene, spec, rng=np.random.default_rng(seed))
    made, motion = build_settings(spec, len(setup.scene.panels)), setup.scene.agent
    build = np.random.default_rng(setup.seeds.hardware)
    front_end = prepare_front_end(setup.paths, motion, setup.body, made, rng=build)
    codes = panel_codes(setup.scene, setup.paths, "focused", rng=np.random.default_rng(setup.seeds.design))
    paths = setup.paths if codes is None else rephase(setup.paths, codes)
    places = np.linspace(len(motion) // 2, len(motion) - 1, int(settings["places"])).astype(int)

    def looks(front_end: FrontEnd | None) -> list[dict[str, Any]]:
        noise = np.random.default_rng(setup.seeds.noise)
        return [_look(paths, motion, int(cycle), made, front_end, rng=noise.spawn(1)[0]) for cycle in places]

    left = front_end.correction.left if front_end is not None and front_end.correction is not None else None
    found = {"schemes": {}, "receiver": {**_scores(looks(front_end)), "left": left}}
    if front_end is not None:
        told = front_end._replace(config=replace(front_end.config, told=True))
        found["told"] = {**_scores(looks(told)), "left": left}
    return {**found, "timing": {"cpu_seconds": process_time() - begin}}


def _look(
    paths: Paths, motion: Trajectory, cycle: int, made: Settings, front_end: FrontEnd | None,
    *, rng: np.random.Generator
) -> dict[str, Any]:  # fmt: skip
    """Numbers of components and normalised angle errors of the receiver in one cycle, by comparison with true paths."""
    heading, shift = float(motion.heading[cycle]), doppler_shift(paths, motion, made.radio.wavelength)[cycle]
    measurement, truth = measure(paths, cycle, heading, made.radio, made.receiver, None, shift, front_end, rng=rng)
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
    """Means of the receiver's counts over some cycles, and the quantile `HALF` of its normalised errors."""
    error: Floats = np.abs(np.concatenate([look["error"] for look in looks]))
    names = ("false", "components", "landmarks", "panel")
    means = {name: float(np.mean([look[name] for look in looks])) for name in names}
    return {**means, "error_over_std": float(np.quantile(error, HALF)) if error.size else None}
