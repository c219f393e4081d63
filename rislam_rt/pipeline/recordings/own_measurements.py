"""A user's own measurements: reads a table, a CSV or a NetCDF file, checks it, and estimates pose and map from it."""

import csv
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.blas_threads import in_one_blas_thread
from rislam_rt.errors import ConfigError, RislamError, StoreError
from rislam_rt.information import amplitude_std, measurement_std
from rislam_rt.input_messages import did_you_mean, nearest
from rislam_rt.model import Body, Measurement, RadioConfig
from rislam_rt.pipeline.recordings.inputs import PARTS, Inputs, dataset_to_inputs, marked_rng
from rislam_rt.pipeline.recordings.replay import Answers, replay
from rislam_rt.pipeline.run_datasets import dataset_checksum
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.slam import StartPrior
from rislam_rt.storage.netcdf import read_dataset

COLUMNS: dict[str, tuple[str, str]] = {
    "time_s": (
        "s",
        "of the cycle; rows of one time are one cycle, a row without a delay is a cycle in which nothing was heard",
    ),
    "heading_rad": ("rad", 'compass; may be left out with slam.heading = "estimated"'),
    "delay_s": ("s", "of the component, Tx to Rx"),
    "cos_x": ("1", "direction cosine of the arriving ray along the body's x (forward)"),
    "cos_y": ("1", "along the body's y (left); the ray arrives from above"),
    "theta_r_rad": ("rad", "instead of cosines: zenith angle of arrival, body frame"),
    "phi_r_rad": ("rad", "and azimuth, body frame"),
    "amplitude": ("1", "modulus of the path's gain"),
    "snr_db": ("dB", "instead: SNR after integration over the signal and all antennas"),
    "delay_std_s": ("s", "standard deviation; that of a lone path at its SNR if left out"),
    "cos_x_std": ("1", "likewise"),
    "cos_y_std": ("1", "likewise"),
    "amplitude_std": ("1", "likewise"),
    "panel_probability": ("1", "that it ran over the panel, where the receiver can tell"),
}
"""Columns of a user's table of measurements, by name: unit and meaning."""
NETCDF = (".nc", ".h5", ".hdf5")
"""Suffixes of files that are read as NetCDF, which is HDF5; all others are CSV."""
LONGEST_DELAY = 1e-5
"""[s] Largest delay accepted, 3 km: a larger number is in another unit."""
ROUNDING = 1e-6
"""By how much the sum of two squared direction cosines may exceed 1: the rounding of tables with six digits."""
LARGEST_SNR_DB = 200.0
"""[dB] Largest SNR accepted, of either sign: a larger number is no decibel."""
LONGEST_STEP = 10.0
"""[s] Median time between cycles from which on the times are warned of, as milliseconds given as seconds would be."""
SHORTEST_STEP = 1e-3
"""[s] Median time between cycles of one component each below which the times are warned of: each row has its own."""
FINEST_STD = 1e-15
"""[s] Least standard deviation of a delay accepted, 0.3 um: a smaller number is in another unit."""
RANGES: dict[str, tuple[float, float, str]] = {
    "amplitude": (0.0, np.inf, "positive numbers, not decibels"),
    "snr_db": (-LARGEST_SNR_DB, LARGEST_SNR_DB, f"decibels, {-LARGEST_SNR_DB:g} to {LARGEST_SNR_DB:g}"),
    "delay_std_s": (0.0, LONGEST_DELAY, "positive numbers in seconds (were these nanoseconds, or metres?)"),
    "cos_x_std": (0.0, 2.0, "positive deviations of a direction cosine, not degrees"),
    "cos_y_std": (0.0, 2.0, "positive deviations of a direction cosine, not degrees"),
    "amplitude_std": (0.0, np.inf, "positive numbers, not decibels"),
}
"""Columns of a user's table that have a range of their own: above the first number, up to the second, and what to
give."""


