"""One cell: what it gives does not depend on how it is asked for, and what it leaves can be replayed to the bit."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rislam_rt.errors import ConfigError, StoreError
from rislam_rt.model import empty_map
from rislam_rt.scene import load_scene
from rislam_rt.scene.random_rooms import draw_room
from rislam_rt.studies import UnseenSpec, load_any
from rislam_rt.studies.unseen import answers_from_arrays, build_unseen, count_tests, read_recording, replay, score_run
from rislam_rt.studies.unseen.cell import find_setup, run_cell
from rislam_rt.studies.unseen.spec import WALL_TOP_SPEED
from rislam_rt.sweeps import build_cells

RUN = {
    "channel": "image_source", "depth": 1, "cycles": 12, "schemes": ["random"], "slam": {"use_vt": True},
    "motion": {"sigma_a_m_s2": 0.01}, "radio": {"reference_snr_db": 13.0}, "receiver": {"estimator": "bound"},
}  # fmt: skip
WITH_PANEL, WITHOUT = 22, 3
"""Rooms whose classes the tests reckon with."""


def cell(room: int, **more: Any) -> dict[str, Any]:
    return run_cell({"run": RUN, "variants": {}, "room": room, **more}, 0)


def test_a_cell_gives_the_same_again_and_traces_a_room_once() -> None:
    first = cell(WITH_PANEL)
    before = find_setup.cache_info().misses
    second = cell(WITH_PANEL)
    assert find_setup.cache_info().misses == before
    assert first["schemes"] == second["schemes"]
    assert first["schemes"]["random"]["ran"] == "random"
    assert cell(WITHOUT)["schemes"]["random"]["ran"] == "no_ris"


def test_walls_heard_by_their_own_returns_count_for_an_estimator_that_uses_them() -> None:
    """Whatever `slam.use_vt` is; what counts is heard for 2 s, 20 of 22 cycles."""
    heard = []
    for planes in (False, True):
        run = RUN | {"cycles": 22, "schemes": ["bp_slam"], "bp_slam": {"planes": planes}}
        heard.append(run_cell({"run": run, "variants": {}, "room": WITHOUT}, 0)["schemes"]["bp_slam"]["walls_heard"])
    assert heard == [1, 4]


def test_a_recording_is_read_back_and_replayed_to_the_bit(tmp_path: Path) -> None:
    scores = cell(WITH_PANEL, save="components", data=str(tmp_path))["schemes"]["random"]
    folder = tmp_path / f"room_{WITH_PANEL:05d}"
    recording = read_recording(folder / "13dB_random.nc")
    assert dict(recording.scores) == scores
    answers = replay(recording.inputs, recording.config, recording.scheme, rng=np.random.default_rng(0))
    again = score_run(recording.truth, recording.inputs, answers)
    assert {name: again[name] for name in again} == {name: scores[name] for name in again}
    # another setting is another estimator
    other = replay(recording.inputs, recording.config, "random", {"slam.sigma_a": 0.5}, rng=np.random.default_rng(0))
    assert score_run(recording.truth, recording.inputs, other)["rmse_m"] != scores["rmse_m"]
    for wrong in ({"slam.bogus": 1}, {"slam.sigma_a": "much"}):
        with pytest.raises(ConfigError, match=rf"^settings of the replay: {next(iter(wrong))}: ") as found:
            replay(recording.inputs, recording.config, "random", wrong, rng=np.random.default_rng(0))
        assert len(str(found.value).splitlines()) == 1
    # the room beside it is a scene like any other, with the motion of the run
    assert np.allclose(load_scene(folder / "scene").agent.position, recording.truth.position, atol=1e-6)


def test_plain_arrays_are_scored_like_an_estimator(tmp_path: Path) -> None:
    cell(WITHOUT, save="components", data=str(tmp_path))
    recording = read_recording(tmp_path / f"room_{WITHOUT:05d}" / "13dB_no_ris.nc")
    inputs, truth = recording.inputs, recording.truth
    told = inputs.start.position + np.outer(inputs.time, inputs.start.velocity)
    scores = score_run(truth, inputs, answers_from_arrays(inputs, told))
    assert scores["relative_rmse_m"] == pytest.approx(scores["dead_reckoning_m"])
    assert scores["births"] == 0
    assert scores["nees"] is None
    cycles = len(told)
    for name, wrong, said in (
        ("position", {"position": told[:2]}, f"shape (2, 3) received; give ({cycles}, 3), a row a cycle"),
        ("covariance", {"covariance": np.eye(3)}, f"shape (3, 3) received; give ({cycles}, 3, 3), a row a cycle"),
        ("lost", {"lost": np.array([True])}, f"shape (1,) received; give ({cycles},), a row a cycle"),
        ("landmark", {"landmark": []}, f"0 received; give {cycles}, one a cycle"),
        *(
            ("maps", {"maps": n * [empty_map()]}, f"{n} received; give {cycles}, one a cycle, or the last one alone")
            for n in (cycles + 1, cycles - 1)
        ),
    ):
        with pytest.raises(ConfigError) as found:
            answers_from_arrays(inputs, **({"position": told} | wrong))
        assert str(found.value) == f"{name}: {said}"
    slanted = replace(empty_map(), wall_normal=[[0.0, 0.0, 2.0]], wall_offset=[1.0], wall_std=[[0.1, 0.1]])
    for given, said in (
        ({"maps": empty_map()}, "maps: one MapEstimate received"),
        ({"maps": [slanted]}, f"cycle {cycles - 1}: map: wall_normal"),
        ({"maps": cycles * [None]}, "cycle 0: map: NoneType received"),
        ({"covariance": np.full((cycles, 3, 3), np.nan)}, "cycle 0: covariance: NaN at index (0, 0)"),
        ({"covariance": np.tile(-np.eye(3), (cycles, 1, 1))}, "cycle 0: a covariance with an eigenvalue of -1"),
        ({"landmark": cycles * [np.zeros(0)]}, "landmark: cycle 0: shape (0,) received"),
    ):
        with pytest.raises(ConfigError, match=f"^{re.escape(said)}"):
            answers_from_arrays(inputs, told, **given)
    with pytest.raises(ConfigError, match=r"^cycle 1: position: NaN at index \(2,\); give finite numbers"):
        answers_from_arrays(inputs, np.where(np.arange(told.size).reshape(told.shape) == 5, np.nan, told))
    with pytest.raises(ConfigError, match=f"2 estimates of {cycles} cycles"):
        score_run(truth, inputs, answers_from_arrays(inputs, told)._replace(estimates=2 * [None]))
    with pytest.raises(ConfigError, match=r"estimator: object received; give an Estimator, or .* 'module:Class'"):
        replay(inputs, recording.config, "no_ris", estimator=object(), rng=np.random.default_rng(0))


def test_what_is_no_recording_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "x.nc").write_bytes(b"no")
    with pytest.raises(StoreError, match="not a readable NetCDF file"):
        read_recording(tmp_path / "x.nc")
    with pytest.raises(StoreError, match="no such file"):
        read_recording(tmp_path / "y.nc")


def pipeline(folder: Path, *lines: str) -> Path:
    file = folder / "unseen.toml"
    file.write_text('kind = "unseen"\nname = "x"\n' + "\n".join(lines) + '\n[run]\nschemes = ["random"]\n')
    return file


def test_cells_of_a_room_follow_each_other(tmp_path: Path) -> None:
    spec = load_any(pipeline(tmp_path, "first = 3", "rooms = 3", "snr_db = [13.0, 0.0]"))
    assert isinstance(spec, UnseenSpec)
    cells = build_cells(build_unseen(spec, tmp_path / "unseen.toml", tmp_path))
    assert [c.point["room"] for c in cells] == [3, 3, 4, 4, 5, 5]
    assert len({c.ident for c in cells}) == 6


def test_more_rooms_and_levels_of_noise_are_added_to_those_that_ran(tmp_path: Path) -> None:
    def idents(*lines: str) -> set[str]:
        spec = load_any(pipeline(tmp_path, *lines))
        assert isinstance(spec, UnseenSpec)
        return {cell.ident for cell in build_cells(build_unseen(spec, tmp_path / "unseen.toml", tmp_path))}

    few, many = (
        idents("first = 3", "rooms = 2", "snr_db = [13.0]"),
        idents("first = 2", "rooms = 3", "snr_db = [0.0, 13.0]"),
    )
    assert (len(few), len(many)) == (2, 6)
    assert few < many


def test_agents_along_walls_are_other_cells_and_receivers_reckon_with_them(tmp_path: Path) -> None:
    cells = {}
    for name, lines in {"anyhow": (), "along_walls": ('ways = "along_walls"',)}.items():
        spec = load_any(pipeline(tmp_path, *lines, f"first = {WITHOUT}", "rooms = 1"))
        assert isinstance(spec, UnseenSpec)
        (cells[name],) = build_cells(build_unseen(spec, tmp_path / "unseen.toml", tmp_path))
    assert len({c.ident for c in cells.values()}) == 2
    assert len({c.depends["room_sha256"] for c in cells.values()}) == 2
    told = {name: c.depends["config"]["receiver"]["top_speed"] for name, c in cells.items()}
    assert told == {"anyhow": 0.5, "along_walls": WALL_TOP_SPEED}
    spec = load_any(tmp_path / "unseen.toml", ["run.receiver.top_speed=2.0"])
    assert isinstance(spec, UnseenSpec)
    (own,) = build_cells(build_unseen(spec, tmp_path / "unseen.toml", tmp_path))
    assert own.depends["config"]["receiver"]["top_speed"] == 2.0
    cell(WITHOUT, save="components", data=str(tmp_path), ways="along_walls")
    recording = read_recording(tmp_path / f"room_{WITHOUT:05d}_along_walls" / "13dB_no_ris.nc")
    assert recording.traits["ways"] == "along_walls"
    fast = [np.linalg.norm(draw_room(seed, "along_walls").scene.agent.velocity, axis=1).max() for seed in range(10)]
    assert 0.5 < max(fast) < WALL_TOP_SPEED


def test_rooms_for_development_and_for_tests_do_not_mix(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="both sides of 10000"):
        load_any(pipeline(tmp_path, "first = 9_999", "rooms = 2"))


def test_every_run_of_test_rooms_is_counted_once(tmp_path: Path) -> None:
    file = pipeline(tmp_path)
    for rooms, counted in ((2, 1), (2, 1), (3, 2)):
        spec = load_any(file, ["first=10000", f"rooms={rooms}"])
        assert isinstance(spec, UnseenSpec)
        assert count_tests(spec, file) == counted
    dev = load_any(file, ["rooms=2"])
    assert isinstance(dev, UnseenSpec)
    assert count_tests(dev, file) == 2
