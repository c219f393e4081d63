"""A recorded run as one NetCDF file: what an estimator is given, and, kept apart by name, the truth."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rislam_rt.errors import RislamError, StoreError
from rislam_rt.model import Body, Measurement, RisCode, RisSpec
from rislam_rt.pipeline.dataset import Entry, read_dataset, write_dataset
from rislam_rt.pipeline.studies.unseen.recording import Inputs
from rislam_rt.pipeline.studies.unseen.truth import Truth
from rislam_rt.slam import StartPrior

if TYPE_CHECKING:
    import xarray as xr

PADDING = -9.0
"""Fills cycles that have fewer components than the fullest one."""
PARTS = ("tau", "cosines", "amplitude", "tau_std", "cosines_std", "amplitude_std")
"""Fields of a measurement."""
INPUTS: dict[str, Entry] = {
    "time": (("cycle",), "s", "time since the first cycle"),
    "heading": (("cycle",), "rad", "compass: heading of the body about z"),
    "tau": (("cycle", "component"), "s", "delay, -9 beyond the cycle's components"),
    "cosines": (("cycle", "component", "cosine"), "1", "direction cosines of the arriving ray along body x and y"),
    "amplitude": (("cycle", "component"), "1", "modulus of the gain"),
    "tau_std": (("cycle", "component"), "s", "reported standard deviation of tau"),
    "cosines_std": (("cycle", "component", "cosine"), "1", "reported standard deviation of cosines"),
    "amplitude_std": (("cycle", "component"), "1", "reported standard deviation of amplitude"),
    "from_panel": (("cycle", "component"), "1", "probability that it ran over the panel; left out without alternation"),
    "code": (("cycle", "row", "col"), "1", "phase levels that the agent holds the panel to be set to"),
    "start_position": (("xyz",), "m", "told position at the start"),
    "start_velocity": (("xyz",), "m/s", "told velocity at the start"),
    "tx_offset": (("xyz",), "m", "Tx from the agent's position, body frame"),
    "rx_offset": (("xyz",), "m", "centre of the Rx array from the agent's position, body frame"),
    "panel_spacing": (("pair",), "m", "between columns, between rows"),
    "panel_normal": (("xyz",), "1", "unit vector out of the panel's front"),
    "panel_up": (("xyz",), "1", "unit vector along a column"),
}
"""What an estimator may see."""
TRUTH: dict[str, Entry] = {
    "position": (("cycle", "xyz"), "m", "midpoint of Tx and Rx"),
    "velocity": (("cycle", "xyz"), "m/s", "velocity"),
    "landmark": (("landmark", "xyz"), "m", "scatterers, then the panel if there is one"),
    "landmark_audible": (("cycle", "landmark"), "1", "whether one of its paths is above the detection threshold"),
    "wall_middle": (("wall", "xyz"), "m", "centroid of the surface; walls in one plane are one"),
    "wall_normal": (("wall", "xyz"), "1", "unit normal"),
    "wall_spread": (("wall", "xyz", "xyz_"), "m2", "covariance of the points of the surface"),
    "wall_audible": (("cycle", "wall"), "1", "whether a path over it is above the detection threshold"),
    "path_kind": (("path",), "1", "0 LOS, 1 VT, 2 PS, 3 VS, 4 RIS, 5 VRIS"),
    "path_landmark": (("path",), "1", "landmark of the path, -1 for LOS and VT"),
    "component_path": (("cycle", "component"), "1", "path of each component, -1 clutter, -9 no component"),
    "bound": (("cycle",), "m", "posterior bound of the position, RMS"),
    "relative_bound": (("cycle",), "m", "the same with the start exactly known"),
}
"""What is for scoring alone; in the file each name begins with `true_`."""


class Recording(NamedTuple):
    """One run as it lies in a file."""

    inputs: Inputs
    truth: Truth
    scheme: str
    """That ran, and chose the codes."""
    config: Mapping[str, Any]
    """The specification of the run."""
    traits: Mapping[str, Any]
    """The room's seed and classes."""
    scores: Mapping[str, Any]
    """The card of the estimator that ran."""


