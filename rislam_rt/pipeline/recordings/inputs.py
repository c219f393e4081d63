"""Inputs of an estimator, cycle by cycle, as arrays and as a NetCDF file, so that other estimators can get the same."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError, RislamError
from rislam_rt.information import amplitude_std, measurement_std
from rislam_rt.model import Body, DataSheet, Measurement, RadioConfig, RisCode, RisSpec, SchemeResult
from rislam_rt.model.ris import join_sheets
from rislam_rt.pipeline.room.array_warnings import untold_axes
from rislam_rt.pipeline.run_datasets import AXES, names_of
from rislam_rt.slam import StartPrior
from rislam_rt.storage.netcdf import Entry, padded, variables

if TYPE_CHECKING:
    import xarray as xr

    from rislam_rt.pipeline.assumed_model import AssumedModel
    from rislam_rt.pipeline.cycle import Cycle

PADDING = -9.0
"""Value that fills the arrays where a cycle has fewer components than the one with most."""
PARTS = ("tau", "cosines", "amplitude", "tau_std", "cosines_std", "amplitude_std")
"""Fields of a measurement that every recording has."""
INPUTS: dict[str, Entry] = {
    "time": (("time",), "s", "time since the first cycle"),
    "heading": (("time",), "rad", "compass: heading of the body about z"),
    "tau": (("time", "component"), "s", "delay, -9 beyond the cycle's components"),
    "cosines": (("time", "component", "cosine"), "1", "direction cosines of the arriving ray along body x and y"),
    "amplitude": (("time", "component"), "1", "modulus of the gain"),
    "tau_std": (("time", "component"), "s", "reported standard deviation of tau"),
    "cosines_std": (("time", "component", "cosine"), "1", "reported standard deviation of cosines"),
    "amplitude_std": (("time", "component"), "1", "reported standard deviation of amplitude"),
    "from_panel": (("time", "component"), "1", "probability that it ran over the panel; left out without alternation"),
    "which_panel": (("time", "component"), "1", "number of that panel, the likeliest of several; left out with one"),
    "code": (("time", "row", "col"), "1", "phase levels that the agent holds the panel to be set to; several: one row"),
    "start_position": (("xyz",), "m", "told position at the start"),
    "start_velocity": (("xyz",), "m/s", "told velocity at the start"),
    "tx_offset": (("xyz",), "m", "Tx from the agent's position, body frame"),
    "rx_offset": (("xyz",), "m", "centre of the Rx array from the agent's position, body frame"),
    "panel_shape": (("panel", "pair"), "1", "rows, columns of elements"),
    "panel_spacing": (("panel", "pair"), "m", "between columns, between rows"),
    "panel_normal": (("panel", "xyz"), "1", "unit vector out of the panel's front"),
    "panel_up": (("panel", "xyz"), "1", "unit vector along a column"),
    "panel_amplitude": (("panel",), "1", "amplitude of an element"),
}
"""Variables of a recording: axes, unit and meaning of everything that an estimator gets."""
OPTIONAL = ("from_panel", "which_panel", "code")
"""Variables that a recording may leave out; without `code` it has none of a panel."""


class Inputs(NamedTuple):
    """All that an estimator gets over K cycles: start prior, data sheets, compass, measurements, phase codes."""

    start: StartPrior
    """Prior of position, velocity and heading at the first cycle."""
    body: Body
    """Offsets of Tx and Rx from the agent's position, body frame."""
    panel: DataSheet | None
    """Data sheet of the RIS panels; None without a panel."""
    time: Floats
    """(K,) [s] since the first cycle."""
    heading: Floats
    """(K,) [rad], of the compass; NaN without one."""
    measurements: tuple[Measurement, ...]
    """(K,) one a cycle."""
    codes: tuple[RisCode | None, ...]
    """(K,) phase code that the agent holds to be applied; None without a panel."""
    since: float = 0.0
    """[s] First cycle's time by the clock of a recording or of a user's own file, from which `time` counts."""

    def __repr__(self) -> str:
        sheets = () if self.panel is None else self.panel.panels
        panels = ", ".join(f"panel of {sheet.rows} x {sheet.cols}" for sheet in sheets) or "no panel"
        span = f" over {self.time[-1] - self.time[0]:.4g} s" if len(self.time) else ""
        heard = sum(len(one) for one in self.measurements)
        return f"Inputs: {len(self.time)} cycles{span}, {heard} components, {panels}"


class RecordedInputs(NamedTuple):
    """Inputs of an estimator over some cycles, and the seed of its random numbers."""

    inputs: Inputs
    seed: np.random.SeedSequence
    """Of the estimator's generator."""


