"""Measurements in a user's own NetCDF file: read by the names of dimensions, and one line for what is wrong in it."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rislam_rt.errors import ConfigError, GeometryError
from rislam_rt.model import Measurement, RadioConfig
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.recordings.inputs import PARTS, dataset_to_inputs, given_to_dataset, inputs_to_dataset
from rislam_rt.pipeline.recordings.own_measurements import inputs_of, localise, read_inputs
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.shipped import find_pipeline
from rislam_rt.slam import StartPrior
from rislam_rt.storage.netcdf import write_dataset
from rislam_rt.studies.unseen import Inputs

STDS = ["tau_std", "cosines_std", "amplitude_std"]
LIKE_A_RUN = "as in a run folder's measurements_<scheme>.nc"


@pytest.fixture
def data(recorded: tuple[Inputs, np.ndarray]) -> xr.Dataset:
    return inputs_to_dataset(recorded[0])


@pytest.fixture
def radio(spec: PipelineSpec) -> RadioConfig:
    return build_radio(spec.radio)


def same(found: Inputs, wanted: Inputs) -> None:
    """Both have the same arrays of measurements, times, headings and start."""
    for one, other in zip(found.measurements, wanted.measurements, strict=True):
        for name in PARTS:
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)
    np.testing.assert_array_equal(found.time, wanted.time)
    np.testing.assert_array_equal(found.heading, wanted.heading)
    np.testing.assert_array_equal(found.start.position, wanted.start.position)


def refusal(data: xr.Dataset, file: Path, radio: RadioConfig) -> str:
    """What the one line says that refuses a data set, without the file."""
    write_dataset(data, file)
    with pytest.raises(ConfigError) as found:
        read_inputs(file, None, radio)
    assert "\n" not in str(found.value)
    assert str(found.value).startswith(f"{file}: ")
    return str(found.value).removeprefix(f"{file}: ")


def test_dimensions_may_stand_in_any_order(
    recorded: tuple[Inputs, np.ndarray], data: xr.Dataset, tmp_path: Path, radio: RadioConfig
) -> None:
    one, all_of_them = data.copy(), data.transpose("component", "cosine", ...)
    one["tau"] = data.tau.transpose()
    for number, turned in enumerate((one, all_of_them)):
        assert turned.tau.dims == ("component", "time")
        write_dataset(turned, tmp_path / f"{number}.nc")
        same(read_inputs(tmp_path / f"{number}.nc", None, radio), recorded[0])


def test_as_many_cycles_as_components_are_not_taken_for_each_other(data: xr.Dataset) -> None:
    square = data.isel(time=slice(0, data.sizes["component"]))
    assert square.sizes["time"] == square.sizes["component"]
    same(dataset_to_inputs(square.transpose("component", ...)), dataset_to_inputs(square))


def test_codes_and_panels_are_read_by_their_dimensions(short_result) -> None:
    given = given_to_dataset(short_result.schemes["random"])
    turned = given.transpose("col", "row", "xyz", "pair", ...)
    assert turned.panel_normal.dims == ("xyz", "panel")
    found, wanted = dataset_to_inputs(turned), dataset_to_inputs(given)
    np.testing.assert_array_equal([one.index for one in found.codes], [one.index for one in wanted.codes])
    np.testing.assert_array_equal(found.panel.normal, wanted.panel.normal)
    assert (found.panel.rows, found.panel.cols) == (wanted.panel.rows, wanted.panel.cols)


def test_other_dimensions_are_refused_by_name(data: xr.Dataset, tmp_path: Path, radio: RadioConfig) -> None:
    wide, flat = data.copy(), data.copy()
    wide["tau"] = data.tau.rename(component="path")
    flat["tau"] = data.tau.isel(component=0)
    said = refusal(wide, tmp_path / "wide.nc", radio)
    assert said == "tau: dimensions: time, path received; give time, component"
    assert refusal(flat.drop_vars("component"), tmp_path / "flat.nc", radio) == (
        "tau: dimensions: time received; give time, component"
    )
    lone = data.assign(start_position=((), 1.0))
    assert refusal(lone, tmp_path / "lone.nc", radio) == "start_position: dimensions: none received; give xyz"


def test_complex_amplitudes_are_refused(data: xr.Dataset, recorded: tuple[Inputs, np.ndarray]) -> None:
    data["amplitude"] = data.amplitude * np.exp(0.3j)
    wanted = "complex numbers received; give real ones (of an amplitude the modulus)"
    with pytest.raises(ConfigError) as found:
        dataset_to_inputs(data)
    assert str(found.value) == f"amplitude: {wanted}"
    heard = recorded[0].measurements[0]
    parts = {name: getattr(heard, name) for name in PARTS}
    with pytest.raises(GeometryError, match=r"^Measurement\.amplitude: complex numbers received"):
        Measurement(**{**parts, "amplitude": parts["amplitude"] * 1j})


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("time", np.arange(20).astype("M8[ns]"), "time: datetime64 received; give seconds"),
        ("time", np.arange(20).astype("m8[ms]"), "time: timedelta64 received; give seconds"),
        ("heading", np.array(20 * ["north"]), "heading: not numbers; mend the variable"),
    ],
)
def test_what_is_no_number_is_named(
    data: xr.Dataset, tmp_path: Path, radio: RadioConfig, name: str, values: np.ndarray, said: str
) -> None:
    data = data.drop_vars(name).assign({name: (("time",), values)})
    assert refusal(data, tmp_path / "mine.nc", radio) == said


@pytest.mark.parametrize("name", ["heading", "position_std", "velocity_std", "heading_std"])
def test_a_missing_attribute_is_named(data: xr.Dataset, tmp_path: Path, radio: RadioConfig, name: str) -> None:
    told = data.attrs.pop(f"start_{name}")
    said = refusal(data, tmp_path / "mine.nc", radio)
    assert said == f"attribute start_{name} is missing; give it"
    data.attrs[f"start_{name}"] = f"{told} rad"
    said = refusal(data, tmp_path / "mine.nc", radio)
    assert said == f"attribute start_{name}: {told} rad received; give a number"


def test_missing_variables_are_named(data: xr.Dataset, tmp_path: Path, radio: RadioConfig) -> None:
    compass = "(heading: NaN without a compass, with slam.heading=estimated)"
    said = refusal(data.drop_vars("heading"), tmp_path / "a.nc", radio)
    assert said == f"heading: missing; give it {LIKE_A_RUN} {compass}"
    said = refusal(data.drop_vars("time"), tmp_path / "b.nc", radio)
    assert said == f"time: missing; give it {LIKE_A_RUN}"
    with pytest.raises(ConfigError) as found:
        dataset_to_inputs(data.drop_vars(STDS))
    assert str(found.value) == f"{', '.join(STDS)}: missing; give them {LIKE_A_RUN}"


def test_a_heading_of_nan_is_no_compass(data: xr.Dataset, tmp_path: Path, radio: RadioConfig) -> None:
    write_dataset(data.assign(heading=data.heading * np.nan).isel(time=slice(0, 2)), tmp_path / "mine.nc")
    inputs = read_inputs(tmp_path / "mine.nc", None, radio)
    spec = load_spec(find_pipeline("trace_then_slam"), ["schemes=['no_ris']", "slam.heading=estimated"])
    assert len(localise(inputs, spec, rng=np.random.default_rng(0)).estimates) == 2


def test_deviations_left_out_are_those_of_a_table(
    data: xr.Dataset, table: dict[str, list[float]], tmp_path: Path, spec: PipelineSpec, radio: RadioConfig
) -> None:
    table = {name: column for name, column in table.items() if not name.endswith(("_std", "_std_s"))}
    wanted = inputs_of(table, StartPrior(data.start_position.to_numpy(), np.zeros(3), 0.0), radio)
    write_dataset(data.drop_vars(STDS), tmp_path / "mine.nc")
    found = read_inputs(tmp_path / "mine.nc", None, radio)
    for one, other in zip(found.measurements, wanted.measurements, strict=True):
        for name in STDS:
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-12)
    line = build_radio(load_spec(find_pipeline("trace_then_slam"), ["radio.array.cols=1"]).radio)
    said = refusal(data.drop_vars(STDS), tmp_path / "line.nc", line)
    assert said == f"cosines_std: missing; give it {LIKE_A_RUN}"
    silent = data.drop_vars(STDS).assign(amplitude=data.amplitude.where(data.amplitude < 0.0, 0.0))
    assert refusal(silent, tmp_path / "silent.nc", radio) == (
        "cycle 0: amplitude of 0 received; give positive, finite numbers"
    )


def test_components_of_nan_are_none(
    recorded: tuple[Inputs, np.ndarray], data: xr.Dataset, tmp_path: Path, radio: RadioConfig
) -> None:
    """As `xarray.concat` and data frames fill cycles of fewer components."""
    there = (data.tau != -9.0).to_numpy()
    assert not there.all()
    ragged = data.copy()
    for name in PARTS:
        ragged[name] = data[name].where(data.tau != -9.0)
    write_dataset(ragged, tmp_path / "mine.nc")
    same(read_inputs(tmp_path / "mine.nc", None, radio), recorded[0])
    write_dataset(ragged.drop_vars(STDS), tmp_path / "bare.nc")
    counts = [len(one) for one in read_inputs(tmp_path / "bare.nc", None, radio).measurements]
    assert counts == list(there.sum(axis=1))
    ragged["tau"][1, 0] = np.nan
    said = refusal(ragged, tmp_path / "holed.nc", radio)
    assert said.startswith("cycle 1: tau: NaN at index (0,)")


def test_inputs_are_shown_in_one_line(recorded: tuple[Inputs, np.ndarray], short_result) -> None:
    inputs = recorded[0]
    heard = sum(len(one) for one in inputs.measurements)
    assert repr(inputs) == f"Inputs: 20 cycles over {inputs.time[-1]:.4g} s, {heard} components, no panel"
    given = short_result.schemes["random"].given.inputs
    sheet = given.panel
    assert repr(given).endswith(f" components, panel of {sheet.rows} x {sheet.cols}")
    empty = inputs._replace(time=np.zeros(0), heading=np.zeros(0), measurements=(), codes=())
    assert repr(empty) == "Inputs: 0 cycles, 0 components, no panel"