def write_recording(recording: Recording, path: Path) -> None:
    """Write one file, whole or not at all.

    Raises
    ------
    StoreError
        The disk refused.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{path.parent}: cannot be made ({error.strerror}); check permissions") from None
    write_dataset(recording_to_dataset(recording), path)


def read_recording(path: str | Path) -> Recording:
    """What `write_recording` wrote.

    Raises
    ------
    StoreError
        The file is missing or damaged, or holds something else.
    """
    data = read_dataset(Path(path))
    try:
        return dataset_to_recording(data)
    except (KeyError, ValueError, TypeError, RislamError) as error:
        raise StoreError(
            f"{path}: not a recorded run ({type(error).__name__}: {str(error)[:80]}); write it again"
        ) from None


def recording_to_dataset(recording: Recording) -> "xr.Dataset":
    """Variables of `INPUTS` and, with `true_` before them, of `TRUTH`; the rest as attributes."""
    import xarray as xr

    inputs, truth = recording.inputs, recording.truth
    values: dict[str, Any] = {name: _padded([getattr(m, name) for m in inputs.measurements]) for name in PARTS}
    if all(m.from_panel is not None for m in inputs.measurements):
        values["from_panel"] = _padded([np.asarray(m.from_panel) for m in inputs.measurements])
    values |= {"time": inputs.time, "heading": inputs.heading}
    values |= {"start_position": inputs.start.position, "start_velocity": inputs.start.velocity}
    values |= {"tx_offset": inputs.body.tx_offset, "rx_offset": inputs.body.rx_offset}
    attributes: dict[str, Any] = {
        f"start_{name}": getattr(inputs.start, name)
        for name in ("heading", "position_std", "velocity_std", "heading_std")
    }
    attributes |= {name: json.dumps(getattr(recording, name)) for name in ("config", "traits", "scores")}
    attributes |= {"scheme": recording.scheme, "true_panel": int(truth.panel), "Conventions": "CF-1.11"}
    codes = [code for code in inputs.codes if code is not None]
    if inputs.panel is not None and len(codes) == len(inputs.codes):
        values["code"] = np.array([code.index for code in codes])
        values |= {f"panel_{name}": getattr(inputs.panel, name) for name in ("spacing", "normal", "up")}
        attributes |= {f"panel_{name}": getattr(inputs.panel, name) for name in ("levels", "element", "amplitude")}
    content = {name: (INPUTS[name][0], value, _told(INPUTS[name])) for name, value in values.items()}
    for name, entry in TRUTH.items():
        value = getattr(truth, name)
        plain = value.astype(np.int8) if value.dtype == np.bool_ else value
        content[f"true_{name}"] = (entry[0], plain, _told(entry))
    return xr.Dataset(content, attrs=attributes)


def dataset_to_recording(data: "xr.Dataset") -> Recording:
    """The inverse of `recording_to_dataset`."""
    marks = data.attrs
    values = {name: data[f"true_{name}"].to_numpy() for name in TRUTH}
    for name in ("landmark_audible", "wall_audible"):
        values[name] = values[name].astype(np.bool_)
    truth = Truth(**values, panel=bool(marks["true_panel"]))
    config, traits, scores = (json.loads(marks[name]) for name in ("config", "traits", "scores"))
    return Recording(dataset_to_inputs(data), truth, str(marks["scheme"]), config, traits, scores)


def dataset_to_inputs(data: "xr.Dataset") -> Inputs:
    """What an estimator is given, from the variables of `INPUTS` alone: a file of one's own needs no truth."""
    marks = data.attrs
    start = StartPrior(
        data["start_position"].to_numpy(),
        data["start_velocity"].to_numpy(),
        *(float(marks[f"start_{name}"]) for name in ("heading", "position_std", "velocity_std", "heading_std")),
    )
    panel, codes = _panel(data)
    body = Body(data["tx_offset"].to_numpy(), data["rx_offset"].to_numpy())
    time, heading = data["time"].to_numpy(), data["heading"].to_numpy()
    return Inputs(start, body, panel, time, heading, _measurements(data), codes)


def _panel(data: "xr.Dataset") -> tuple[RisSpec | None, tuple[RisCode | None, ...]]:
    """Data sheet, and one code a cycle; None without a panel."""
    if "code" not in data:
        return None, (None,) * data.sizes["cycle"]
    index, marks = data["code"].to_numpy(), data.attrs
    rows, cols, levels = *index.shape[1:], int(marks["panel_levels"])
    spacing, normal, up = (data[f"panel_{name}"].to_numpy() for name in ("spacing", "normal", "up"))
    element, amplitude = str(marks["panel_element"]), float(marks["panel_amplitude"])
    panel = RisSpec(rows, cols, spacing, normal, up, levels, element, amplitude)
    return panel, tuple(RisCode(code, levels) for code in index)


def _measurements(data: "xr.Dataset") -> tuple[Measurement, ...]:
    """One a cycle, without the padding."""
    table = {name: data[name].to_numpy() for name in (*PARTS, "from_panel") if name in data}
    held = table["tau"] != PADDING
    return tuple(
        Measurement(**{name: value[cycle, held[cycle]] for name, value in table.items()})
        for cycle in range(data.sizes["cycle"])
    )


def _padded(rows: list[Any]) -> Any:
    longest = max((len(row) for row in rows), default=0)
    table = np.full((len(rows), longest, *rows[0].shape[1:]), PADDING)
    for cycle, row in enumerate(rows):
        table[cycle, : len(row)] = row
    return table


def _told(entry: Entry) -> dict[str, str]:
    return {"units": entry[1], "long_name": entry[2]}
