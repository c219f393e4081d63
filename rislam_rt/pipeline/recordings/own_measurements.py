"""A user's own measurements: reads a table, a CSV or a NetCDF file, checks it, and estimates pose and map from it."""

import csv
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.blas_threads import in_one_blas_thread
from rislam_rt.errors import ConfigError, RislamError, StoreError, expect
from rislam_rt.information import amplitude_std, measurement_std
from rislam_rt.input_messages import parse_number
from rislam_rt.model import Body, Measurement, RadioConfig
from rislam_rt.pipeline.cycle import usual_step
from rislam_rt.pipeline.recordings.inputs import Inputs, dataset_to_inputs, marked_rng
from rislam_rt.pipeline.recordings.measurement_columns import (
    BACK_TO_HORIZON,
    BEYOND_HORIZON,
    FINEST_STD,
    LONGEST_DELAY,
    check_amplitude,
    check_components,
    check_heading,
    check_names,
    cosine_wanted,
)  # fmt: skip
from rislam_rt.pipeline.recordings.replay import Answers, replay
from rislam_rt.pipeline.room.array_warnings import untold_axes
from rislam_rt.pipeline.run_datasets import dataset_checksum
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.slam import StartPrior
from rislam_rt.storage.netcdf import NETCDF, read_dataset

LONGEST_STEP = 10.0
"""[s] Median time between cycles from which on the times are warned of, as milliseconds given as seconds would be."""
LONGEST_STRIDE = 5.0
"""[m] Way at the start's speed in a median time above `LONGEST_STEP` from which on the times are refused: an agent that
goes across a room from one cycle to the next has its times in another unit."""