def given_of(
    told: "AssumedModel", first: int, cycles: "Sequence[Cycle]", seed: np.random.SeedSequence, since: float = 0.0
) -> RecordedInputs:
    """Record of an estimator's inputs in consecutive cycles from `first` on, from the assumed model and the cycles;
    `since` [s] is the first of all cycles' time by the trajectory's clock."""
    span = slice(first, first + len(cycles))
    time, heading = told.time[span] - told.time[0], told.heading[span]
    measurements = tuple(cycle.measurement for cycle in cycles)
    codes = tuple(cycle.believed for cycle in cycles)
    return RecordedInputs(Inputs(told.start, told.body, told.panel, time, heading, measurements, codes, since), seed)


def given_to_dataset(result: SchemeResult) -> "xr.Dataset":
    """NetCDF data set of the inputs of a scheme's estimator, as `rislam-rt slam` reads it, without anything true."""
    inputs, seed = result.given
    key = np.array(seed.spawn_key, dtype=np.int64)
    return inputs_to_dataset(inputs, scheme=result.scheme, filter_entropy=str(seed.entropy), filter_spawn_key=key)


def inputs_to_dataset(inputs: Inputs, **about: Any) -> "xr.Dataset":
    """NetCDF data set of an estimator's inputs: variables of `INPUTS`; the scalars and `about` as attributes."""
    import xarray as xr

    heard = inputs.measurements
    values: dict[str, Any] = {name: padded([getattr(m, name) for m in heard], PADDING, float) for name in PARTS}
    if all(m.from_panel is not None for m in heard):
        values["from_panel"] = padded([np.asarray(m.from_panel) for m in heard], PADDING, float)
    if all(m.panel is not None for m in heard):
        values["which_panel"] = padded([np.asarray(m.panel) for m in heard], PADDING, float)
    values |= {"time": inputs.time, "heading": inputs.heading}
    values |= {"start_position": inputs.start.position, "start_velocity": inputs.start.velocity}
    values |= {"tx_offset": inputs.body.tx_offset, "rx_offset": inputs.body.rx_offset}
    names = ("heading", "position_std", "velocity_std", "heading_std")
    attributes: dict[str, Any] = {f"start_{name}": getattr(inputs.start, name) for name in names}
    if inputs.since:
        attributes["since"] = inputs.since
    codes = [code for code in inputs.codes if code is not None]
    if inputs.panel is not None and len(codes) == len(inputs.codes):
        values["code"] = np.array([code.index for code in codes])
        sheets = inputs.panel.panels
        for name in ("spacing", "normal", "up", "amplitude"):
            values[f"panel_{name}"] = np.array([getattr(sheet, name) for sheet in sheets])
        values["panel_shape"] = np.array([(sheet.rows, sheet.cols) for sheet in sheets])
        attributes |= {"panel_levels": inputs.panel.levels, "panel_element": [sheet.element for sheet in sheets]}
    content = variables(values, INPUTS)
    coords: dict[str, Any] = {name: AXES[name] for name in ("xyz", "cosine")}
    coords["component"] = np.arange(values["tau"].shape[1])  # so that files join along time
    return xr.Dataset(content, coords, {"Conventions": "CF-1.11", **attributes, **about})


def dataset_to_inputs(data: "xr.Dataset", radio: RadioConfig | None = None) -> Inputs:
    """Inputs of an estimator from a NetCDF data set with the variables of `INPUTS`; no truth is needed.

    Dimensions may stand in any order. A component whose values are all NaN is none, like one with a delay of -9.

    Parameters
    ----------
    radio
        Gives standard deviations that the data set lacks; without it all must be there.

    Raises
    ------
    ConfigError
        A variable or attribute is missing, or has other dimensions or no numbers; the line names it.
    """
    _check_variables(data, radio)
    names = ("heading", "position_std", "velocity_std", "heading_std")
    marks = (_number_of(data, f"start_{name}") for name in names)
    start = StartPrior(_values(data, "start_position"), _values(data, "start_velocity"), *marks)
    panel, codes = _panel(data)
    body = Body(_values(data, "tx_offset"), _values(data, "rx_offset"))
    time, heading = _values(data, "time"), _values(data, "heading")
    since = _number_of(data, "since") if "since" in data.attrs else 0.0
    return Inputs(start, body, panel, time, heading, _measurements(data, radio), codes, since)


def marked_rng(data: "xr.Dataset") -> np.random.Generator | None:
    """Random generator of the estimator, an input read from a NetCDF recording; None if the file has no seed."""
    if "filter_entropy" not in data.attrs:
        return None
    key = tuple(int(part) for part in np.atleast_1d(data.attrs["filter_spawn_key"]))
    return np.random.default_rng(np.random.SeedSequence(int(data.attrs["filter_entropy"]), spawn_key=key))


