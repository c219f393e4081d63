"""Conversion of true paths and scheme results to NetCDF data sets, with units and meanings as attributes, and back."""

import hashlib
import json
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rislam_rt.errors import ResultError
from rislam_rt.model import MapEstimate, PathKind, Paths, SchemeResult, Trajectory
from rislam_rt.model.result import STEPS
from rislam_rt.storage.checksums import SCHEMA
from rislam_rt.storage.netcdf import Entry, variables

if TYPE_CHECKING:
    import xarray as xr

TRAJECTORY: dict[str, Entry] = {
    "time": (("time",), "s", "time of the cycle's measurement"),
    "true_position": (("time", "xyz"), "m", "true midpoint of Tx and Rx"),
    "true_velocity": (("time", "xyz"), "m/s", "true velocity"),
    "true_heading": (("time",), "rad", "true heading about z"),
}
PATHS: dict[str, Entry] = {
    "kind": (("path",), "1", "0 LOS, 1 VT, 2 PS, 3 VS, 4 RIS, 5 VRIS"),
    "landmark": (("path",), "1", "index into attribute 'landmarks', -1 for LOS and VT"),
    "tx_walls": (("path", "bounce"), "1", "walls between Tx and landmark, index into attribute 'walls', -1 padding"),
    "rx_walls": (("path", "bounce"), "1", "walls between landmark and Rx, likewise"),
    "valid": (("time", "path"), "1", "whether the path exists; other entries mean nothing where it does not"),
    "tau": (("time", "path"), "s", "delay"),
    "departure": (("time", "path", "xyz"), "1", "unit vector away from the Tx"),
    "arrival": (("time", "path", "xyz"), "1", "unit vector from the Rx towards the arriving ray"),
    "gain": (("time", "path"), "1", "complex gain, carrier phase included, panel at level 0"),
    "vertices": (("time", "path", "vertex", "xyz"), "m", "interaction points in the order of travel"),
    "num_vertices": (("path",), "1", "number of interaction points that count"),
}
SCHEME: dict[str, Entry] = {
    "time": (("time",), "s", "time of the cycle's measurement"),
    "position": (("time", "xyz"), "m", "estimated midpoint of Tx and Rx"),
    "velocity": (("time", "xyz"), "m/s", "estimated velocity"),
    "heading": (("time",), "rad", "heading about z"),
    "covariance": (("time", "state", "state_"), "m, m/s", "believed covariance of position and velocity"),
    "sent": (("time", "row", "col"), "1", "phase levels that the agent sent"),
    "applied": (("time", "row", "col"), "1", "phase levels while the signals were taken"),
    "gain": (("time", "path"), "1", "true complex gain under the applied code"),
    "component_path": (("time", "component"), "1", "truth: path of each component, -1 clutter, -9 no component"),
    "component_landmark": (("time", "component"), "1", "landmark taken for it, -1 unused, -2 removed, -9 no component"),
    "ident": (("landmark",), "1", "number of each landmark ever held"),
    "parent": (("landmark",), "1", "number of the landmark whose mirror image this is, -1 for a point"),
    "held": (("time", "landmark"), "1", "whether the landmark was in the map"),
    "landmark_position": (("time", "landmark", "xyz"), "m", "its estimated position"),
    "ris_probability": (("time", "landmark"), "1", "probability of being the panel, of several the likeliest"),
    "panel": (("time", "landmark"), "1", "number of that panel; left out where there is one"),
    "seconds": (("time", "step"), "s", "time taken by optimise, communicate, measure, localise"),
}
OPTIONAL: dict[str, Entry] = {
    "smoothed": (("time", "xyz"), "m", "position with hindsight"),
    "start_position": (("xyz",), "m", "told position at the start"),
}
"""Variables of a scheme's data set that not every one has: only smoothing filters the first."""
MAP: dict[str, Entry] = {
    "ident": (("feature",), "1", "number of the landmark or image"),
    "position": (("feature", "xyz"), "m", "estimated position"),
    "covariance": (("feature", "xyz", "xyz_"), "m2", "believed covariance"),
    "parent": (("feature",), "1", "row of the landmark whose image this is, -1 for none"),
    "ris_probability": (("feature",), "1", "probability of being the panel, of several the likeliest"),
    "panel": (("feature",), "1", "number of that panel; left out where there is one"),
    "strength": (("feature",), "m", "root of the cross-section; for an image, amplitude ratio of the wall"),
    "wall_normal": (("wall", "xyz"), "1", "unit normal, away from the agent"),
    "wall_offset": (("wall",), "m", "normal . x = offset"),
    "wall_std": (("wall", "angle_offset"), "rad, m", "standard deviations of angle and offset"),
}

