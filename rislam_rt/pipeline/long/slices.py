"""Long runs: traced, led and written slice by slice, so that memory does not grow with the number of cycles.

A scheme goes through the slices one after the other and leaves a file in each slice's folder; the agent, its generators
and the panel go along, the paths and the cycles' records do not. Noise is drawn for each path of a slice, so that the
law is that of a run in one piece, and its draws are not.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from rislam_rt.errors import ResultError
from rislam_rt.model import Body, Paths, Scene, SchemeResult, Trajectory
from rislam_rt.pipeline.dataset import (
    check_dataset,
    dataset_to_paths,
    dataset_to_scheme,
    paths_to_dataset,
    scheme_to_dataset,
    seal_dataset,
)
from rislam_rt.pipeline.long.join import join_paths, join_schemes, subsampled_paths, subsampled_scheme
from rislam_rt.pipeline.recordings.inputs import given_to_dataset
from rislam_rt.pipeline.room.diffuse_clutter import trace_diffuse_clutter
from rislam_rt.pipeline.run import build_channel
from rislam_rt.pipeline.scheme_simulation import SchemeSimulation
from rislam_rt.pipeline.seeds import Seeds
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.pipeline.specification.spec import PipelineSpec
from rislam_rt.progress import Tell
from rislam_rt.storage.netcdf import read_dataset, write_dataset

SLICE = 1000
"""Cycles of a slice. With the paper's room a cycle holds 0.1 MB while it is traced: 0.1 GB a slice."""
SHOWN = 2000
"""Most cycles that figures of a run in slices are drawn from."""
FOLDER, PATHS_FILE = "slices", "paths.nc"


class SlicePart(NamedTuple):
    """One slice of one scheme, as it was written."""

    motion: Trajectory
    paths: Paths
    scheme: SchemeResult


def slice_bounds(cycles: int) -> list[tuple[int, int]]:
    """First cycle of each slice, and the first one after it."""
    return [(first, min(first + SLICE, cycles)) for first in range(0, cycles, SLICE)]


def slice_file(folder: Path, number: int, name: str) -> Path:
    """A file of a slice."""
    return folder / FOLDER / f"{number:05d}" / name


def run_slices(
    name: str, scene: Scene, body: Body, spec: PipelineSpec, seeds: Seeds, folder: Path, run: str, tell: Tell
) -> float:
    """Lead one scheme through all slices, each written to `folder` when it is done. Returns the seconds of tracing.

    `run` is the run's identity, which every file carries.

    Raises
    ------
    StoreError
        The disk refused.
    TraceError, SetupError
        The traced channel failed, or the machine lacks what it needs.
    """
    radio = build_radio(spec.radio)
    channel = build_channel(spec.channel, scene, radio, spec.depth)
    walk, seconds, cycles = SchemeSimulation(name, scene, body, spec, seeds), 0.0, len(scene.agent)
    for number, (first, last) in enumerate(slice_bounds(cycles)):
        begin = perf_counter()
        paths = channel.paths(scene.agent[first : min(last + walk.foresight, cycles)])
        extras = trace_diffuse_clutter(
            scene, radio, scene.agent[first : min(last + walk.foresight, cycles)], spec.extras
        )
        seconds += perf_counter() - begin
        part = walk.lead(paths, first, last, tell, extras)
        own = paths if walk.foresight == 0 else subsampled_paths(paths, np.arange(last - first))
        for file, data in (
            (slice_file(folder, number, PATHS_FILE), paths_to_dataset(own, scene.agent[first:last])),
            (slice_file(folder, number, f"scheme_{name}.nc"), scheme_to_dataset(part)),
            (slice_file(folder, number, f"measurements_{name}.nc"), given_to_dataset(part)),
        ):
            write_dataset(seal_dataset(data, run=run, slice=str(number)), file)
    return seconds


def slice_files(name: str, cycles: int) -> list[str]:
    """Names below the run's folder of all files that a scheme in slices leaves."""
    count = len(slice_bounds(cycles))
    return [
        str(slice_file(Path(), number, file))
        for number in range(count)
        for file in (PATHS_FILE, f"scheme_{name}.nc", f"measurements_{name}.nc")
    ]


def read_parts(folder: Path, name: str, scene: Scene, run: str) -> Iterator[SlicePart]:
    """The slices of a scheme in the order of time, one at a time.

    Raises
    ------
    ResultError
        A file is not as it was written, or of another run.
    StoreError
        A file is missing or cannot be read.
    """
    for number, (first, last) in enumerate(slice_bounds(len(scene.agent))):
        found = []
        for what in (PATHS_FILE, f"scheme_{name}.nc"):
            file = slice_file(folder, number, what)
            data = read_dataset(file)
            check_dataset(data, file, run=run, slice=str(number), cycles=last - first)
            found.append(data)
        scheme = dataset_to_scheme(found[1])
        if scheme.scheme != name:
            raise ResultError(f"{file}: holds scheme '{scheme.scheme[:40]}'; run again with another --out")
        yield SlicePart(scene.agent[first:last], dataset_to_paths(found[0]), scheme)


def subsample_scheme(parts: Iterable[SlicePart], scene: Scene) -> tuple[Trajectory, Paths, SchemeResult]:
    """Every n-th cycle of a scheme whose slices are `parts`, at most `SHOWN` in all, for figures."""
    stride = -(-len(scene.agent) // SHOWN)
    paths, schemes, at = [], [], 0
    for part in parts:
        rows = np.arange((-at) % stride, len(part.motion), stride)
        at += len(part.motion)
        if len(rows):
            paths.append(subsampled_paths(part.paths, rows))
            schemes.append(subsampled_scheme(part.scheme, rows))
        last_map = part.scheme.map
    joined = replace(join_schemes(schemes, paths), map=last_map)
    return scene.agent[::stride], join_paths(paths), joined
