"""Slices of long runs: paths are found and schemes simulated for some cycles at a time, each written to a file.

A scheme goes through the slices one after the other; agent, generators and panel are kept from slice to slice, paths
and the cycles' records are not, so that memory does not grow with the cycles. Noise is drawn for each path of a slice:
its distribution is that of a run in one piece, its draws are not.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Integers
from rislam_rt.errors import ResultError
from rislam_rt.model import NOTHING, Body, Paths, Scene, SchemeResult, Trajectory
from rislam_rt.model.paths import COURSE
from rislam_rt.pipeline import run_datasets
from rislam_rt.pipeline.channels import build_channel
from rislam_rt.pipeline.recordings.inputs import given_to_dataset
from rislam_rt.pipeline.room.diffuse_clutter import trace_diffuse_clutter
from rislam_rt.pipeline.scheme_simulation import SchemeSimulation
from rislam_rt.pipeline.seeds import Seeds
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.progress import Tell
from rislam_rt.storage.netcdf import read_dataset, write_dataset

if TYPE_CHECKING:
    import xarray as xr

SLICE = 1000
"""Number of cycles in a slice. In the paper's room the paths of a cycle take 0.1 MB: 0.1 GB a slice."""


def is_long(scene: Scene, spec: PipelineSpec) -> bool:
    """Whether a run has so many cycles that it is simulated in slices."""
    return (spec.cycles or len(scene.agent)) > SLICE


SHOWN = 2000
"""Largest number of cycles that figures of a long run are drawn from."""
FOLDER, PATHS_FILE = "slices", "paths.nc"


class SlicePart(NamedTuple):
    """One slice of a long run, read from its files: true trajectory, true paths and the result of one scheme."""

    motion: Trajectory
    paths: Paths
    scheme: SchemeResult


def slice_bounds(cycles: int) -> list[tuple[int, int]]:
    """First cycle of each slice of a long run, and the first one after the slice."""
    return [(first, min(first + SLICE, cycles)) for first in range(0, cycles, SLICE)]


def slice_file(folder: Path, number: int, name: str) -> Path:
    """Path of a file `name` of slice `number` in a run folder."""
    return folder / FOLDER / f"{number:05d}" / name


