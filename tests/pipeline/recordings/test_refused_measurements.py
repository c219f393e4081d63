"""Measurements of one's own that cannot be: one line that names file, column and row, and how to mend it."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.recordings.inputs import inputs_to_dataset
from rislam_rt.pipeline.recordings.own_measurements import inputs_of, read_inputs
from rislam_rt.pipeline.run_datasets import seal_dataset
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.shipped import find_pipeline
from rislam_rt.slam import StartPrior
from rislam_rt.storage.netcdf import read_dataset, write_dataset
from rislam_rt.studies.unseen import Inputs

Table = dict[str, list[float]]
PIPELINE = find_pipeline("trace_then_slam")
START = StartPrior(np.zeros(3), np.zeros(3), 0.0)


def test_two_cosines_of_no_direction_are_refused(table: Table, spec: PipelineSpec) -> None:
    """0.8 and 0.7: the squares sum to 1.13. A ray on the horizon passes in three digits and in six, and is level."""
    start, rows = StartPrior(np.zeros(3), np.zeros(3), 0.0), len(table["time_s"])
    for digits in (3, 6):
        up = 10.0**-digits * np.ceil(10.0**digits * np.array([np.cos(0.7), np.sin(0.7)]))
        level = inputs_of({**table, "cos_x": rows * [up[0]], "cos_y": rows * [up[1]]}, start, build_radio(spec.radio))
        assert np.linalg.norm(level.measurements[0].cosines, axis=-1).max() <= 1.0 + 1e-15
    above = {"cos_x": rows * [np.cos(0.7) * 1.001], "cos_y": rows * [np.sin(0.7) * 1.001]}
    with pytest.raises(ConfigError, match=r"squares that sum to 1\.002 in row 1"):
        inputs_of({**table, **above}, start, build_radio(spec.radio))
    with pytest.raises(
        ConfigError, match=r"squares that sum to 1\.13 in row 1 .* divide both cosines by their norm\)$"
    ):
        inputs_of({**table, "cos_x": rows * [0.8], "cos_y": rows * [0.7]}, start, build_radio(spec.radio))


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("delay_s", 33.0, "delay_s: 33 in row 1 of the data; give numbers in seconds"),
        ("delay_s", -1e-9, "delay_s: -1e-09 in row 1 of the data; give .*none below 0"),
        ("cos_x", 1.7, "cos_x: 1.7 in row 1 of the data; give direction cosines from -1 to 1, not angles$"),
        ("cos_y", -1.01, "cos_y: -1.01 in row 1 .* from -1 to 1 .bring estimates beyond the horizon back .* norm.$"),
        ("delay_std_s", -1e-10, "delay_std_s: -1e-10 in row 1 of the data"),
        ("delay_std_s", np.inf, "delay_std_s: no finite number in row 1 of the data"),
        ("delay_std_s", 0.01, "delay_std_s: 0.01 in row 1 of the data; give numbers in seconds, at least"),
        ("cos_x_std", 3.0, "cos_x_std: 3 in row 1 of the data; give .* not degrees"),
        ("cos_y_std", 0.0, "cos_y_std: 0 in row 1 of the data"),
        ("amplitude", -1.0, "amplitude: -1 in row 1 of the data; give positive numbers, not decibels"),
        ("delay_s", 1e-9 + 1j, "complex numbers received"),
        ("cos_x", "north", "not numbers"),
        ("speed", 1.0, "speed: unknown column; mend its name: the known ones are time_s"),
        ("delay", 1.0, "delay: unknown column; did you mean 'delay_s'"),
        ("heading_rad", 45.0, "heading_rad: 45 in row 1 of the data; give at most a turn, in radians"),
        ("amplitude_std", 0.0, "amplitude_std: 0 in row 1 of the data"),
        ("delay_s", np.inf, "delay_s: infinite in row 1 of the data"),
        ("heading_rad", np.nan, "heading_rad: no finite number in row 1 .* or leave the column out"),
        ("heading_rad", np.inf, "heading_rad: no finite number in row 1 .* or leave the column out"),
        ("panel_probability", 7.0, "panel_probability: 7 in row 1 of the data; give probabilities from 0 to 1"),
        ("panel_probability", np.nan, "panel_probability: no finite number in row 1 of the data"),
        ("amplitude", 1e300, "amplitude: 1e.300 in row 1 of the data is an SNR of inf dB"),
        ("snr_db", 30.0, "columns that say the same"),
        ("phi_r_rad", 0.1, "columns that say the same"),
    ],
)
def test_a_wrong_unit_or_range_is_one_line(
    table: Table, spec: PipelineSpec, name: str, values: object, said: str
) -> None:
    rows = {**table, name: [values] * len(table["time_s"])}
    with pytest.raises(ConfigError, match=said) as raised:
        inputs_of(rows, StartPrior(np.zeros(3), np.zeros(3), 0.0), build_radio(spec.radio))
    assert "\n" not in str(raised.value)


def test_a_missing_column_is_named(table: Table, spec: PipelineSpec) -> None:
    del table["amplitude"]
    with pytest.raises(ConfigError, match="amplitude or snr_db: column missing"):
        inputs_of(table, StartPrior(np.zeros(3), np.zeros(3), 0.0), build_radio(spec.radio))


def test_a_deviation_that_the_array_does_not_tell_is_asked_for(table: Table) -> None:
    """Of 8 x 1 antennas none lies along y: nothing was wrong with a deviation that nobody gave."""
    radio, start = build_radio(load_spec(PIPELINE, ["radio.array.rows=8", "radio.array.cols=1"]).radio), START
    table = {name: column for name, column in table.items() if not name.endswith("_std")}
    with pytest.raises(ConfigError) as found:
        inputs_of(table, start, radio, place="mine.csv")
    assert str(found.value) == (
        "mine.csv: cos_y_std: no such column, and the array of 8 x 1 antennas tells no deviation there; give it, or "
        "the radio.array.rows and cols that measured"
    )
    inputs_of({**table, "cos_y_std": [0.5] * len(table["time_s"])}, start, radio)


def test_the_deviation_that_is_wrong_is_told(tmp_path: Path, table: Table, spec: PipelineSpec) -> None:
    data = inputs_to_dataset(inputs_of(table, START, build_radio(spec.radio)))
    data["tau_std"][1, 0] = np.inf
    write_dataset(data, tmp_path / "mine.nc")
    with pytest.raises(ConfigError, match="cycle 1: tau_std of inf received; give positive, finite numbers"):
        read_inputs(tmp_path / "mine.nc", None, build_radio(spec.radio))


def test_a_cosine_goes_with_a_cosine(table: Table, spec: PipelineSpec) -> None:
    table["phi_r_rad"] = table.pop("cos_y")
    with pytest.raises(ConfigError, match="a cosine beside an angle"):
        inputs_of(table, StartPrior(np.zeros(3), np.zeros(3), 0.0), build_radio(spec.radio))


def test_a_ray_from_below_is_not_taken_for_its_mirror_image(table: Table, spec: PipelineSpec) -> None:
    del table["cos_x"], table["cos_y"]
    table["theta_r_rad"], table["phi_r_rad"] = ([value] * len(table["time_s"]) for value in (3.0, 0.2))
    with pytest.raises(ConfigError, match="theta_r_rad: 3 in row 1 of the data; give 0 to pi/2"):
        inputs_of(table, StartPrior(np.zeros(3), np.zeros(3), 0.0), build_radio(spec.radio))


def test_a_column_given_twice_is_refused(tmp_path: Path, spec: PipelineSpec) -> None:
    file = tmp_path / "twice.csv"
    file.write_text("time_s,delay_s,delay_s,cos_x,cos_y,snr_db\n0,6e-9,9e-9,0.1,0.1,30\n")
    with pytest.raises(ConfigError, match="a column is there twice"):
        read_inputs(file, StartPrior(np.zeros(3), np.zeros(3), 0.0), build_radio(spec.radio))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time_s;delay_s\n0;1e-8\n", "line 1: one column, 'time_s;delay_s'; part the columns by commas"),
        ("time_s\tdelay_s\n0\t1e-8\n", "line 1: one column, 'time_s delay_s'; part the columns by commas"),
        (
            "time_s,heading_rad,delay_s,cos_x,cos_y,amplitude\n0,0,1e-8,0,0,0.01\nnan,0,1e-8,0,0,0.01\n",
            "time_s: row 2 of the data has no finite number; give each row its cycle's time",
        ),
        (
            "time_s,heading_rad,delay_s,cos_x,cos_y,amplitude\n0,0,,,,\n1,0,1e-8,0,0,0.01\n1,0,,0.1,0,0.01\n",
            "delay_s: empty beside cos_x in row 3 of the data; fill it, or leave the component out",
        ),
        (
            "time_s,heading_rad,delay_s,theta_r_rad,phi_r_rad,amplitude\n0,0,,,,\n1,0,1e-8,0,0,0.01\n1,0,1e-8,,0,0.01\n",
            "theta_r_rad: no finite number in row 3 of the data; fill it, or leave the component out",
        ),
        (
            ",time_s,heading_rad,delay_s,cos_x,cos_y,snr_db\n0,0,0,1e-8,0,0,30\n",
            "column 1: has no name, as the index of a data frame that was written with the rest; leave it out "
            "(to_csv(..., index=False)), or name it",
        ),
        (
            "time_s,heading_rad,delay_s,cos_x,cos_y,snr_db\n0,0,1e-8,0,0,3000\n",
            "snr_db: 3000 in row 1 of the data; give decibels, -200 to 200",
        ),
        (
            "time_s,heading_rad,delay_s,cos_x,cos_y,amplitude\n1,0,1e-8,0,0,0.01\n1,0.2,1e-8,0,0,0.01\n",
            "heading_rad: row 2 of the data has another than its cycle's first row; give one heading a cycle",
        ),
        (
            "time_s,heading_rad,delay_s,cos_x,cos_y,amplitude\n1,0,1e-8,0,0,0.01\n1,,1e-8,0,0,0.01\n",
            "heading_rad: no finite number in row 2 of the data; give each row its cycle's heading, or leave the "
            "column out (slam.heading=estimated)",
        ),
        (
            "time_s,heading_rad,delay_s,cos_x,cos_y,amplitude\n1,0,1e-8,0,0,0.01\n1,0,1e-8,0,0,1_5\n",
            "amplitude: '1_5' in row 2 of the data is no number; mend it",
        ),
    ],
)
def test_what_is_wrong_with_a_table_is_named(tmp_path: Path, spec: PipelineSpec, text: str, said: str) -> None:
    (tmp_path / "mine.csv").write_text(text)
    start = StartPrior(np.zeros(3), np.zeros(3), heading=0.0)
    with pytest.raises(ConfigError) as found:
        read_inputs(tmp_path / "mine.csv", start, build_radio(spec.radio))
    assert str(found.value) == f"{tmp_path / 'mine.csv'}: {said}"


def test_a_file_of_another_kind_names_what_it_lacks(tmp_path: Path, spec: PipelineSpec) -> None:
    import xarray as xr

    xr.Dataset({"map_position": ("x", [1.0])}).to_netcdf(tmp_path / "scheme.nc", engine="h5netcdf")
    with pytest.raises(ConfigError) as found:
        read_inputs(tmp_path / "scheme.nc", None, build_radio(spec.radio))
    said = str(found.value).removeprefix(f"{tmp_path / 'scheme.nc'}: ")
    assert said.startswith("time, heading, tau, cosines, amplitude, start_position, ")
    assert said.endswith(
        "rx_offset: missing; give them as in a run folder's measurements_<scheme>.nc "
        "(heading: NaN without a compass, with slam.heading=estimated)"
    )


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("tau", np.nan, "cycle 0: tau: NaN at index"),
        ("time", np.nan, "time: not increasing, or not finite"),
        ("start_position", np.nan, "StartPrior.position: NaN at index"),
        ("from_panel", 7.0, "cycle 0: from_panel: not from 0 to 1"),
    ],
)
def test_what_is_wrong_in_a_netcdf_file_names_the_file(
    recorded: tuple[Inputs, np.ndarray], tmp_path: Path, name: str, value: float, said: str
) -> None:
    data = inputs_to_dataset(recorded[0])
    data["from_panel"] = data.tau * 0.0 + 0.5
    data[name] = data[name] * 0.0 + value
    data.to_netcdf(tmp_path / "mine.nc", engine="h5netcdf")
    with pytest.raises(ConfigError) as found:
        read_inputs(tmp_path / "mine.nc", None, build_radio(load_spec(find_pipeline("trace_then_slam")).radio))
    assert str(found.value).startswith(f"{tmp_path / 'mine.nc'}: {said}")


def test_a_file_without_cycles_is_refused(recorded: tuple[Inputs, np.ndarray], tmp_path: Path) -> None:
    data = inputs_to_dataset(recorded[0]).isel(time=slice(0, 0))
    data.to_netcdf(tmp_path / "mine.nc", engine="h5netcdf")
    with pytest.raises(ConfigError) as found:
        read_inputs(tmp_path / "mine.nc", None, build_radio(load_spec(find_pipeline("trace_then_slam")).radio))
    assert str(found.value) == f"{tmp_path / 'mine.nc'}: no cycles; give at least one"


def test_a_recording_changed_since_it_was_written_is_refused(
    recorded: tuple[Inputs, np.ndarray], tmp_path: Path
) -> None:
    """As `run` and `report` refuse it; a file without a checksum is a user's own."""
    radio = build_radio(load_spec(find_pipeline("trace_then_slam")).radio)
    write_dataset(seal_dataset(inputs_to_dataset(recorded[0])), tmp_path / "run.nc")
    assert len(read_inputs(tmp_path / "run.nc", None, radio).time) == len(recorded[0].time)
    changed = read_dataset(tmp_path / "run.nc")
    changed["amplitude"] = changed.amplitude * 1.01
    write_dataset(changed, tmp_path / "changed.nc")
    with pytest.raises(ConfigError, match="changed since it was written"):
        read_inputs(tmp_path / "changed.nc", None, radio)
    del changed.attrs["checksum"]
    write_dataset(changed, tmp_path / "own.nc")
    assert len(read_inputs(tmp_path / "own.nc", None, radio).time) == len(recorded[0].time)