@in_one_blas_thread
def localise(inputs: Inputs, spec: PipelineSpec, *, rng: np.random.Generator) -> Answers:
    """Estimate pose and map, cycle by cycle, from recorded or own measurements alone: no scene, channel or truth.

    Parameters
    ----------
    inputs
        From `read_inputs`, `inputs_of` or a recording.
    spec
        Radio, receiver and estimator; the estimator is that of the first of its schemes.

    Raises
    ------
    ConfigError
        There is no heading from a compass, and the estimator is to take the headings for known.
    """
    if np.isnan(inputs.heading).any():
        if spec.slam.heading == "known":
            raise ConfigError(
                "heading_rad: no such column, and slam.heading = 'known' takes it for the compass; add the column, or "
                "set slam.heading=estimated"
            )
        inputs = inputs._replace(heading=np.full(len(inputs.time), inputs.start.heading))
    return replay(inputs, spec.model_dump(), spec.schemes[0], rng=rng)


def run_rng(file: str | Path) -> np.random.Generator | None:
    """Random generator of the filter from a file of measurements, with which a run's estimate repeats to the bit.

    None for a file of another origin.
    """
    return marked_rng(read_dataset(Path(file))) if Path(file).suffix.lower() in NETCDF else None


def read_inputs(file: str | Path, start: StartPrior | None, radio: RadioConfig, body: Body | None = None) -> Inputs:
    """Read an estimator's inputs from a CSV file (columns as in `COLUMNS`) or a NetCDF file (as recordings have them).

    Parameters
    ----------
    start
        Prior of the first pose; a NetCDF file has its own, a CSV file needs it.
    radio
        Turns SNRs into amplitudes, and gives standard deviations that the table lacks.

    Raises
    ------
    ConfigError
        The file cannot be read, or a value is of a wrong unit or range; the line says which.
    """
    file = Path(file)
    if file.suffix.lower() in NETCDF:
        try:
            data = read_dataset(file)
        except StoreError:
            what = "not a readable NetCDF file" if file.exists() else "no such file"
            raise ConfigError(f"{file}: {what}; give one as a run folder's measurements_<scheme>.nc") from None
        if "checksum" in data.attrs and str(data.attrs["checksum"]) != dataset_checksum(data):
            raise ConfigError(
                f"{file}: changed since it was written (its checksum does not fit); run again, or take the attribute "
                "'checksum' out of a file of your own"
            )
        try:
            made = _check_inputs(dataset_to_inputs(data), str(file))
            if not len(made.time):
                raise ConfigError(f"{file}: no cycles; give at least one")
            return made._replace(time=made.time - made.time[0], since=float(made.time[0]))
        except RislamError as error:
            raise ConfigError(str(error) if str(file) in str(error) else f"{file}: {error}") from None
        except (KeyError, ValueError, TypeError) as error:
            said = " ".join(str(error.args[0] if error.args else error).split())
            cause = said.partition(". Did you mean")[0][:80]
            raise ConfigError(f"{file}: {cause}; give one as a run folder's measurements_<scheme>.nc") from None
    table = _read_csv(file)
    if start is None:
        raise ConfigError(f"{file}: a CSV file does not say where the agent starts; give --start X,Y,Z")
    return inputs_of(table, start, radio, body, place=str(file))