def _check_variables(data: "xr.Dataset", radio: RadioConfig | None) -> None:
    """Check that a recording has the variables that it must; a radio stands in for deviations that its array tells."""
    told = {"tau_std", "cosines_std", "amplitude_std"} if radio is not None else set()
    if radio is not None and untold_axes(radio.array):
        told.remove("cosines_std")
    given = {str(name) for name in data.variables} | {*OPTIONAL, *told}
    missing = [name for name in INPUTS if name not in given and ("code" in data or not name.startswith("panel_"))]
    if missing:
        compass = " (heading: NaN without a compass, with slam.heading=estimated)" if "heading" in missing else ""
        what = f"give {'them' if len(missing) > 1 else 'it'} as in a run folder's measurements_<scheme>.nc"
        raise ConfigError(f"{', '.join(missing)}: missing; {what}{compass}")


def _mark(data: "xr.Dataset", name: str) -> Any:
    """Value of an attribute of a recording."""
    if name not in data.attrs:
        raise ConfigError(f"attribute {name} is missing; give it")
    return data.attrs[name]


def _number_of(data: "xr.Dataset", name: str) -> float:
    """Number in an attribute of a recording."""
    value = _mark(data, name)
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ConfigError(f"attribute {name}: {str(value)[:40]} received; give a number") from None


def _values(data: "xr.Dataset", name: str) -> NDArray[Any]:
    """Real numbers of a variable of a recording, along the dimensions of `INPUTS`."""
    dims, found = INPUTS[name][0], data[name]
    if sorted(map(str, found.dims)) != sorted(dims):
        have = ", ".join(map(str, found.dims)) or "none"
        raise ConfigError(f"{name}: dimensions: {have} received; give {', '.join(dims)}")
    values: NDArray[Any] = found.transpose(*dims).to_numpy()
    if values.dtype.kind in "mM":
        kind = "datetime64" if values.dtype.kind == "M" else "timedelta64"
        raise ConfigError(f"{name}: {kind} received; give {'seconds' if INPUTS[name][1] == 's' else 'numbers'}")
    if values.dtype.kind == "c":
        raise ConfigError(f"{name}: complex numbers received; give real ones (of an amplitude the modulus)")
    if values.dtype.kind not in "biuf":
        raise ConfigError(f"{name}: not numbers; mend the variable")
    return values


def _panel(data: "xr.Dataset") -> tuple[DataSheet | None, tuple[RisCode | None, ...]]:
    """Data sheet of the RIS panels among recorded inputs, and the phase code of each cycle; None without a panel."""
    if "code" not in data:
        return None, (None,) * data.sizes["time"]
    levels, elements = int(_number_of(data, "panel_levels")), names_of(_mark(data, "panel_element"))
    parts = (_values(data, f"panel_{name}") for name in ("shape", "spacing", "normal", "up", "amplitude"))
    sheets = tuple(
        RisSpec(int(rows), int(cols), spacing, normal, up, levels, element, float(amplitude))
        for (rows, cols), spacing, normal, up, amplitude, element in zip(*parts, elements, strict=True)
    )
    return join_sheets(sheets), tuple(RisCode(code, levels) for code in _values(data, "code"))


def _measurements(data: "xr.Dataset", radio: RadioConfig | None) -> tuple[Measurement, ...]:
    """Measurements of a NetCDF recording, one a cycle, without the padding; an error names the cycle, from 0."""
    fields = {name: name for name in (*PARTS, "from_panel")} | {"which_panel": "panel"}
    table = {field: _values(data, name) for name, field in fields.items() if name in data}
    empty = [np.isnan(value).all(axis=tuple(range(2, value.ndim))) for value in table.values()]
    held = (table["tau"] != PADDING) & ~np.all(empty, axis=0)
    if radio is not None and not set(PARTS) <= set(table):
        table = _deviations(table["amplitude"], radio) | table
    made = []
    for cycle in range(data.sizes["time"]):
        try:
            made.append(Measurement(**{name: value[cycle, held[cycle]] for name, value in table.items()}))
        except RislamError as error:
            raise ConfigError(f"cycle {cycle}: {str(error).removeprefix('Measurement.')}") from None
    return tuple(made)


def _deviations(amplitude: Floats, radio: RadioConfig) -> dict[str, Floats]:
    """Standard deviations of measurements (K, M) that are lone paths of their amplitude, as fields."""
    bound = measurement_std(radio.integrated_snr(amplitude), radio)
    return {
        "tau_std": bound.tau,
        "cosines_std": bound.cosines,
        "amplitude_std": np.full(amplitude.shape, amplitude_std(radio)),
    }
