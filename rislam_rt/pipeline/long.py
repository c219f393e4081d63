"""A long run from its slices: schemes side by side, scores counted slice by slice, the folder that it leaves."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.errors import RislamError, StoreError
from rislam_rt.model import Scene, SlamResult
from rislam_rt.pipeline.pieces import write_pieces
from rislam_rt.pipeline.run import Progress, library_versions, panel_warnings, set_scene
from rislam_rt.pipeline.slices import SHOWN, SLICE, is_complete, read_parts, run_slices, slice_bounds, thin_scheme
from rislam_rt.pipeline.spec import PipelineSpec
from rislam_rt.pipeline.tally import Tally
from rislam_rt.pipeline.workers import run_side_by_side
from rislam_rt.scene.write import tum_bytes


class LongRun(NamedTuple):
    """A run in slices: its scores over all cycles, and every n-th cycle for figures."""

    summary: dict[str, Any]
    shown: SlamResult


def is_long(scene: Scene, spec: PipelineSpec) -> bool:
    """Whether a run goes slice by slice."""
    return (spec.cycles or len(scene.agent)) > SLICE


def run_long(
    scene: Scene, spec: PipelineSpec, folder: Path, *, rng: np.random.Generator, jobs: int, progress: Progress
) -> LongRun:
    """Run all schemes of a specification, each slice by slice into `folder`; schemes that are there are not run again.

    Memory does not grow with the cycles, nor does a result that a caller holds: the slices' files are the result.

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
    write_pieces(folder / "truth.tum", _truth_lines(scene))
    todo = [name for name in spec.schemes if not is_complete(folder, name, len(scene.agent))]
    seconds = 0.0
    for _, outcome in run_side_by_side(run_slices, todo, (scene, body, spec, seeds, folder), jobs, progress):
        if isinstance(outcome, RislamError):
            raise outcome
        seconds = max(seconds, float(outcome))
    for name in spec.schemes:
        write_pieces(folder / f"estimate_{name}.tum", _estimate_lines(folder, name, scene))
    about = {
        "name": spec.name,
        "config": spec.model_dump(mode="json"),
        "seed": spec.seed,
        "versions": library_versions(),
        "seconds": {"trace": seconds},
        "warnings": panel_warnings(scene, spec),
    }
    return gather_long(folder, scene, about)


def gather_long(folder: Path, scene: Scene, about: Mapping[str, Any]) -> LongRun:
    """Scores and figures' cycles of schemes whose slices are all there; `about` as in the fields of `SlamResult`.

    Raises
    ------
    StoreError
        A file is missing or damaged.
    """
    config = about["config"]
    schemes, scores, paths, motion = {}, {}, None, scene.agent
    for name in config["schemes"]:
        tally = Tally(scene, config["budget"])
        for part in read_parts(folder, name, scene):
            tally.add(part)
        scores[name] = tally.scores()
        motion, paths, schemes[name] = thin_scheme(folder, name, scene)
    if paths is None:
        raise StoreError(f"{folder}: a run without schemes; run again")
    stride = -(-len(scene.agent) // SHOWN)
    lines = (*about["warnings"], f"a run in slices: figures show every {stride}th cycle, and there is no bound")
    shown = SlamResult(scene=replace(scene, agent=motion), paths=paths, schemes=schemes,
                       **{**about, "warnings": lines})  # fmt: skip
    summary = {
        "seed": about["seed"],
        "cycles": len(scene.agent),
        "pipeline": about["name"],
        "scene": scene.name,
        "source": paths.source,
        "trace_seconds": about["seconds"].get("trace", 0.0),
        "warnings": list(lines),
        "schemes": scores,
    }
    return LongRun(summary, shown)


def _truth_lines(scene: Scene) -> Iterator[bytes]:
    for first, last in slice_bounds(len(scene.agent)):
        motion = scene.agent[first:last]
        yield tum_bytes(motion.time, motion.position, motion.heading)


def _estimate_lines(folder: Path, name: str, scene: Scene) -> Iterator[bytes]:
    for part in read_parts(folder, name, scene):
        yield tum_bytes(part.motion.time, part.scheme.position, part.scheme.heading)
