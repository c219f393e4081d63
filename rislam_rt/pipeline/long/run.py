"""A long run in slices: simulates the schemes side by side, scores them slice by slice, completes the run folder.

Completed runs, in slices or not, are read here: their results, and the inputs that each scheme's estimator was given.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from rislam_rt.errors import ConfigError, ResultError, RislamError, StoreError
from rislam_rt.model import Paths, Scene, SchemeResult, SlamResult
from rislam_rt.pipeline.long import slices
from rislam_rt.pipeline.long.tally import Tally
from rislam_rt.pipeline.own_methods import is_own
from rislam_rt.pipeline.recordings.inputs import PADDING, Inputs, dataset_to_inputs, marked_rng
from rislam_rt.pipeline.run import late_warnings, library_versions, run_warnings, set_scene
from rislam_rt.pipeline.run_datasets import part_file, part_name
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.scores.component_sources import uses_wall_returns
from rislam_rt.pipeline.scores.summary import summarise, summary_table
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.pipeline.specification.stored_spec import stored_spec
from rislam_rt.pipeline.store import run_folder
from rislam_rt.pipeline.store.exports import record_files
from rislam_rt.progress import Tell
from rislam_rt.scene.write import tum_bytes
from rislam_rt.storage.files import write_pieces
from rislam_rt.storage.netcdf import read_dataset
from rislam_rt.worker_pool import run_side_by_side


class LongRun(NamedTuple):
    """Result of a long run: scores over all cycles, and every n-th cycle for figures."""

    summary: dict[str, Any]
    """All scores, for JSON."""
    shown: SlamResult
    """Every n-th cycle, at most `SHOWN`."""


def run_long(
    scene: Scene, spec: PipelineSpec, store: run_folder.RunFolder, *, rng: np.random.Generator, jobs: int,
    progress: Tell,
) -> LongRun:  # fmt: skip
    """Simulate all schemes of a long run slice by slice, write each slice to the run folder, and complete the folder.

    Schemes that are there already are not run again. Neither memory nor what is returned grows with the cycles: the
    slices' files are the result.

    Raises
    ------
    ConfigError
        Scene and specification do not fit (see `check_run`).
    StoreError
        The disk refused.
    TraceError, SetupError
        The traced channel failed, or the machine lacks what it needs.
    """
    scene, body, seeds = set_scene(scene, spec, rng=rng)
    run, folder, cycles = store.identity.digest, store.folder, len(scene.agent)
    todo = [name for name in spec.schemes if not store.holds(slices.slice_files(name, cycles))]
    seconds = 0.0
    try:
        common = (scene, body, spec, seeds, folder, run)
        for name, outcome in run_side_by_side(slices.run_slices, todo, common, jobs, progress):
            if isinstance(outcome, RislamError):
                raise outcome
            store.adopt(slices.slice_files(name, cycles))
            seconds = max(seconds, float(outcome))
    finally:
        _remove_unfinished(store)
    about = {
        "name": spec.name, "seed": spec.seed, "cycles": cycles, "schemes": list(spec.schemes),
        "seconds": {"trace": seconds}, "warnings": list(run_warnings(scene, spec)),
        "config": spec.model_dump(mode="json"), "slices": len(slices.slice_bounds(cycles)),
    }  # fmt: skip
    found = _gather(folder, scene, {**about, "versions": library_versions()}, run)
    _complete(store, scene, found, about)
    return found


def _gather(
    folder: Path, scene: Scene, about: Mapping[str, Any], run: str, summary: dict[str, Any] | None = None
) -> LongRun:
    """Read a long run's slices and return its scores, and every n-th cycle for figures; `about` as in its marker.

    Scores that are given as `summary` are not counted anew, and its warnings are taken over: methods of the user's own
    are then not asked for anything, as they need not be there.
    """
    schemes, scores, paths, motion = {}, {}, None, scene.agent
    spec = stored_spec(about["config"])
    settings = build_settings(spec)
    for name in about["schemes"]:
        parts = slices.read_parts(folder, name, scene, run)
        if summary is not None:
            motion, paths, schemes[name] = slices.subsample_scheme(parts, scene)
            continue
        tally = Tally(scene, about["config"]["budget"], use_vt=uses_wall_returns(name, settings))
        motion, paths, schemes[name] = slices.subsample_scheme(tally.counting(parts), scene)
        scores[name] = tally.scores()
    if paths is None:
        raise ResultError(f"{folder}: a run without schemes; run again with another --out")
    stride = -(-len(scene.agent) // slices.SHOWN)
    if summary is None:
        late = late_warnings(replace(scene, agent=motion), paths, spec)
        told = f"a run in slices: no posterior bound, and figures show one cycle in {stride}"
        lines = (*about["warnings"], *late, told)
    else:
        lines = tuple(summary["warnings"])
    shown = run_folder.result_of_marker({**about, "warnings": lines}, replace(scene, agent=motion), paths, schemes)
    return LongRun(summary or summary_table(shown, scores, len(scene.agent)), shown)


def read_any(folder: Path) -> LongRun:
    """Read a completed run folder, in slices or not, score it anew, and return scores and the cycles for figures.

    Where a method of the user's own cannot be loaded, the scores are those that the run stored, and a warning says so.

    Raises
    ------
    ResultError
        One of its files is missing, damaged or changed; another version wrote it, with settings that this one lacks.
    ConfigError
        The folder is not a completed run.
    """
    about, summary = checked_slices(folder, methods=False), None
    result = run_folder.read_run(folder) if about is None else None
    if why := _why_not_scored((result.config if result else about or {})["schemes"]):
        summary = run_folder.read_summary(folder, run_folder.read_marker(folder))
        summary["warnings"] = [
            *summary["warnings"],
            f"{why.partition(';')[0]}; these scores are those that the run stored",
        ]
    if about is None or result is not None:
        assert result is not None
        return LongRun(summary or summarise(result), result)
    with run_folder.reading_run(folder):
        return _gather(folder, run_folder.read_room(folder, about), about, about["identity"], summary)


def _why_not_scored(schemes: Iterable[str]) -> str:
    """Why a run of these schemes, long or not, cannot be scored anew: one of the user's own cannot be loaded."""
    for name in schemes:
        try:
            SCHEMES[name]
        except ConfigError as error:
            return str(error)
    return ""


