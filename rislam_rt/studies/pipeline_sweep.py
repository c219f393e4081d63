"""Sweeps of a pipeline: SLAM runs over axes of its settings and over seeds, and the RMSE at every point."""

import os
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args, get_origin

import numpy as np
from pydantic import BaseModel, Field

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError, ResultError, RislamError
from rislam_rt.evaluate import rms_over_runs
from rislam_rt.model import Scene
from rislam_rt.pipeline.channels import prepare_channel
from rislam_rt.pipeline.own_method_files import own_digests
from rislam_rt.pipeline.run import check_run, library_versions, run_slam
from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.pipeline.specification.read_pipeline import Table, build_spec, make_way, read_table
from rislam_rt.pipeline.specification.section import Positive, Section
from rislam_rt.pipeline.store.identity import code_digest, short_name
from rislam_rt.scene import load_scene
from rislam_rt.shipped import beside_of, room_beside
from rislam_rt.storage.checksums import checksum, read_sealed
from rislam_rt.storage.files import json_file, write_all
from rislam_rt.studies.swept.collect import Group, group_rows, spread
from rislam_rt.sweeps.store import SWEEP_FILE, Row, csv_bytes, rows_by_point
from rislam_rt.sweeps.sweep import Axis, Scalar, Sweep, Value, build_cells, parse_axis

FUNCTION = f"{__name__}:run_cell"


class SweepSection(Section):
    """Settings of a pipeline's sweep, the table `[sweep]` of its file: axes, repetitions, time limit."""

    repeat: Annotated[int, Field(ge=1, le=1_000_000)] = 5
    """Number of runs with different seeds at every point of the axes."""
    paired: list[str] | None = None
    """Axes along which a repetition draws the same noise; all of them by default."""
    time_limit_s: Positive | None = None
    """Longest time one run may take."""
    axes: dict[str, list[Scalar | list[Scalar]]] = Field(default={})
    """Values of the settings to vary, by dotted key."""


class _File(Section):
    sweep: SweepSection = SweepSection()


class SchemeScore(NamedTuple):
    """RMSE of one scheme at one point of a sweep over all repetitions, and counts of failures."""

    point: Mapping[str, Value]
    """Values along the axes, by key."""
    scheme: str
    rmse: tuple[float, ...]
    """Position RMSE [m] of each repetition that ended."""
    interval: tuple[float, float] | None
    """95 % bootstrap interval of the RMSE over the repetitions [m]; None for a single one."""
    diverged: int
    """Number of repetitions that diverged."""
    failed: int
    """Number of repetitions that failed."""
    missing: int
    """Number of repetitions that have not run yet."""
    relative: float | None = None
    """RMSE relative to the start [m] over all repetitions that ended; None where it is not known. Of the other, most
    may be the start's own error, which all schemes share."""
    relative_interval: tuple[float, float] | None = None
    """Its 95 % bootstrap interval [m]; None for a single one."""

    @property
    def overall(self) -> float | None:
        """Position RMSE [m] over all repetitions that ended; None if none did."""
        return float(rms_over_runs(np.array(self.rmse))) if self.rmse else None

    def as_dict(self) -> dict[str, Any]:
        """Scores of a scheme in a pipeline's sweep as plain data, one level deep but for the list of RMSEs."""
        low, high = self.interval or (None, None)
        counts = {"runs": len(self.rmse), "diverged": self.diverged, "failed": self.failed, "missing": self.missing}
        ends = self.relative_interval or (None, None)
        relative = {"relative_rmse_m": self.relative, "relative_low_m": ends[0], "relative_high_m": ends[1]}
        scores = {"rmse_m": self.overall, "low_m": low, "high_m": high, **relative, **counts, "each_m": list(self.rmse)}
        return {**self.point, "scheme": self.scheme, **scores}


def load_section(path: Path, overrides: Sequence[str] = ()) -> SweepSection:
    """Read the table `[sweep]` of a pipeline file.

    Raises
    ------
    ConfigError
        A key is unknown, or a value of the wrong type or out of range. One line.
    """
    table = read_table(path, overrides)
    return build_spec(Table(path, {"sweep": table.sweep or {}}, table.changed), _File, lambda _: None).sweep


