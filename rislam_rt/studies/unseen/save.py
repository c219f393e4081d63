"""Save the outputs of runs in unseen rooms: recorded runs, rooms as scene folders, samples of received signals."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.model import RisCode, Scene, SchemeResult
from rislam_rt.pipeline.run import RunSetup
from rislam_rt.pipeline.scheme_simulation import without_panel
from rislam_rt.pipeline.signals import SignalsSpec, build_signals
from rislam_rt.pipeline.specification.spec import PipelineSpec
from rislam_rt.ris import rephase
from rislam_rt.scene import write_scene
from rislam_rt.storage.netcdf import write_dataset
from rislam_rt.studies.unseen.recording_file import Recording, write_recording


def save_run(recording: Recording, folder: Path, label: str) -> Path:
    """Save a recorded run as `<room>/<label>.nc`, and return the file's path.

    Raises
    ------
    StoreError
        The disk refused.
    """
    file = room_folder(folder, recording.traits) / f"{label}.nc"
    write_recording(recording, file)
    return file


def save_room(scene: Scene, traits: Mapping[str, Any], folder: Path) -> None:
    """Save an unseen room as a scene folder with the true motion as its trajectory, unless it is there.

    Raises
    ------
    StoreError
        The disk refused.
    """
    target = room_folder(folder, traits) / "scene"
    if not target.exists():
        write_scene(scene, target)


def save_signals(
    setup: RunSetup, result: SchemeResult, spec: PipelineSpec, traits: Mapping[str, Any], folder: Path, label: str
) -> None:
    """Save samples of the received signal under the codes that a run applied, as `<room>/<label>_signals.nc`.

    The noise is drawn anew from the room's seed: it is not that of the recorded components.

    Raises
    ------
    StoreError
        The disk refused.
    """
    section = spec.receiver.model_copy(update={"estimator": "waveform"})
    own = SignalsSpec(seed=int(traits["seed"]), code="zero", radio=spec.radio, receiver=section)
    paths = without_panel(setup.paths)
    if result.levels:
        paths = rephase(setup.paths, RisCode(result.applied, result.levels))
    rng = np.random.default_rng(setup.seeds.noise)
    data = build_signals(setup.scene, paths, own, rng=rng, on_cycle=lambda: None)
    target = room_folder(folder, traits)
    target.mkdir(parents=True, exist_ok=True)
    write_dataset(data.assign_attrs(code="as applied"), target / f"{label}_signals.nc")


def room_folder(folder: Path, traits: Mapping[str, Any]) -> Path:
    """Folder of all saved files of an unseen room, named by its seed."""
    return folder / f"room_{int(traits['seed']):05d}"