def read_whole(folder: Path) -> SlamResult:
    """Read a completed run from its folder, all cycles of it, in slices or not.

    Raises
    ------
    ResultError
        One of its files is missing, damaged or changed; another version wrote it, with settings that this one lacks.
    ConfigError
        The folder is not a completed run.
    """
    about = checked_slices(folder)
    if about is None:
        return run_folder.read_run(folder)
    with run_folder.reading_run(folder):
        scene, paths = run_folder.read_room(folder, about), list[Paths]()
        schemes: dict[str, SchemeResult] = {}
        for name in about["schemes"]:
            parts = list(slices.read_parts(folder, name, scene, about["identity"]))
            paths = [part.paths for part in parts]
            schemes[name] = slices.join_schemes([part.scheme for part in parts], paths)
        return run_folder.result_of_marker(about, scene, slices.join_paths(paths), schemes)


def checked_slices(folder: Path, *, methods: bool = True) -> dict[str, Any] | None:
    """Marker of a completed run in slices, whose settings this version knows and whose files are as they were written;
    None if the run is not in slices. Without `methods`, those of the user's own need not be there.

    Raises
    ------
    ResultError
        A file is missing, damaged or changed; another version wrote it, with settings that this one lacks.
    ConfigError
        The run is not completed.
    """
    about = run_folder.read_marker(folder) if (folder / run_folder.RUN_FILE).is_file() else {}
    if "config" in about:
        _check_settings(folder, about["config"], methods)
    if "slices" not in about:
        return None
    if about["state"] != run_folder.DONE:
        raise ConfigError(f"{folder}: not a completed run; the command that began it goes on with it")
    run_folder.check_files(folder, about)
    return about