def slam_sweep(
    path: Path, overrides: Sequence[str] = (), axes: Sequence[str] = (), *, scene: Path | None = None,
    repeat: int | None = None,
) -> Sweep:  # fmt: skip
    """Sweep of a pipeline file over axes of its settings and over seeds; all settings are checked beforehand.

    Parameters
    ----------
    overrides
        `key=value` settings, for all cells.
    axes
        `key=v1,v2,...`, over those of the file; scenes as seen from the working folder.
    scene
        Scene folder, instead of the one that the pipeline names.
    repeat
        Number of repetitions, instead of the file's.

    Raises
    ------
    ConfigError, SceneError
        A cell could not run. One line.
    """
    section = load_section(path, overrides)
    found = {key: Axis(key, tuple(values)) for key, values in section.axes.items()}
    typed = map(parse_axis, axes)
    given = [Axis(axis.key, tuple(beside_of(path.parent, [*axis.values], axis.key))) for axis in typed]
    twice = [axis.key for number, axis in enumerate(given) if axis.key in {other.key for other in given[:number]}]
    if twice:
        raise ConfigError(f"--axis {twice[0]}: given twice; give all its values in one, as {twice[0]}=V1,V2")
    found |= {axis.key: axis for axis in given}
    for key in ("seed", "kind", "name", "description"):
        if key in found:
            raise ConfigError(f"axis '{key}': no setting to go through; use --repeat for seeds")
    table = read_table(path, overrides)
    make_way(table, tuple(found))
    if scene is not None:
        table.content["scene"] = os.path.relpath(scene, path.parent)
    elif "scene" in found:
        table.content.setdefault("scene", found["scene"].values[0])
    if "scene" not in table.content:
        raise ConfigError(f"{path}: scene: not given; add it, or give --scene DIR")
    spec = build_spec(table, PipelineSpec, build_settings)
    values = tuple(typed_axis(axis) for axis in found.values())
    return Sweep(
        FUNCTION, values, spec.model_dump(mode="json", exclude={"seed", "description"}), repeat or section.repeat,
        spec.seed, tuple(section.paired if section.paired is not None else found),
        {"beside": os.path.abspath(path.parent)}, _depends(path, tuple(found)), spec.name,
    )  # fmt: skip


def default_folder(sweeps: Path, sweep: Sweep) -> Path:
    """Folder of a pipeline's sweep within `sweeps`, `<name>-<scene>`, or, where that holds the sweep of other settings
    or of another scene of the same name, `<name>-<scene>-<hash of the settings>`. The latter is kept to once it exists.

    Other axes and repetitions of the same settings share a folder, and their cells.
    """
    folder, own = sweeps / f"{sweep.name}-{Path(str(sweep.base['scene'])).name}", checksum(sweep.base)
    hashed = sweeps / short_name(folder.name, own)
    if hashed.is_dir():
        return hashed
    if not (folder / SWEEP_FILE).exists():
        return folder
    try:
        same = checksum(read_sealed(folder / SWEEP_FILE)["base"]) == own
    except ResultError:  # damaged: the cells there tell what they are of
        stored = {file.stem for file in (folder / "cells").glob("*.json")}
        same = any(cell.ident in stored for cell in build_cells(sweep))
    return folder if same else hashed


def typed_axis(axis: Axis) -> Axis:
    """Axis of a pipeline's sweep with values in the type of the setting: whole numbers become real, or lists."""
    model: Any = PipelineSpec
    *parents, leaf = axis.key.split(".")
    for part in parents:
        kinds = _kinds(model.model_fields[part].annotation) if part in model.model_fields else []
        model = next((kind for kind in kinds if issubclass(kind, BaseModel)), Section)
    if leaf not in model.model_fields:
        return axis  # building the first cell tells what is wrong with the key
    annotation = model.model_fields[leaf].annotation
    kinds = _kinds(annotation)

    def typed(value: Value) -> Value:
        if get_origin(annotation) is list and not isinstance(value, list):
            return [value]
        return float(value) if type(value) is int and float in kinds and int not in kinds else value

    return Axis(axis.key, tuple(map(typed, axis.values)))


