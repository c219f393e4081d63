"""Conversion of a swept study to a sweep: its axes, what its cells depend on, a check of all settings, its record."""

import os
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from rislam_rt.errors import ConfigError, RislamError
from rislam_rt.model import Scene
from rislam_rt.pipeline.own_method_files import own_digests
from rislam_rt.pipeline.run import check_run, library_versions
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.pipeline.store.identity import code_digest
from rislam_rt.scene import load_scene
from rislam_rt.shipped import room_beside
from rislam_rt.studies.spec import study_record
from rislam_rt.studies.swept.cell import FUNCTION, cell_spec
from rislam_rt.studies.swept.spec import Fig4bSpec, Fig4cSpec, HardwareSpec, RoomsSpec, SweptSpec
from rislam_rt.sweeps import Axis, Sweep

RECEIVER = "rislam_rt.studies.swept.receiver:run_cell"
"""Function of the hardware study's cells, which simulate the receiver alone."""
SNR = "run.radio.reference_snr_db"
"""Key of the SNR axis of Fig. 4(b)."""


def build_sweep(spec: SweptSpec, pipeline: Path, scene: Path | None = None) -> Sweep:
    """Build the sweep of a swept study; a repetition has the same motion and noise at every point of the axes.

    Parameters
    ----------
    pipeline
        The study's file, which scene folders are relative to.
    scene
        Scene folder, instead of the one that the file names.

    Raises
    ------
    ConfigError
        No scene is named.
    """
    values = {
        "scene": spec.scenes if isinstance(spec, RoomsSpec) else (),
        "size": spec.sizes if isinstance(spec, Fig4cSpec) else (),
        "variant": [variant.name for variant in spec.all_variants],
        SNR: spec.snr_db if isinstance(spec, Fig4bSpec) else (),
    }
    axes = tuple(Axis(key, tuple(own)) for key, own in values.items() if own)
    beside, function = pipeline.parent, FUNCTION
    base: dict[str, Any] = {"run": dict(spec.run)}
    if isinstance(spec, RoomsSpec):
        if scene is not None:
            raise ConfigError(f"--scene {scene}: a pipeline of kind 'rooms' names its rooms; set 'scenes'")
    else:
        named = os.path.relpath(scene, beside) if scene is not None else getattr(spec, "scene", None)
        if named is None:
            raise ConfigError(f"{pipeline}: scene: not given; add it, or give --scene DIR")
        base["scene"] = named
    variants = {variant.name: dict(variant.set) for variant in spec.all_variants}
    local = {"beside": os.path.abspath(beside), "variants": variants}
    keys = tuple(axis.key for axis in axes)
    if isinstance(spec, HardwareSpec):
        base["places"], function = spec.places, RECEIVER
    return Sweep(function, axes, base, spec.repetitions, spec.seed, keys, local, _depends(pipeline, local), spec.name)


def check_swept(spec: SweptSpec) -> None:
    """Check a swept study's settings of the SLAM run under every variant; its rooms are checked by the sweep.

    Raises
    ------
    ConfigError
        A setting is unknown, or its value unusable. The message begins with the field.
    """
    variants = {variant.name: dict(variant.set) for variant in spec.all_variants}
    for name in variants or [""]:
        try:
            cell_spec({"run": spec.run, "variant": name, "variants": variants})
        except ConfigError as error:
            place = f"run, with variant '{name}'" if name else "run"
            raise ConfigError(f"{place}: {str(error).removeprefix('run: ')}") from None


def _depends(pipeline: Path, local: Mapping[str, Any]) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """Function that checks a cell's settings, and returns all that its result depends on: settings, scene, versions."""
    load, versions, code, digests = cache(load_scene), library_versions(), code_digest(), cache(own_digests)

    def depends(settings: Mapping[str, Any]) -> dict[str, Any]:
        spec = cell_spec({**settings, **local}, pipeline)
        room = load(room_beside(pipeline.parent, str(settings["scene"])))
        found = checked_settings(room, spec, spec.schemes, f"{pipeline}: {settings['scene']}", digests)
        return {**found, "scene_sha256": room.digest, "versions": versions, "code": code}

    return depends


def checked_settings(
    room: Scene, spec: PipelineSpec, schemes: Sequence[str], place: str,
    digests: Callable[[tuple[str, ...]], dict[str, str]],
) -> dict[str, Any]:  # fmt: skip
    """Settings that a cell's result depends on, and the digests of a user's own methods, after a check with the room.

    `schemes` are those that run there; `place` begins an error's line; `digests` are `own_digests`, kept for a sweep.
    """
    try:
        check_run(room, spec.model_copy(update={"schemes": list(schemes)}))
    except RislamError as error:
        raise type(error)(f"{place}: {error}") from None
    own = digests((*spec.schemes, spec.channel))
    config = spec.model_dump(mode="json", exclude={"name", "description", "scene", "seed"})
    return {"config": config} | ({"own": own} if own else {})


def swept_record(spec: SweptSpec, sweep: Sweep, pipeline: Path) -> dict[str, Any]:
    """Record for JSON of what is needed to repeat a swept study, with the SLAM run's settings, defaults filled in."""
    named = next((axis.values for axis in sweep.axes if axis.key == "scene"), [sweep.base.get("scene")])
    scenes = [load_scene(room_beside(pipeline.parent, str(name))) for name in named]
    return study_record(spec, scenes, settings=cell_spec({"run": spec.run, "variants": {}}).model_dump(mode="json"))