def _check_settings(folder: Path, config: Mapping[str, Any], methods: bool) -> None:
    """Check that this version knows all settings of a run read from `folder`, as its bounds are computed from them."""
    try:
        PipelineSpec.model_validate(dict(config)) if methods else stored_spec(config)
    except ValidationError as error:
        first = error.errors()[0]
        if first["type"] == "value_error" and is_own(str(first["input"])):  # and its file is not to be found
            said = str(first["msg"]).removeprefix("Value error, ")
            said = said.replace("beside the pipeline file", "into the working folder")
            raise ConfigError(f"{folder}: {said}") from None
        strange = ".".join(str(part) for part in error.errors()[0]["loc"])
        more = f" and {error.error_count() - 1} more" if error.error_count() > 1 else ""
        raise ResultError(
            f"{folder}: made by another version of the program, with settings that this one does not take ({strange}"
            f"{more}); report it with that version, or run again with another --out"
        ) from None


def read_given(folder: Path, scheme: str) -> tuple[Inputs, np.random.Generator]:
    """Read what a scheme's estimator was given over a whole run, from its measurements in the run folder: its inputs,
    and its random generator as it got it.

    Raises
    ------
    ResultError
        There are none, or they are damaged.
    """
    one = part_file(folder, "measurements", scheme)
    places = sorted((folder / slices.FOLDER).glob("*"))
    files = [one] if one.is_file() else [part_file(place, "measurements", scheme) for place in places]
    files = [file for file in files if file.is_file()]
    if not files:
        raise ResultError(f"{one}: no such file, as another version wrote the run; run again with another --out")
    try:
        data, *more = (read_dataset(file) for file in files)
        if more:
            import xarray as xr

            parts = [data, *more]
            data = xr.concat(
                parts, "time", data_vars="minimal", combine_attrs="override", join="outer", fill_value=PADDING
            )
        rng = marked_rng(data)
        if rng is None:
            raise ResultError(f"{files[0]}: does not say which random numbers were drawn; run again with another --out")
        inputs = dataset_to_inputs(data)
    except (KeyError, ValueError, TypeError, ConfigError, StoreError) as error:
        cause = f"{type(error).__name__}: {error}"[:120]
        raise ResultError(f"{files[0]}: damaged ({cause}); run again with another --out") from None
    return inputs._replace(time=inputs.time - inputs.time[0], since=inputs.since + float(inputs.time[0])), rng


def _complete(store: run_folder.RunFolder, scene: Scene, found: LongRun, about: Mapping[str, Any]) -> None:
    """Write the files of a long run that are not in slices: trajectories, maps, scores and, last, the marker."""
    agent, run = scene.agent, store.identity.digest
    whole = (agent[first:last] for first, last in slices.slice_bounds(len(agent)))
    tracks = {"truth.tum": (tum_bytes(motion.time, motion.position, motion.heading) for motion in whole)}
    for name in about["schemes"]:
        parts = zip(slices.slice_bounds(len(agent)), slices.read_schemes(store.folder, name, scene, run), strict=True)
        tracks[part_name("estimate", name, ".tum")] = (
            tum_bytes(agent.time[first:last], part.position, part.heading) for (first, last), part in parts
        )
    for name, pieces in tracks.items():
        write_pieces(store.folder / name, pieces)
    store.adopt(tracks)
    for name, content in record_files(found.shown, scene, found.summary, store.identity.content.get("own", {})).items():
        store.put(name, content)
    store.mark(run_folder.DONE, about)


def _remove_unfinished(store: run_folder.RunFolder) -> None:
    """Remove the slices of schemes that were interrupted in a long run: these schemes begin anew."""
    for place in sorted((store.folder / slices.FOLDER).glob("*")):
        for file in place.glob("*.nc"):
            if str(file.relative_to(store.folder)) not in store.files:
                file.unlink(missing_ok=True)
        with suppress(OSError):
            place.rmdir()
    with suppress(OSError):
        (store.folder / slices.FOLDER).rmdir()