def inputs_of(
    table: Mapping[str, Any], start: StartPrior, radio: RadioConfig, body: Body | None = None, *, place: str = "table"
) -> Inputs:
    """Inputs of an estimator from a table of measurements, a row a component: a mapping or data frame with `COLUMNS`.

    Raises
    ------
    ConfigError
        A column is unknown, missing, or has a value of a wrong unit or range.
    """
    columns = {str(name): _numbers(table[name], str(name), place) for name in table}
    _check_names(columns, place)
    time = columns["time_s"]
    if not np.isfinite(time).all():
        row = int(np.argmin(np.isfinite(time))) + 1
        raise ConfigError(
            f"{place}: time_s: row {row} of the data has no finite number; give each row its cycle's time"
        )
    if (np.diff(time) < 0.0).any():
        raise ConfigError(f"{place}: time_s: not in order; sort the rows by time")
    cycles, cycle = np.unique(time, return_inverse=True)
    for name in ("delay_s", "heading_rad"):
        if np.isinf(columns.get(name, 0.0)).any():
            raise ConfigError(f"{place}: {name}: infinite; give a number, or leave the field empty")
    heard = np.isfinite(columns["delay_s"])
    _check_components(columns, heard, place)
    filled = _filled({name: column[heard] for name, column in columns.items()}, radio, place)
    probability = filled.get("panel_probability")
    measurements = []
    for number in range(len(cycles)):
        rows = cycle[heard] == number
        parts = {name: filled[name][rows] for name in PARTS}
        measurements.append(Measurement(**parts, from_panel=None if probability is None else probability[rows]))
    first = np.searchsorted(cycle, np.arange(len(cycles)))
    compass = columns.get("heading_rad", np.zeros(len(time)))
    heading = compass[first]
    turned = np.flatnonzero(np.abs(compass - heading[cycle]) > ROUNDING)
    if len(turned):
        raise ConfigError(
            f"{place}: heading_rad: row {turned[0] + 1} of the data has another than its cycle's first row; give one "
            "heading a cycle"
        )
    if not np.isfinite(heading).all():
        raise ConfigError(f"{place}: heading_rad: empty in cycle {int(np.argmin(np.isfinite(heading)))}; fill it")
    if np.abs(heading).max() > 2.0 * np.pi:
        raise ConfigError(
            f"{place}: heading_rad: {np.abs(heading).max():g} is more than a turn; give radians, not degrees"
        )
    if "heading_rad" in columns:  # the compass shows the first heading, too
        start = replace(start, heading=float(heading[0]))
    else:
        heading = np.full(len(cycles), np.nan)
    nothing = (None,) * len(cycles)
    made = Inputs(
        start, body or Body(), None, cycles - cycles[0], heading, tuple(measurements), nothing, float(cycles[0])
    )
    return _check_inputs(made, place)


def input_warnings(inputs: Inputs) -> list[str]:
    """Lines about a user's own measurements that are allowed, and most often a mistake: times in another unit, or each
    component with a time of its own."""
    step = float(np.median(np.diff(inputs.time))) if len(inputs.time) > 1 else 0.0
    counts = {len(one) for one in inputs.measurements}
    if step > LONGEST_STEP:
        return [f"time_s: cycles are {step:g} s apart; give seconds, if these were milliseconds"]
    if counts == {1} and 0.0 < step < SHORTEST_STEP:
        return [
            f"time_s: every cycle holds one component, {step:g} s apart; rows of one time are one cycle: round them"
        ]
    return []


def _check_components(columns: Mapping[str, Floats], heard: Booleans, place: str) -> None:
    """Raise an error for a row of a user's measurements that has half a component, or a number out of range."""
    last = "of the data; fill it, or leave the component out"
    for name, column in columns.items():
        if name in ("time_s", "heading_rad", "delay_s"):
            continue
        lost = np.flatnonzero(~heard & np.isfinite(column))
        if len(lost):
            raise ConfigError(f"{place}: delay_s: empty beside {name} in row {lost[0] + 1} {last}")
        odd = np.flatnonzero(heard & ~np.isfinite(column))
        if len(odd) and name != "panel_probability":
            raise ConfigError(f"{place}: {name}: no finite number in row {odd[0] + 1} {last}")
        least, most, wanted = RANGES.get(name, (-np.inf, np.inf, ""))
        odd = np.flatnonzero(heard & ((column <= least) | (column > most)))
        if len(odd):
            raise ConfigError(f"{place}: {name}: {column[odd[0]]:g} in row {odd[0] + 1} of the data; give {wanted}")


