"""One cell of a swept study: one room and seed, paths found once, every scheme simulated with the same noise."""

from collections.abc import Mapping
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from rislam_rt.measurement import paper_snr_db
from rislam_rt.pipeline.channels import prepare_channel
from rislam_rt.pipeline.cycle import Receptions
from rislam_rt.pipeline.long.slices import subsampled_paths
from rislam_rt.pipeline.run import RunSetup, prepare_setup, result_of, run_scheme
from rislam_rt.pipeline.scores.summary import summarise_scheme
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.pipeline.specification.read_pipeline import Table, build_spec
from rislam_rt.progress import tell_nobody
from rislam_rt.scene import load_scene
from rislam_rt.shipped import room_beside
from rislam_rt.sweeps.cell_work import one_line
from rislam_rt.toml import put_dotted

FUNCTION = f"{__name__}:run_cell"
CLOCK = ("seconds", "step_seconds", "over_budget")
"""Scores that are times, which differ when a run is repeated."""


def run_cell(settings: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Do one cell of a swept study: simulate all schemes in one room and return their scores.

    A scheme that fails has its error in place of scores; the others go on.
    """
    spec = cell_spec(settings)
    prepare_channel(spec.channel)
    scene = load_scene(room_beside(Path(settings["beside"]), str(settings["scene"])))
    setup = prepare_setup(scene, spec, rng=np.random.default_rng(seed))._replace(receptions=Receptions())
    schemes: dict[str, Any] = {}
    timing: dict[str, Any] = {"trace_seconds": setup.seconds}
    for name in spec.schemes:
        begin = process_time()
        try:
            result = result_of(setup, spec, {name: run_scheme(name, setup, spec, tell_nobody)}, seed=seed)
            scores = summarise_scheme(result, result.schemes[name])
        except Exception as error:  # whatever it is, it is this scheme's alone
            schemes[name] = {"failed": one_line(error)}
            continue
        timing[name] = {key: scores.pop(key) for key in CLOCK} | {"cpu_seconds": process_time() - begin}
        schemes[name] = scores
    return {"schemes": schemes, "paper_snr_db": _paper_snr(setup, spec), "timing": timing}


def cell_spec(settings: Mapping[str, Any], path: Path | None = None) -> PipelineSpec:
    """Specification of the SLAM run of one cell: the study's `run`, changed by the panel's size, then by the variant.

    Raises
    ------
    ConfigError
        A key is unknown, a value of the wrong type or out of range.
    """
    content: dict[str, Any] = {"name": "cell", **settings["run"]}
    if size := settings.get("size"):
        content = put_dotted(put_dotted(content, "room.panel_rows", size), "room.panel_cols", size)
    for key, value in settings["variants"].get(settings.get("variant", ""), {}).items():
        content = put_dotted(content, key, value)
    return build_spec(Table(path or Path("run"), content, ()), PipelineSpec, build_settings)


def _paper_snr(setup: RunSetup, spec: PipelineSpec) -> float:
    """SNR [dB] in the paper's definition, of the mean power over some twenty cycles, RIS panel at phase level 0."""
    settings, rows = build_settings(spec), np.arange(len(setup.scene.agent))
    rows = rows[:: max(1, len(rows) // 20)]
    few = subsampled_paths(setup.paths, rows)
    found = paper_snr_db(few, settings.radio, settings.receiver, heading=setup.scene.agent.heading[rows])
    return float(10.0 * np.log10(np.mean(10.0 ** (found / 10.0))))
