"""One cell of the study in unseen rooms: every scheme in one random room at one SNR; saves what is asked for."""

import json
from collections.abc import Mapping
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rislam_rt.model import RisCode, SchemeResult
from rislam_rt.pipeline.channels import prepare_channel
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.recordings.replay import Recorder
from rislam_rt.pipeline.run import RunSetup, prepare_setup, run_scheme
from rislam_rt.pipeline.scheme_simulation import without_panel
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.signal_simulation import SignalsSpec, build_signals
from rislam_rt.pipeline.specification.pipeline_spec import ESTIMATOR_SECTIONS, PipelineSpec
from rislam_rt.progress import tell_nobody
from rislam_rt.ris import rephase
from rislam_rt.scene import write_scene
from rislam_rt.scene.random_rooms import RandomRoom, Ways, draw_room
from rislam_rt.storage.netcdf import write_dataset
from rislam_rt.studies.score_card.recording_file import Recording, write_recording
from rislam_rt.studies.score_card.score import score_run
from rislam_rt.studies.score_card.truth import build_truth
from rislam_rt.studies.swept.cell import cell_spec
from rislam_rt.sweeps.cell_work import one_line

if TYPE_CHECKING:
    import xarray as xr

FUNCTION = f"{__name__}:run_cell"
SEEN_BY_TRACER_NOT = ("name", "description", "scene", "seed", "schemes", "receiver", "design", "slam")
"""Settings that true motion and paths do not depend on, beside those of the other estimators and the noise."""


def run_cell(settings: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Do one cell of the study in unseen rooms: simulate all schemes in one random room and return their scores.

    A scheme that fails has its error in place of scores; the others go on. All random numbers come from the room's own
    seed, so that every variant and SNR has the same motion and noise.
    """
    spec = cell_spec(settings)
    prepare_channel(spec.channel)
    room, setup = find_setup(int(settings["room"]), trace_key(spec), settings.get("ways", "anyhow"))
    schemes: dict[str, Any] = {}
    timing: dict[str, Any] = {"trace_seconds": setup.seconds}
    for asked in spec.schemes:
        try:
            schemes[asked], timing[asked] = _run(scheme_here(asked, room), setup, spec, room_traits(room), settings)
        except Exception as error:  # whatever it is, it is this scheme's alone
            schemes[asked] = {"failed": one_line(error)}
    return {"traits": room_traits(room), "schemes": schemes, "timing": timing}


def _run(
    name: str, setup: RunSetup, spec: PipelineSpec, traits: Mapping[str, Any], settings: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Simulate one scheme in an unseen room, save its outputs if asked, and return scores and times."""
    recorder = Recorder(ESTIMATORS[SCHEMES[name].estimator])
    result = run_scheme(name, setup, spec, tell_nobody, recorder.estimator)
    truth = build_truth(setup.scene, setup.paths, result, spec)
    scores = {"ran": name, **score_run(truth, recorder.inputs, recorder.answers)}
    if settings.get("save", "nothing") != "nothing":
        ways = "" if traits["ways"] == "anyhow" else f"_{traits['ways']}"
        folder = Path(settings.get("data", ".")) / f"room_{int(traits['seed']):05d}{ways}"
        label, config = f"{cell_label(settings)}{name}", spec.model_dump(mode="json")
        write_recording(Recording(recorder.inputs, truth, name, config, traits, scores), folder / f"{label}.nc")
        if not (folder / "scene").exists():
            write_scene(setup.scene, folder / "scene")
        if settings["save"] == "signals":
            write_dataset(_applied_signals(setup, result, spec, int(traits["seed"])), folder / f"{label}_signals.nc")
    return scores, {"cycle_s": recorder.answers.seconds}


def _applied_signals(setup: RunSetup, result: SchemeResult, spec: PipelineSpec, seed: int) -> "xr.Dataset":
    """Samples of the received signal under the codes that a run in an unseen room applied; their noise is not that of
    its components."""
    section = spec.receiver.model_copy(update={"estimator": "waveform"})
    own = SignalsSpec(seed=seed, code="zero", radio=spec.radio, receiver=section)
    paths = without_panel(setup.paths)
    if result.levels:
        paths = rephase(setup.paths, RisCode(result.applied, result.levels))
    rng = np.random.default_rng(setup.seeds.noise)
    return build_signals(setup.scene, paths, own, rng=rng, on_cycle=lambda: None).assign_attrs(code="as applied")


def cell_label(settings: Mapping[str, Any]) -> str:
    """Label of a cell from its variant and SNR, for the names of saved files."""
    snr = settings["run"].get("radio", {}).get("reference_snr_db")
    parts = settings.get("variant"), None if snr is None else f"{snr:g}dB"
    return "".join(f"{part}_" for part in parts if part)


def scheme_here(asked: str, room: RandomRoom) -> str:
    """Name of the scheme to run: the one asked for or, in a room without a panel, that of its estimator without."""
    scheme = SCHEMES[asked]
    if room.scene.ris is not None or not scheme.panel:
        return asked
    return next(name for name, s in SCHEMES.items() if s.estimator == scheme.estimator and not s.panel)


def trace_key(spec: PipelineSpec) -> str:
    """Settings that true motion and paths of a cell in unseen rooms depend on, as text: the key of the cache."""
    content = spec.model_dump(mode="json", exclude={*SEEN_BY_TRACER_NOT, *ESTIMATOR_SECTIONS})
    content["radio"] |= {"reference_snr_db": None, "noise_psd": None}
    return json.dumps(content, sort_keys=True)


@lru_cache(maxsize=2)
def find_setup(seed: int, key: str, ways: Ways = "anyhow") -> tuple[RandomRoom, RunSetup]:
    """Draw the random room of a seed with one of `Ways`, its true motion and its paths; the last two are cached for
    further cells."""
    spec = PipelineSpec.model_validate({**json.loads(key), "name": "trace", "schemes": ["no_ris"]})
    room = draw_room(seed, ways)
    return room, prepare_setup(room.scene, spec, rng=np.random.default_rng(seed))


def room_traits(room: RandomRoom) -> dict[str, Any]:
    """Properties of an unseen room as plain data: seed, shape and other classes, number of scatterers."""
    traits = {field.name: getattr(room, field.name) for field in fields(room) if field.name != "scene"}
    return {**traits, "scatterers": len(room.scene.scatterers)}