def _check_inputs(inputs: Inputs, place: str) -> Inputs:
    """Check units and ranges of a user's own measurements, and return them."""
    for cycle, one in enumerate(inputs.measurements):
        where = f"{place}: cycle {cycle}"
        if (one.tau > LONGEST_DELAY).any():
            raise ConfigError(
                f"{where}: delay of {one.tau.max():g} s received; delays are in seconds, a room's below "
                f"{LONGEST_DELAY:g} (were these nanoseconds, or metres?)"
            )
        if (one.tau < 0.0).any():  # 0: a false component at the edge of a receiver's window
            raise ConfigError(f"{where}: delay of {one.tau.min():g} s received; give none below 0")
        reach = np.abs(one.cosines).max(initial=0.0)
        if reach > 1.0:
            raise ConfigError(f"{where}: cosine of {reach:g} received; give direction cosines from -1 to 1, not angles")
        squares = np.sum(one.cosines**2, axis=-1).max(initial=0.0)
        if squares > 1.0 + ROUNDING:
            raise ConfigError(
                f"{where}: cosines whose squares sum to {squares:g} received, which no direction has; give at most 1 "
                "(bring estimates beyond the horizon back to it)"
            )
        for name in ("tau_std", "cosines_std", "amplitude", "amplitude_std"):
            value = getattr(one, name)
            if not (np.isfinite(value) & (value > 0.0)).all():
                raise ConfigError(f"{where}: {name} of {value.min():g} received; give positive, finite numbers")
        if (one.tau_std < FINEST_STD).any():
            raise ConfigError(f"{where}: tau_std of {one.tau_std.min():g} s received; give seconds")
        told = one.from_panel
        if told is not None and not ((told >= 0.0) & (told <= 1.0)).all():
            raise ConfigError(f"{where}: from_panel: not from 0 to 1; give probabilities")
    if not np.isfinite(inputs.time).all() or (np.diff(inputs.time) <= 0.0).any():
        raise ConfigError(f"{place}: time: not increasing, or not finite; give each cycle its own")
    return inputs