def run_cell(settings: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Do one cell of a pipeline's sweep: simulate a SLAM run and return its scores, those that are times apart."""
    plain = dict(settings)
    beside = Path(plain.pop("beside"))
    spec = PipelineSpec.model_validate({**plain, "seed": seed})
    prepare_channel(spec.channel)
    result = run_slam(load_scene(room_beside(beside, str(spec.scene))), spec, rng=np.random.default_rng(seed))
    summary = summarise(result)
    told = {name: summary[name] for name in ("source", "schemes")}
    return {**_split(told, times=False), "timing": _split(summary, times=True)}


def score_rows(rows: Sequence[Row]) -> list[SchemeScore]:
    """Scores of every scheme at every point of a pipeline's sweep; failures are counted, never dropped."""
    schemes = [cells[0].cell.settings["schemes"] for cells in rows_by_point(rows)]
    return [_score(group, scheme) for group, names in zip(group_rows(rows), schemes, strict=True) for scheme in names]


def write_scores(scores: Sequence[SchemeScore], folder: Path) -> None:
    """Write the scores of a pipeline's sweep as `scores.csv` and `scores.json` beside the table of its cells.

    Raises
    ------
    StoreError
        The disk refused.
    """
    content = [score.as_dict() for score in scores]
    write_all(folder, {"scores.json": json_file(content, sort_keys=True), "scores.csv": csv_bytes(content)})


def _depends(path: Path, keys: tuple[str, ...]) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """Function that checks the settings of a pipeline sweep's cell, and returns the scene's hash and versions that its
    result depends on."""
    load, versions, code, digests = cache(load_scene), library_versions(), code_digest(), cache(own_digests)

    def depends(settings: Mapping[str, Any]) -> dict[str, Any]:
        try:
            spec = build_spec(Table(path, dict(settings), ()), PipelineSpec, build_settings)
            room: Scene = load(room_beside(path.parent, str(spec.scene)))
            check_run(room, spec)
            own = digests((*spec.schemes, spec.channel))
        except RislamError as error:
            if not keys:
                raise
            text = str(error).removeprefix(f"{path}: ")
            raise type(error)(f"axes {', '.join(keys)}: {text}") from None
        return {"scene_sha256": room.digest, "versions": versions, "code": code} | ({"own": own} if own else {})

    return depends


def _kinds(annotation: Any) -> list[type]:
    """All plain types in the annotation of a swept setting, such as those of a union."""
    parts = get_args(annotation)
    if not parts:
        return [annotation] if isinstance(annotation, type) else []
    return [kind for part in parts for kind in _kinds(part)]


def _split(summary: Mapping[str, Any], *, times: bool) -> dict[str, Any]:
    """Entries of a swept run's scores that are times, or all others."""
    kept: dict[str, Any] = {}
    for name, value in summary.items():
        clock = name.endswith("seconds") or name == "over_budget"
        if clock or not isinstance(value, Mapping):
            if clock == times:
                kept[name] = value
        elif (inner := _split(value, times=times)) or not times:
            kept[name] = inner
    return kept


def _score(group: Group, scheme: str) -> SchemeScore:
    """Scores of one scheme at one point of a pipeline's sweep."""
    found = group.column(scheme, "rmse_m")
    rmse, (_, interval) = tuple(found[~np.isnan(found)].tolist()), _value_and_ends(found)
    failed, diverged = group.failed(scheme), group.diverged(scheme)
    relative = _value_and_ends(group.column(scheme, "relative_rmse_m"))
    return SchemeScore(group.point, scheme, rmse, interval, diverged, failed, group.missing, *relative)


def _value_and_ends(rmse: Floats) -> tuple[float | None, tuple[float, float] | None]:
    """RMSE of a pipeline's sweep over its repetitions (R,) [m], and its interval; None where there is none."""
    known = spread(rmse)
    if known is None:
        return None, None
    return known.value, None if np.isnan(known.lower) else (known.lower, known.upper)