AXES: dict[str, list[str]] = {
    "xyz": ["x", "y", "z"], "cosine": ["x", "y"], "state": ["x", "y", "z", "vx", "vy", "vz"], "step": list(STEPS),
}  # fmt: skip
"""Labels along axes, for `.sel`."""


def paths_to_dataset(paths: Paths, motion: Trajectory) -> "xr.Dataset":
    """NetCDF data set of a run's true trajectory and true paths."""
    content = _arrays(paths, PATHS, "")
    truth = {"true_position": motion.position, "true_velocity": motion.velocity, "true_heading": motion.heading}
    content |= variables({"time": motion.time, **truth}, TRAJECTORY, "")
    names = np.array([*paths.landmarks, ""], dtype=object)
    coords = {
        "path": (
            ("path",),
            [paths.label(path) for path in range(paths.num_paths)],
            {"long_name": "path, Rx walls last"},
        ),
        "kind_name": (("path",), [PathKind(int(kind)).name for kind in paths.kind], {"long_name": "class of the path"}),
        "landmark_name": (("path",), names[paths.landmark], {"long_name": "landmark, empty for LOS and VT"}),
    }
    attributes = {"walls": list(paths.walls), "landmarks": list(paths.landmarks), "source": paths.source}
    return _dataset(content, attributes | ({"panels": paths.num_panels} if paths.num_panels > 1 else {}), coords)


def dataset_to_paths(data: "xr.Dataset") -> Paths:
    """True paths from a NetCDF data set that `paths_to_dataset` made."""
    walls, landmarks = (names_of(data.attrs[name]) for name in ("walls", "landmarks"))
    about: dict[str, Any] = {"source": str(data.attrs["source"]), "num_panels": int(data.attrs.get("panels", 1))}
    return Paths(**_values(data, PATHS, ""), walls=walls, landmarks=landmarks, **about)


def scheme_to_dataset(result: SchemeResult) -> "xr.Dataset":
    """NetCDF data set of one scheme's result, with filter diagnostics as `info_...` and the last map as `map_...`."""
    content = _arrays(result, SCHEME, "") | _arrays(result.map, MAP, "map_")
    for name, values in result.info.items():
        content[f"info_{name}"] = (("time",), values, {"long_name": f"filter diagnostic {name}"})
    outcomes = sorted(set(result.outcome))
    codes = np.array([outcomes.index(outcome) for outcome in result.outcome], dtype=np.int64)
    content |= _arrays(result, OPTIONAL, "")
    content["outcome"] = (("time",), codes, {"long_name": "how the cycle went, index into attribute 'outcomes'"})
    coords = {"landmark": (("landmark",), result.ident, {"long_name": "number of each landmark ever held"})}
    return _dataset(content, {"scheme": result.scheme, "levels": result.levels, "outcomes": outcomes}, coords)


def dataset_to_scheme(data: "xr.Dataset") -> SchemeResult:
    """Result of one scheme from a NetCDF data set that `scheme_to_dataset` made."""
    outcomes = names_of(data.attrs["outcomes"])
    return SchemeResult(
        scheme=str(data.attrs["scheme"]), levels=int(data.attrs["levels"]), **_values(data, SCHEME, ""),
        info={str(n).removeprefix("info_"): data[n].to_numpy() for n in data.data_vars if str(n).startswith("info_")},
        outcome=tuple(outcomes[code] for code in data["outcome"].to_numpy()),
        map=MapEstimate(**_values(data, MAP, "map_")),
        **_values(data, {name: entry for name, entry in OPTIONAL.items() if name in data}, ""),
    )  # fmt: skip


def part_name(kind: str, scheme: str, ending: str = ".nc") -> str:
    """Name of the file of a scheme's datasets, `<kind>_<scheme>`; a colon, which Windows allows in no name, as `@`."""
    return f"{kind}_{scheme.replace(':', '@')}{ending}"


