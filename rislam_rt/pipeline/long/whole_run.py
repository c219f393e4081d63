"""A completed run as a whole, in slices or not: its result, and the inputs that each scheme's estimator was given."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.errors import ConfigError, ResultError, StoreError
from rislam_rt.model import SlamResult
from rislam_rt.pipeline.long import slices
from rislam_rt.pipeline.long.run import checked_slices
from rislam_rt.pipeline.recordings.inputs import PADDING, Inputs, dataset_to_inputs, marked_rng
from rislam_rt.pipeline.store import run_folder
from rislam_rt.scene import load_scene
from rislam_rt.storage.netcdf import read_dataset


class GivenInputs(NamedTuple):
    """Inputs of a scheme's estimator over a whole run, and its random numbers."""

    inputs: Inputs
    rng: np.random.Generator
    """Generator as the estimator got it."""


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
        scene = replace(load_scene(folder / "scene"), digest=about["scene"]["sha256"])
        schemes: dict[str, Any] = {}
        paths: list[Any] = []
        for name in about["schemes"]:
            parts = list(slices.read_parts(folder, name, scene, about["identity"]))
            paths = [part.paths for part in parts]
            schemes[name] = slices.join_schemes([part.scheme for part in parts], paths)
        names = ("name", "seed", "config", "versions", "seconds")
        return SlamResult(
            scene=scene, paths=slices.join_paths(paths), schemes=schemes, warnings=tuple(about["warnings"]),
            **{name: about[name] for name in names},
        )  # fmt: skip


def read_given(folder: Path, scheme: str) -> GivenInputs:
    """Read what a scheme's estimator was given over a whole run, from its measurements in the run folder.

    Raises
    ------
    ResultError
        There are none, or they are damaged.
    """
    name = f"measurements_{scheme}.nc"
    files = [folder / name] if (folder / name).is_file() else sorted((folder / slices.FOLDER).glob(f"*/{name}"))
    if not files:
        raise ResultError(
            f"{folder / name}: no such file, as another version wrote the run; run again with another --out"
        )
    try:
        data = _joined([read_dataset(file) for file in files])
        rng = marked_rng(data)
        if rng is None:
            raise ResultError(f"{files[0]}: does not say which random numbers were drawn; run again with another --out")
        inputs = dataset_to_inputs(data)
    except (KeyError, ValueError, TypeError, ConfigError, StoreError) as error:
        cause = f"{type(error).__name__}: {error}"[:120]
        raise ResultError(f"{files[0]}: damaged ({cause}); run again with another --out") from None
    return GivenInputs(inputs._replace(time=inputs.time - inputs.time[0], since=float(inputs.time[0])), rng)


def _joined(parts: Iterable[Any]) -> Any:
    """One NetCDF data set of the slices' of a whole run, with the attributes of the first."""
    import xarray as xr

    first, *others = parts
    if not others:
        return first
    return xr.concat(
        [first, *others], "time", data_vars="minimal", combine_attrs="override", join="outer", fill_value=PADDING
    )
