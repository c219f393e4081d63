"""What stands in a run's files: labels for `.sel`, and measurements that give the run's estimate again."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rislam_rt.model import RisCode, RisSpec
from rislam_rt.model.ris import RisSpecs
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.recordings.answer_files import true_positions
from rislam_rt.pipeline.recordings.inputs import dataset_to_inputs, given_to_dataset, inputs_to_dataset
from rislam_rt.pipeline.recordings.own_measurements import localise, read_inputs, run_rng
from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.pipeline.store.identity import run_identity
from rislam_rt.pipeline.store.run_folder import open_run
from rislam_rt.scene.write import tum_bytes
from rislam_rt.storage.netcdf import write_dataset

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def stored(room, short_spec, short_result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "one"
    with open_run(folder, run_identity(short_spec, room)) as store:
        store.update(short_result.schemes)
        store.complete(short_result, summarise(short_result))
    return folder, short_result


def opened(stored, name):
    return xr.open_dataset(stored[0] / name, engine="h5netcdf")


def test_times_paths_and_axes_are_selected_by_name(stored):
    _, result = stored
    agent, paths = result.scene.agent, result.paths
    with opened(stored, "paths.nc") as data:
        there = data.sel(time=0.31, method="nearest")
        assert float(there.true_position.sel(xyz="y")) == agent.position[3, 1]
        assert float(there.tau.sel(path="RIS ris")) == paths.tau[3, paths.kind == 4][0]
        panel = data.where(data.kind_name == "VRIS", drop=True)
        assert panel.sizes["path"] == np.sum(paths.kind == 5)
        assert set(panel.landmark_name.to_numpy()) == {"ris"}
        assert len(set(data.path.to_numpy())) == paths.num_paths
    with opened(stored, "scheme_random.nc") as data:
        assert data.position.sel(time=agent.time[4], xyz="x") == result.schemes["random"].position[4, 0]
        assert float(data.seconds.sel(step="localise").sum()) > 0.0
        assert float(data.covariance.sel(time=0.0, state="vx")[3]) == result.schemes["random"].covariance[0, 3, 3]
        assert set(data.landmark.to_numpy()) == set(result.schemes["random"].ident)


def test_the_page_names_every_variable(stored):
    page = (ROOT / "docs" / "files.md").read_text()
    for file in ("paths.nc", "scheme_random.nc", "measurements_random.nc"):
        with opened(stored, file) as data:
            names = {str(name) for name in data.variables}
        families = ("map_", "info_", "start_", "panel_")
        names = {name for name in names if not name.startswith(families) and not name.endswith("_std")}
        assert not {name for name in names if f"`{name}`" not in page} - {"ident", "component"}, file


def test_measurements_hold_no_truth(stored):
    with opened(stored, "measurements_random.nc") as data:
        assert not [name for name in data.variables if "true" in str(name) or "path" in str(name)]
        assert data.tau.dims == ("time", "component")
        assert float(data.cosines.sel(cosine="x").max()) <= 1.0


@pytest.mark.parametrize("scheme", ["optimized", "random"])
def test_the_same_measurements_give_the_same_estimate(stored, short_spec, scheme):
    folder, result = stored
    file = folder / f"measurements_{scheme}.nc"
    inputs = read_inputs(file, None, build_radio(short_spec.radio))
    answers = localise(inputs, short_spec, rng=run_rng(file))
    found = np.array([one.position for one in answers.estimates])
    np.testing.assert_array_equal(found, result.schemes[scheme].position)
    covariance = np.array([one.covariance for one in answers.estimates])
    np.testing.assert_array_equal(covariance, result.schemes[scheme].covariance)


def test_a_recordings_clock_stays_with_its_measurements(room, run_short, short_result, tmp_path):
    """Truth, estimates and what `slam` makes of the measurements have one clock, also where it does not begin at 0."""
    agent = replace(room.agent, time=room.agent.time + 1.7e9)
    result = run_short('schemes=["random"]', scene=replace(room, agent=agent))
    scheme = result.schemes["random"]
    write_dataset(given_to_dataset(scheme), tmp_path / "random.nc")
    inputs = read_inputs(tmp_path / "random.nc", None, build_radio(load_spec("trace_then_slam").radio))
    assert inputs.time[0] == 0.0
    np.testing.assert_array_equal(inputs.time + inputs.since, agent.time[: len(inputs.time)])
    true = result.scene.agent
    (tmp_path / "truth.tum").write_bytes(tum_bytes(true.time, true.position, true.heading))
    assert len(true_positions(tmp_path / "truth.tum", inputs.time + inputs.since)) == len(inputs.time)
    assert "since" not in given_to_dataset(short_result.schemes["random"]).attrs  # its clock begins at 0


def test_several_panels_are_written_and_read(stored):
    inputs = stored[1].schemes["random"].given.inputs
    one = inputs.panel
    both = RisSpecs((one, RisSpec(2, 3, [0.01, 0.02], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], one.levels, "energy", 0.5)))
    codes = tuple(RisCode(np.full((1, both.num_elements), number % 2), one.levels) for number in range(8))
    again = dataset_to_inputs(inputs_to_dataset(inputs._replace(panel=both, codes=codes)))
    for found, wanted in zip(again.panel.panels, both.panels, strict=True):
        assert (found.rows, found.cols, found.element) == (wanted.rows, wanted.cols, wanted.element)
        np.testing.assert_array_equal(found.offsets(), wanted.offsets())
        assert found.amplitude == wanted.amplitude
    np.testing.assert_array_equal([code.index for code in again.codes], [code.index for code in codes])


@pytest.fixture(scope="module")
def errors_in_deviations(run_short):
    """(N, 3) errors of a run's components in delay and cosines, over the deviations said; of either estimator."""
    settings = {"waveform": ["receiver.estimator=waveform"], "bound": ["receiver.merge=false"]}
    return {name: _errors(run_short(*more, 'schemes=["random"]')) for name, more in settings.items()}


def _errors(result):
    rows, scheme, agent = [], result.schemes["random"], result.scene.agent
    for cycle, heard in enumerate(scheme.given.inputs.measurements):
        path = scheme.component_path[cycle][: len(heard)]
        true, turn = path[path >= 0], agent.heading[cycle]
        x, y, _ = result.paths.arrival[cycle, true].T
        body = np.column_stack([np.cos(turn) * x + np.sin(turn) * y, np.cos(turn) * y - np.sin(turn) * x])
        off = np.column_stack([heard.tau[path >= 0] - result.paths.tau[cycle, true], heard.cosines[path >= 0] - body])
        rows.append(off / np.column_stack([heard.tau_std, heard.cosines_std])[path >= 0])
    return np.concatenate(rows)


@pytest.mark.parametrize(("axis", "name"), [(0, "delay"), (1, "cosine x"), (2, "cosine y")])
@pytest.mark.parametrize("estimator", ["waveform", "bound"])
def test_components_are_as_sure_as_they_say(errors_in_deviations, estimator, axis, name):
    """Errors of a Gaussian are within one deviation in 68 % of cases; some 300 of them, of 40 paths, to 6 % or so.

    Half the deviation would be 38 %, twice the deviation 95 %.
    """
    error = errors_in_deviations[estimator][:, axis]
    assert len(error) > 250
    assert 0.53 < np.mean(np.abs(error) < 1.0) < 0.83


@pytest.mark.parametrize("file", ["paths.nc", "scheme_random.nc", "scheme_optimized.nc"])
def test_a_file_says_of_which_room_it_is(stored, room, file):
    with opened(stored, file) as data:
        assert data.attrs["scene_sha256"] == room.digest
