"""A completed run in any room as recordings: the scores of its replay, with or without slices, and what is refused."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import rislam_rt
from rislam_rt.errors import ConfigError, ResultError, StoreError
from rislam_rt.model import Scene
from rislam_rt.pipeline import PipelineSpec, load_spec, run_slam
from rislam_rt.pipeline.long import slices
from rislam_rt.pipeline.long.run import read_whole, run_long
from rislam_rt.pipeline.scores import audible_paths
from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.pipeline.store.identity import run_identity
from rislam_rt.pipeline.store.run_folder import open_run
from rislam_rt.scene import load_scene
from rislam_rt.shipped import find_pipeline, find_room
from rislam_rt.studies.score_card import recorded_run
from rislam_rt.studies.score_card.score import OVER_TIME

CYCLES = 14
"""The first births come in the twelfth cycle."""
SETTINGS = (
    "channel=image_source", f"cycles={CYCLES}", "depth=1", "receiver.estimator=bound", 'schemes=["random", "no_ris"]',
)  # fmt: skip


@pytest.fixture(scope="module")
def room() -> Scene:
    return load_scene(find_room("paper_room"))


@pytest.fixture(scope="module")
def spec() -> PipelineSpec:
    return load_spec(find_pipeline("trace_then_slam"), SETTINGS)


@pytest.fixture(scope="module")
def folder(room: Scene, spec: PipelineSpec, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a completed run."""
    place = tmp_path_factory.mktemp("runs") / "mine"
    result = run_slam(room, spec, rng=np.random.default_rng(spec.seed))
    with open_run(place, run_identity(spec, room)) as store:
        store.update(result.schemes)
        store.complete(result, summarise(result))
    return place


@pytest.fixture(scope="module")
def recordings(folder: Path) -> dict[str, rislam_rt.Recording]:
    return rislam_rt.record_run(folder)


def test_the_scores_are_those_of_replaying_and_scoring(
    folder: Path, recordings: dict[str, rislam_rt.Recording], tmp_path: Path
) -> None:
    assert list(recordings) == ["random", "no_ris"]
    summary = summarise(read_whole(folder))
    for name, recording in recordings.items():
        rislam_rt.write_recording(recording, tmp_path / f"{name}.nc")
        again = rislam_rt.read_recording(tmp_path / f"{name}.nc")
        assert (again.scheme, dict(again.scores)) == (name, dict(recording.scores))
        assert again.traits == {"room": "paper_room", "run": "mine", "seed": 7}
        answers = rislam_rt.replay(again.inputs, again.config, again.scheme, rng=np.random.default_rng(0))
        assert {"ran": name, **rislam_rt.score_run(again.truth, again.inputs, answers)} == recording.scores
        told = summary["schemes"][name]
        assert recording.scores["rmse_m"] == pytest.approx(told["rmse_m"])
        assert recording.scores["births"] > 0
        assert recording.truth.panel == 1