def _numbers(column: Any, name: str, place: str) -> Floats:
    """Column of a user's table of measurements as real numbers."""
    if np.iscomplexobj(column):
        raise ConfigError(f"{place}: {name}: complex numbers received; give real ones (amplitude: the modulus)")
    try:
        return np.asarray(column, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise ConfigError(f"{place}: {name}: not numbers; mend the column") from None


def _check_names(columns: Mapping[str, Floats], place: str) -> None:
    """Raise an error for columns of a user's measurements that are unknown, missing, redundant or of unequal length."""
    for name in columns:
        if name not in COLUMNS:
            hint = did_you_mean(nearest(name, COLUMNS)) or "mend its name:"
            raise ConfigError(f"{place}: {name}: unknown column; {hint} the known ones are {', '.join(COLUMNS)}")
    pairs = ("cos_x", "theta_r_rad"), ("cos_y", "phi_r_rad"), ("amplitude", "snr_db")
    for needed in (("time_s",), ("delay_s",), *pairs):
        if not any(name in columns for name in needed):
            raise ConfigError(f"{place}: {' or '.join(needed)}: column missing; add it")
        if len(needed) == 2 and all(name in columns for name in needed):
            raise ConfigError(f"{place}: {' and '.join(needed)}: columns that say the same; leave one out")
    if ("cos_x" in columns) != ("cos_y" in columns):
        raise ConfigError(f"{place}: a cosine beside an angle; give cos_x and cos_y, or theta_r_rad and phi_r_rad")
    lengths = {len(column) for column in columns.values()}
    if len(lengths) > 1:
        raise ConfigError(f"{place}: columns of different lengths ({sorted(lengths)}); give a row a component")
    if lengths == {0}:
        raise ConfigError(f"{place}: no rows; give at least one cycle")


def _filled(columns: Mapping[str, Floats], radio: RadioConfig, place: str) -> dict[str, Floats]:
    """Fields of measurements from the columns of a user's own table: cosines from angles, amplitudes and missing stds
    from the SNR."""
    if "amplitude" in columns:
        amplitude = columns["amplitude"]
        with np.errstate(over="ignore"):
            snr = radio.integrated_snr(amplitude)
    else:
        with np.errstate(over="ignore"):  # infinity is refused below
            snr = np.power(10.0, columns["snr_db"] / 10.0)
        amplitude = np.sqrt(snr * radio.noise_psd / (radio.array.num_antennas * radio.energy))
    if "cos_x" in columns and "cos_y" in columns:
        cosines = np.stack([columns["cos_x"], columns["cos_y"]], axis=-1)
    else:
        theta, phi = columns["theta_r_rad"], columns["phi_r_rad"]
        if (np.abs(theta) > np.pi).any() or (np.abs(phi) > 2.0 * np.pi).any():
            raise ConfigError(f"{place}: theta_r_rad, phi_r_rad: beyond a full turn; give radians, not degrees")
        if (theta < 0.0).any() or (theta > 0.5 * np.pi).any():
            raise ConfigError(
                f"{place}: theta_r_rad: outside 0 to pi/2; a zenith angle of rays from above, which a planar array "
                "cannot tell from their mirror images below: leave others out"
            )
        cosines = np.sin(theta)[:, None] * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    bound = measurement_std(snr, radio)
    std = [columns.get(name, bound.cosines[:, axis]) for axis, name in enumerate(("cos_x_std", "cos_y_std"))]
    found = {
        "tau": columns["delay_s"],
        "cosines": cosines,
        "amplitude": amplitude,
        "tau_std": columns.get("delay_std_s", bound.tau),
        "cosines_std": np.stack(std, axis=-1),
        "amplitude_std": columns.get("amplitude_std", np.full(len(snr), amplitude_std(radio))),
    }
    for name, value in found.items():
        if not np.isfinite(value).all():
            raise ConfigError(
                f"{place}: {name}: not a finite number in row {int(np.argwhere(~np.isfinite(value))[0][0])}"
            )
    if "panel_probability" in columns:
        found["panel_probability"] = probability = columns["panel_probability"]
        if not ((probability >= 0.0) & (probability <= 1.0)).all():
            raise ConfigError(f"{place}: panel_probability: not from 0 to 1, or empty; mend the column")
    return found


def _read_csv(file: Path) -> dict[str, list[float]]:
    """Read a user's CSV file of measurements into columns by name; an empty field is NaN."""
    try:
        with file.open(newline="", encoding="utf-8-sig") as lines:
            reader = csv.DictReader(lines)
            names = [name.strip() for name in reader.fieldnames or ()]
            rows = list(reader)
    except FileNotFoundError:
        raise ConfigError(f"{file}: no such file; give a CSV or NetCDF file of measurements") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ConfigError(f"{file}: cannot be read ({str(error)[:80]}); give a CSV file in UTF-8") from None
    if not rows:
        raise ConfigError(f"{file}: no rows; give a header and a row a component")
    if len(names) == 1 and any(mark in names[0] for mark in ";\t"):
        raise ConfigError(f"{file}: line 1: one column, '{names[0][:40]}'; part the columns by commas")
    if len(set(names)) < len(names):
        raise ConfigError(f"{file}: line 1: a column is there twice; leave one out")
    table: dict[str, list[float]] = {}
    for number, row in enumerate(rows, start=2):
        for name, text in row.items():
            if name is None or text is None:
                raise ConfigError(f"{file}: line {number}: another number of fields than the header; mend it")
            try:
                table.setdefault(name.strip(), []).append(float(text) if text.strip() else np.nan)
            except ValueError:
                raise ConfigError(f"{file}: line {number}: {name}: '{text[:40]}' is no number; mend it") from None
    return table
