"""Recording file of a run in NetCDF: inputs of the estimator and, under other names, the truth that it is scored by."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.errors import RislamError, StoreError
from rislam_rt.pipeline.recordings.inputs import Inputs, dataset_to_inputs, inputs_to_dataset
from rislam_rt.storage.files import MARK
from rislam_rt.storage.netcdf import Entry, read_dataset, variables, write_dataset
from rislam_rt.studies.score_card.truth import Truth

TRUTH: dict[str, Entry] = {
    "position": (("time", "xyz"), "m", "midpoint of Tx and Rx"),
    "velocity": (("time", "xyz"), "m/s", "velocity"),
    "landmark": (("landmark", "xyz"), "m", "scatterers, then the panel if there is one"),
    "landmark_audible": (("time", "landmark"), "1", "whether one of its paths is above the detection threshold"),
    "wall_middle": (("wall", "xyz"), "m", "centroid of the surface; walls in one plane are one"),
    "wall_normal": (("wall", "xyz"), "1", "unit normal"),
    "wall_spread": (("wall", "xyz", "xyz_"), "m2", "covariance of the points of the surface"),
    "wall_audible": (("time", "wall"), "1", "whether a path over it is above the detection threshold"),
    "path_kind": (("path",), "1", "0 LOS, 1 VT, 2 PS, 3 VS, 4 RIS, 5 VRIS"),
    "path_landmark": (("path",), "1", "landmark of the path, -1 for LOS and VT"),
    "component_path": (("time", "component"), "1", "path of each component, -1 clutter, -9 no component"),
    "bound": (("time",), "m", "posterior bound of the position, RMS"),
    "relative_bound": (("time",), "m", "the same with the start exactly known"),
}
"""Variables of a recorded run that are for scoring alone; in the file each name begins with `true_`."""


class Recording(NamedTuple):
    """Recorded run of one scheme, in an unseen room or another: inputs of its estimator, truth, settings and scores."""

    inputs: Inputs
    truth: Truth
    scheme: str
    """Name of the scheme, which chose the codes."""
    config: Mapping[str, Any]
    """Specification of the run."""
    traits: Mapping[str, Any]
    """Seed and classes of an unseen room; of another, its name, and the run's folder and seed."""
    scores: Mapping[str, Any]
    """Scores of the scheme's own estimator."""


def write_recording(recording: Recording, path: str | Path) -> None:
    """Write a recorded run to a NetCDF file, whole or not at all: `INPUTS`, `TRUTH` with names from `true_` on, the
    rest as attributes.

    Raises
    ------
    StoreError
        The disk refused.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{path.parent}: cannot be made ({error.strerror}); check permissions") from None
    truth = recording.truth
    about = {name: json.dumps(getattr(recording, name)) for name in ("config", "traits", "scores")}
    data = inputs_to_dataset(
        recording.inputs, **about, scheme=recording.scheme, true_panel=int(truth.panel), origin=MARK
    )
    values = {name: getattr(truth, name) for name in TRUTH}
    plain = {name: v.astype(np.int8) if v.dtype == np.bool_ else v for name, v in values.items()}
    content = variables(plain, TRUTH)
    write_dataset(data.assign({f"true_{name}": content[name] for name in content}), path)


def read_recording(path: str | Path) -> Recording:
    """Read a recorded run from a NetCDF file that `write_recording` wrote.

    Raises
    ------
    StoreError
        The file is missing or damaged, or holds something else.
    """
    wanted = "give one that write_recording or rislam-rt score RUN --save FOLDER wrote"
    try:
        data = read_dataset(Path(path))
    except StoreError:
        what = "not a readable NetCDF file of a recording" if Path(path).exists() else "no such file"
        raise StoreError(f"{path}: {what}; {wanted}") from None
    if "true_position" not in data:
        raise StoreError(f"{path}: no recording, for it holds no truth (true_position); {wanted}")
    try:
        marks, values = data.attrs, {name: data[f"true_{name}"].to_numpy() for name in TRUTH}
        for name in ("landmark_audible", "wall_audible"):
            values[name] = values[name].astype(np.bool_)
        truth = Truth(**values, panel=int(marks["true_panel"]))
        config, traits, scores = (json.loads(marks[name]) for name in ("config", "traits", "scores"))
        return Recording(dataset_to_inputs(data), truth, str(marks["scheme"]), config, traits, scores)
    except (KeyError, ValueError, TypeError, RislamError) as error:
        raise StoreError(
            f"{path}: not a recorded run ({type(error).__name__}: {str(error)[:80]}); write it again"
        ) from None