@in_one_blas_thread
def localise(inputs: Inputs, spec: PipelineSpec, *, rng: np.random.Generator, place: str = "measurements") -> Answers:
    """Estimate pose and map, cycle by cycle, from recorded or own measurements alone: no scene, channel or truth.

    Parameters
    ----------
    inputs
        From `read_inputs`, `inputs_of` or a recording.
    spec
        Radio, receiver and estimator; the estimator is that of the first of its schemes.
    place
        Where the inputs are from, as errors name it.

    Raises
    ------
    ConfigError
        There is no heading from a compass, and the estimator is to take the headings for known.
    """
    expect("spec", spec, PipelineSpec)
    if np.isnan(inputs.heading).any():
        if spec.slam.heading == "known":
            raise ConfigError(
                f"{place}: heading_rad: no such column, and slam.heading = 'known' takes it for the compass; add the "
                "column, or set slam.heading=estimated"
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
        Turns SNRs into amplitudes, and gives standard deviations that the file lacks.
    body
        Offsets of Tx and Rx for a CSV file; None as in `inputs_of`.

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
            made = _check_inputs(dataset_to_inputs(data, radio), str(file))
            if not len(made.time):
                raise ConfigError(f"{file}: no cycles; give at least one")
            return made._replace(time=made.time - made.time[0], since=made.since + float(made.time[0]))
        except RislamError as error:
            raise ConfigError(str(error) if str(file) in str(error) else f"{file}: {error}") from None
        except (ValueError, TypeError) as error:
            cause = " ".join(str(error).split())[:80]
            raise ConfigError(f"{file}: {cause}; give one as a run folder's measurements_<scheme>.nc") from None
    table = _read_csv(file)
    if start is None:
        raise ConfigError(f"{file}: a CSV file does not say where the agent starts; give --start X,Y,Z")
    return inputs_of(table, start, radio, body, place=str(file))


def inputs_of(
    table: Mapping[str, Any], start: StartPrior, radio: RadioConfig, body: Body | None = None, *, place: str = "table"
) -> Inputs:
    """Inputs of an estimator from a table of measurements, a row a component: a mapping or data frame with `COLUMNS`.

    Parameters
    ----------
    start
        Prior of the first pose; a column `heading_rad` takes the place of its heading.
    radio
        Turns SNRs into amplitudes, and gives standard deviations that the table lacks.
    body
        Offsets of Tx and Rx; None is the paper's baseline, right for its agent alone: Rx at (0.0439, 0.0240, 0) m in
        the body frame (x forward, y left, z up), 0.05 m off and 0.5 rad to the left, and Tx opposite.

    Raises
    ------
    ConfigError
        A column is unknown, missing, or has a value of a wrong unit or range; with the start's velocity, the agent
        would go across a room within a cycle of many seconds.
    """
    columns = {str(name): _numbers(table[name], str(name), place) for name in table}
    check_names(columns, place)
    time = columns["time_s"]
    if not np.isfinite(time).all():
        row = int(np.argmin(np.isfinite(time))) + 1
        raise ConfigError(
            f"{place}: time_s: row {row} of the data has no finite number; give each row its cycle's time"
        )
    if (np.diff(time) < 0.0).any():
        raise ConfigError(f"{place}: time_s: not in order; sort the rows by time")
    cycles, cycle = np.unique(time, return_inverse=True)
    if np.isinf(columns["delay_s"]).any():
        row = int(np.argmax(np.isinf(columns["delay_s"]))) + 1
        raise ConfigError(
            f"{place}: delay_s: infinite in row {row} of the data; give a number, or leave the component out"
        )
    heard = np.isfinite(columns["delay_s"])
    check_components(columns, heard, place)
    check_heading(columns, cycle, place)
    check_amplitude(columns, heard, radio, place)
    lacking = [f"cos_{axis}_std" for axis in untold_axes(radio.array) if f"cos_{axis}_std" not in columns]
    if lacking:
        raise ConfigError(
            f"{place}: {', '.join(lacking)}: no such column, and the array of {radio.array.rows} x {radio.array.cols} "
            f"antennas tells no deviation there; give it, or the radio.array.rows and cols that measured"
        )
    filled = _filled({name: column[heard] for name, column in columns.items()}, radio)
    rows = [cycle[heard] == number for number in range(len(cycles))]
    measurements = tuple(Measurement(**{name: values[own] for name, values in filled.items()}) for own in rows)
    heading = columns.get("heading_rad", np.zeros(len(time)))[np.searchsorted(cycle, np.arange(len(cycles)))]
    if "heading_rad" in columns:  # the compass shows the first heading, too
        start = replace(start, heading=float(heading[0]))
    else:
        heading = np.full(len(cycles), np.nan)
    step, speed = usual_step(cycles), float(np.linalg.norm(start.velocity))
    if step > LONGEST_STEP and step * speed > LONGEST_STRIDE:
        raise ConfigError(
            f"{place}: time_s: cycles are {step:g} s apart, in which an agent at {speed:.3g} m/s goes "
            f"{step * speed:.3g} m; give seconds (were these milliseconds?), or mend the velocity"
        )
    nothing = (None,) * len(cycles)
    made = Inputs(start, body or Body(), None, cycles - cycles[0], heading, measurements, nothing, float(cycles[0]))
    return _check_inputs(made, place)


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
            raise ConfigError(
                f"{where}: delay of {one.tau.min():g} s received; give none below 0 (or add as much to all of its "
                "cycle: with the direct path among them lengths are counted from that)"
            )
        reach = np.abs(one.cosines).max(initial=0.0)
        if reach > 1.0:
            raise ConfigError(f"{where}: cosine of {reach:g} received; give {cosine_wanted(reach)}")
        squares = np.sum(one.cosines**2, axis=-1).max(initial=0.0)
        if squares > 1.0 + BEYOND_HORIZON:
            raise ConfigError(
                f"{where}: cosines whose squares sum to {squares:.6g} received, which no direction has; give at most 1 "
                f"({BACK_TO_HORIZON})"
            )
        for name in ("amplitude", "tau_std", "cosines_std", "amplitude_std"):
            value = getattr(one, name)
            good = np.isfinite(value) & (value > 0.0)
            if not good.all():
                raise ConfigError(f"{where}: {name} of {value[~good][0]:g} received; give positive, finite numbers")
        if (one.tau_std < FINEST_STD).any():
            raise ConfigError(
                f"{where}: tau_std of {one.tau_std.min():g} s received; give seconds (left out, it follows from the "
                "SNR: then mend amplitude, snr_db or radio.noise_psd)"
            )
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


def _filled(columns: Mapping[str, Floats], radio: RadioConfig) -> dict[str, Floats]:
    """Fields of measurements from the columns of a user's own table: cosines from angles, amplitudes and missing stds
    from the SNR."""
    if "amplitude" in columns:
        amplitude = columns["amplitude"]
        snr = radio.integrated_snr(amplitude)
    else:
        snr = np.power(10.0, columns["snr_db"] / 10.0)
        amplitude = np.sqrt(snr * radio.noise_psd / (radio.array.num_antennas * radio.energy))
    if "cos_x" in columns and "cos_y" in columns:
        cosines = np.stack([columns["cos_x"], columns["cos_y"]], axis=-1)
        cosines /= np.maximum(np.linalg.norm(cosines, axis=-1, keepdims=True), 1.0)  # what rounding put beyond
    else:
        theta, phi = columns["theta_r_rad"], columns["phi_r_rad"]
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
    if "panel_probability" in columns:
        found["from_panel"] = columns["panel_probability"]
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
    for number, row in enumerate(rows, start=1):
        for name, text in row.items():
            if name is None or text is None:
                what = "another number of fields than the header"
                raise ConfigError(f"{file}: row {number} of the data: {what}; mend it")
            try:
                table.setdefault(name.strip(), []).append(parse_number(text) if text.strip() else np.nan)
            except ValueError:
                what = f"'{text[:40]}' in row {number} of the data is no number"
                raise ConfigError(f"{file}: {name.strip()}: {what}; mend it") from None
    return table