def test_the_panel_is_a_landmark_of_the_scheme_that_is_told_of_it(
    recordings: dict[str, rislam_rt.Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(audible_paths, "HEARD", 0.1 * CYCLES)  # what is heard throughout counts, as in a longer run
    for name, heard in (("random", 2), ("no_ris", 1)):
        one = recordings[name]
        assert (one.inputs.panel is None) == (name == "no_ris")
        truth = one.truth._replace(landmark_audible=np.ones_like(one.truth.landmark_audible))  # sphere and panel
        answers = rislam_rt.answers_from_arrays(one.inputs, truth.position)
        assert rislam_rt.score_run(truth, one.inputs, answers)["points_heard"] == heard


def test_without_a_replay_all_is_the_same_but_what_needs_one(
    folder: Path, recordings: dict[str, rislam_rt.Recording]
) -> None:
    for name, recording in rislam_rt.record_run(folder, replayed=False).items():
        whole = recordings[name].scores
        assert {key: recording.scores[key] for key in OVER_TIME} == dict.fromkeys(OVER_TIME)
        for key in whole.keys() - OVER_TIME:
            assert recording.scores[key] == whole[key], key


def test_progress_is_told_and_a_replay_that_strays_is_not_taken_for_the_run(
    folder: Path, recordings: dict[str, rislam_rt.Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[str, int, int]] = []
    real: Callable[..., rislam_rt.pipeline.recordings.replay.Answers] = recorded_run.replay

    def other(inputs: object, config: object, scheme: str, **more: object) -> object:
        return real(inputs, config, scheme, {"slam.sigma_a": 0.5}, **more)

    monkeypatch.setattr(recorded_run, "replay", other)
    result = read_whole(folder)
    one = replace(result, schemes={"no_ris": result.schemes["no_ris"]})
    found = list(recorded_run.recorded_schemes(one, folder, progress=lambda *step: told.append(step)))
    assert told == [("no_ris", cycle, CYCLES) for cycle in range(1, CYCLES + 1)]
    assert len(found) == 1
    for one in found:
        assert one.has_strayed
        assert one.recording.scores["births"] is None
        assert one.recording.scores["rmse_m"] == recordings[one.recording.scheme].scores["rmse_m"]


def test_a_run_in_slices_is_recorded_as_a_whole(room: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slices, "SLICE", 8)
    spec = load_spec(find_pipeline("trace_then_slam"), [*SETTINGS[:-1], 'schemes=["random"]'])
    with open_run(tmp_path / "long", run_identity(spec, room)) as store:
        run_long(room, spec, store, rng=np.random.default_rng(7), jobs=1, progress=lambda *_: None)
    result = read_whole(tmp_path / "long")
    for one in recorded_run.recorded_schemes(result, tmp_path / "long"):
        assert one.apart == 0.0
        assert len(one.recording.inputs.time) == len(one.recording.truth.bound) == CYCLES
        assert one.recording.scores["births"] > 0
        found = result.schemes[one.recording.scheme].position
        error = np.linalg.norm(found - one.recording.truth.position, axis=1)
        assert one.recording.scores["rmse_m"] == pytest.approx(np.sqrt(np.mean(error**2)))


def test_what_is_no_run_or_lacks_its_measurements_is_told(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="not a completed run"):
        rislam_rt.record_run(tmp_path)
    result = read_whole(folder)
    with pytest.raises(ResultError, match=r"measurements_random.nc: no such file, as another version wrote the run"):
        next(recorded_run.recorded_schemes(result, tmp_path))
    data = xr.open_dataset(folder / "measurements_random.nc", engine="h5netcdf").load()
    data.drop_vars("tau").to_netcdf(tmp_path / "measurements_random.nc", engine="h5netcdf")
    with pytest.raises(ResultError, match=r"measurements_random.nc: damaged \(ConfigError: tau: missing; .*run again"):
        next(recorded_run.recorded_schemes(result, tmp_path))


def test_the_truth_is_shown_in_one_line(recordings: dict[str, rislam_rt.Recording]) -> None:
    truth = recordings["random"].truth
    landmarks, walls, paths = len(truth.landmark), len(truth.wall_middle), len(truth.path_kind)
    about = f"{landmarks} landmarks (1 panel among them), {walls} walls, {paths} paths"
    assert repr(truth) == f"Truth: {CYCLES} cycles, {about}"
    assert "(no panels among them)" in repr(truth._replace(panel=0))
    assert "(2 panels among them)" in repr(truth._replace(panel=2))


def test_what_is_no_recording_says_what_to_give(
    folder: Path, recordings: dict[str, rislam_rt.Recording], tmp_path: Path
) -> None:
    wanted = "give one that write_recording or rislam-rt score RUN --save FOLDER wrote"
    file = tmp_path / "mine.csv"
    for text, said in ((None, "no such file"), ("time_s,delay_s\n", "not a readable NetCDF file of a recording")):
        if text is not None:
            file.write_text(text)
        with pytest.raises(StoreError) as found:
            rislam_rt.read_recording(file)
        assert str(found.value) == f"{file}: {said}; {wanted}"
    measured = folder / "measurements_random.nc"
    with pytest.raises(StoreError) as found:
        rislam_rt.read_recording(measured)
    assert str(found.value) == f"{measured}: no recording, for it holds no truth (true_position); {wanted}"