def part_file(folder: Path, kind: str, scheme: str) -> Path:
    """Path of the file of a scheme's datasets in a folder: as `part_name` has it or, without one, by the name with a
    colon that earlier runs gave it."""
    file, earlier = folder / part_name(kind, scheme), folder / f"{kind}_{scheme}.nc"
    return earlier if earlier.is_file() and not file.is_file() else file


def seal_dataset(data: "xr.Dataset", **about: str) -> "xr.Dataset":
    """Seal a run's data set by attributes: `about`, schema version, number of cycles, checksum of its content."""
    found = data.assign_attrs(about, schema=SCHEMA, cycles=int(data.sizes["time"]))
    return found.assign_attrs(checksum=dataset_checksum(found))


def check_dataset(data: "xr.Dataset", path: Path, **about: str | int) -> None:
    """Check that a data set read from `path` has its checksum and the attributes `about` that it should have.

    Raises
    ------
    ResultError
        It has not. One line.
    """
    expected = {"schema": SCHEMA, "cycles": data.sizes.get("time"), **about, "checksum": dataset_checksum(data)}
    for name, value in expected.items():
        found = data.attrs.get(name)
        if found is None or str(found) != str(value):
            raise ResultError(f"{path}: {name} is {str(found)[:70]} and should be {str(value)[:70]}; run again")


def dataset_checksum(data: "xr.Dataset") -> str:
    """SHA-256 over a run's data set: names, shapes, types, values and attributes; not over how the file packs them."""
    digest = hashlib.sha256()
    for name in sorted(map(str, data.variables)):
        variable = data.variables[name]
        values = np.ascontiguousarray(variable.to_numpy())
        words = values.dtype.kind in "OUT"  # text comes back as another type of text
        head = [name, variable.dims, values.shape, "text" if words else values.dtype.str, _plain(variable.attrs)]
        digest.update(json.dumps(head).encode())
        digest.update(json.dumps([str(word) for word in values.flat]).encode() if words else values.tobytes())
    attributes = {name: value for name, value in data.attrs.items() if name != "checksum"}
    digest.update(json.dumps(_plain(attributes)).encode())
    return digest.hexdigest()


def _plain(attributes: Any) -> list[tuple[str, list[Any]]]:
    """Attributes of a data set as sorted lists of texts: alike before and after NetCDF, which gives back arrays."""
    found = []
    for name in sorted(map(str, attributes)):
        value = attributes[name]
        value = value.tolist() if hasattr(value, "tolist") else value
        found.append((name, [str(part) for part in (value if isinstance(value, list | tuple) else [value])]))
    return found


def _arrays(record: Any, table: dict[str, Entry], prefix: str) -> dict[str, Any]:
    """Variables of a run's data set: a record's fields that `table` lists, their names with `prefix`."""
    names = {f.name for f in fields(record)}
    found = {name: getattr(record, name) for name in table if name in names}
    return variables({name: value for name, value in found.items() if value is not None}, table, prefix)


def _values(data: "xr.Dataset", table: dict[str, Entry], prefix: str) -> dict[str, Any]:
    """Arrays of the variables of a run's data set that `table` lists, by field; complex ones joined of two."""
    values: dict[str, Any] = {}
    for name in table:
        key = prefix + name
        if f"{key}_real" in data:
            values[name] = data[f"{key}_real"].to_numpy() + 1j * data[f"{key}_imag"].to_numpy()
        elif key in data or name != "panel":  # the one variable that may be left out
            values[name] = data[key].to_numpy()
    return values


def _dataset(content: dict[str, Any], attributes: dict[str, Any], coords: dict[str, Any]) -> "xr.Dataset":
    """A run's data set of variables, with the labels (`AXES`) of the axes that they use."""
    import xarray as xr

    used = {axis for dims, _, _ in content.values() for axis in dims}
    labels = {axis: names for axis, names in AXES.items() if axis in used}
    return xr.Dataset(content, {**coords, **labels}, {"Conventions": "CF-1.11", **attributes})


def names_of(value: Any) -> tuple[str, ...]:
    """Names in an attribute of a data set, which NetCDF gives back as one string if there is only one."""
    return (value,) if isinstance(value, str) else tuple(str(item) for item in value)