def run_slices(
    name: str, scene: Scene, body: Body, spec: PipelineSpec, seeds: Seeds, folder: Path, run: str, tell: Tell
) -> float:
    """Simulate one scheme over all slices of a long run and write each to `folder`; return the seconds of path finding.

    `run` is the run's identity, which is written into every file.

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
        begin, motion = perf_counter(), scene.agent[first : min(last + walk.foresight, cycles)]
        paths = channel.paths(motion)
        extras = trace_diffuse_clutter(scene, radio, motion, spec.extras)
        seconds += perf_counter() - begin
        part = walk.lead(paths, first, last, tell, extras)
        own = paths if walk.foresight == 0 else subsampled_paths(paths, np.arange(last - first))
        for file, data in (
            (slice_file(folder, number, PATHS_FILE), run_datasets.paths_to_dataset(own, scene.agent[first:last])),
            (slice_file(folder, number, run_datasets.part_name("scheme", name)), run_datasets.scheme_to_dataset(part)),
            (slice_file(folder, number, run_datasets.part_name("measurements", name)), given_to_dataset(part)),
        ):
            write_dataset(run_datasets.seal_dataset(data, run=run, slice=str(number)), file)
    return seconds


def slice_files(name: str, cycles: int) -> list[str]:
    """Names of all slice files that a scheme of a long run writes, relative to the run folder."""
    return [
        str(slice_file(Path(), number, file))
        for number in range(len(slice_bounds(cycles)))
        for file in (PATHS_FILE, *(run_datasets.part_name(kind, name) for kind in ("scheme", "measurements")))
    ]


def read_parts(folder: Path, name: str, scene: Scene, run: str) -> Iterator[SlicePart]:
    """Read the slices of one scheme of a long run from its folder, in order of time, one after the other.

    Raises
    ------
    ResultError
        A file is not as it was written, or of another run.
    StoreError
        A file is missing or cannot be read.
    """
    schemes = read_schemes(folder, name, scene, run)
    for number, ((first, last), scheme) in enumerate(zip(slice_bounds(len(scene.agent)), schemes, strict=True)):
        paths = _read_slice(folder, number, PATHS_FILE, run, last - first)
        yield SlicePart(scene.agent[first:last], run_datasets.dataset_to_paths(paths), scheme)


def read_schemes(folder: Path, name: str, scene: Scene, run: str) -> Iterator[SchemeResult]:
    """Results of one scheme alone, slice by slice, as `read_parts` reads them with paths; its errors are the same."""
    file = run_datasets.part_file(slice_file(folder, 0, ""), "scheme", name).name
    for number, (first, last) in enumerate(slice_bounds(len(scene.agent))):
        scheme = run_datasets.dataset_to_scheme(_read_slice(folder, number, file, run, last - first))
        if scheme.scheme != name:
            place = slice_file(folder, number, file)
            raise ResultError(f"{place}: holds scheme '{scheme.scheme[:40]}'; run again with another --out")
        yield scheme


def _read_slice(folder: Path, number: int, name: str, run: str, cycles: int) -> "xr.Dataset":
    """A file of a slice, of that run and of so many cycles."""
    file = slice_file(folder, number, name)
    data = read_dataset(file)
    run_datasets.check_dataset(data, file, run=run, slice=str(number), cycles=cycles)
    return data


def subsample_scheme(parts: Iterable[SlicePart], scene: Scene) -> tuple[Trajectory, Paths, SchemeResult]:
    """True trajectory, paths and a scheme's result at every n-th cycle of a long run's slices, at most `SHOWN`."""
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


def join_paths(parts: Sequence[Paths]) -> Paths:
    """Join the true paths of consecutive slices of a long run; a path that a slice lacks is not valid there."""
    columns, count = path_columns(parts)
    first: dict[str, Any] = {}
    for name, empty in (("kind", -1), ("landmark", -1), ("num_vertices", 0)):
        first[name] = np.full(count, empty)
    for name in ("tx_walls", "rx_walls"):
        first[name] = np.full((count, max(getattr(p, name).shape[1] for p in parts)), -1)
    for part, column in zip(parts, columns, strict=True):
        for name, value in first.items():
            own = getattr(part, name)
            value[(column, *(slice(0, int(n)) for n in own.shape[1:]))] = own
    course = {name: _spread([getattr(p, name) for p in parts], columns, count) for name in COURSE}
    return replace(parts[0], **first, **course, ris=None)


def join_schemes(parts: Sequence[SchemeResult], paths: Sequence[Paths]) -> SchemeResult:
    """Join the results of one scheme over consecutive slices, gains in columns by path identity as in `paths`."""
    columns, count = path_columns(paths)
    ident = np.unique(np.concatenate([part.ident for part in parts]))
    places = [np.searchsorted(ident, part.ident) for part in parts]
    parent = np.full(len(ident), -1)
    for part, place in zip(parts, places, strict=True):
        parent[place] = np.where(part.parent >= 0, part.parent, parent[place])
    plain = ("time", "position", "velocity", "heading", "covariance", "sent", "applied", "seconds")
    held = ["held", "landmark_position", "ris_probability"]
    if any(part.panel is not None for part in parts):
        parts = [replace(p, panel=np.zeros(p.held.shape, int)) if p.panel is None else p for p in parts]
        held.append("panel")
    # negative numbers (clutter, none) stay; a slice without paths has an entry to look at all the same
    known = [(part.component_path, np.append(column, -1)) for part, column in zip(parts, columns, strict=True)]
    taken = [np.where(path >= 0, column[np.maximum(path, 0)], path) for path, column in known]
    course: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in plain}
    course |= {name: _spread([getattr(part, name) for part in parts], places, len(ident)) for name in held}
    return replace(
        parts[-1],
        **course,
        gain=_spread([part.gain for part in parts], columns, count),
        component_path=_stacked(taken),
        component_landmark=_stacked([part.component_landmark for part in parts]),
        ident=ident,
        parent=parent,
        info={name: np.concatenate([part.info[name] for part in parts]) for name in parts[0].info},
        outcome=tuple(outcome for part in parts for outcome in part.outcome),
        smoothed=None,  # a part looks no further back than its own beginning
        given=None,
    )


def subsampled_paths(paths: Paths, rows: Integers) -> Paths:
    """Paths of the cycles in `rows` alone, of a long run's slice."""
    return replace(paths, **{name: getattr(paths, name)[rows] for name in COURSE}, ris=None)


def subsampled_scheme(scheme: SchemeResult, rows: Integers) -> SchemeResult:
    """Result of a scheme for the cycles in `rows` alone, of a long run's slice."""
    tables = run_datasets.SCHEME | run_datasets.OPTIONAL
    course = {name: getattr(scheme, name) for name, (axes, *_) in tables.items() if axes[0] == "time"}
    return replace(
        scheme, **{name: values[rows] for name, values in course.items() if values is not None},
        info={name: values[rows] for name, values in scheme.info.items()},
        outcome=tuple(scheme.outcome[row] for row in rows), given=None,
    )  # fmt: skip


def path_columns(parts: Sequence[Paths]) -> tuple[list[Integers], int]:
    """For each slice of a long run, the joined column (P,) of each of its paths, by order of first appearance; and the
    number of columns."""
    numbers: dict[tuple[Any, ...], int] = {}
    columns = [
        np.array([numbers.setdefault(p.identity(i), len(numbers)) for i in range(p.num_paths)], dtype=np.int64)
        for p in parts
    ]
    return columns, len(numbers)


def _spread(parts: Sequence[Any], columns: Sequence[Integers], count: int) -> Any:
    """Slices' arrays (K_i, P_i, ...) in one (K, count, ...) under each other, each at its `columns`; zero elsewhere."""
    tail = tuple(max(sizes) for sizes in zip(*(part.shape[2:] for part in parts), strict=True))
    table = np.zeros((sum(map(len, parts)), count, *tail), dtype=parts[0].dtype)
    row = 0
    for part, column in zip(parts, columns, strict=True):
        block = np.zeros((len(part), count, *tail), dtype=part.dtype)
        where: Any = (slice(None), column, *(slice(0, n) for n in part.shape[2:]))
        block[where] = part
        table[row : row + len(part)] = block
        row += len(part)
    return table


def _stacked(parts: Sequence[Integers]) -> Integers:
    """Slices' arrays of different width under each other, rows filled up with `NOTHING`."""
    width = max(part.shape[1] for part in parts)
    return np.concatenate([np.pad(p, ((0, 0), (0, width - p.shape[1])), constant_values=NOTHING) for p in parts])
