"""Scores of landmarks and walls against hand-made maps."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.walls import build_walls
from rislam_rt.cli.run import show_scores
from rislam_rt.information import WallSpread
from rislam_rt.model import MapEstimate
from rislam_rt.pipeline.scores.posterior_bound import SchemeBound
from rislam_rt.pipeline.scores.summary import landmark_track, over_budget, summarise
from rislam_rt.pipeline.scores.wall_scores import count_ghosts, found_of_heard, wall_scores
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.toml import put_dotted


def map_of_walls(normal, offset):
    count = len(offset)
    return MapEstimate(
        np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0), np.zeros(0), np.zeros(0),
        np.array(normal), np.array(offset), np.zeros((count, 2)),
    )  # fmt: skip


def test_shifted_and_tilted_walls_are_scored(room):
    tilt = np.radians(2.0)
    estimate = map_of_walls(
        [[-1.0, 0.0, 0.0], [np.sin(tilt), np.cos(tilt), 0.0]], [0.05, 6.0 * np.cos(tilt) + 3.0 * np.sin(tilt)]
    )
    scores = wall_scores(room, estimate)
    assert scores["wall_x0"]["rmse_m"] == pytest.approx(0.05)
    assert scores["wall_x0"]["angle_deg"] == pytest.approx(0.0, abs=1e-9)
    assert scores["wall_y6"]["angle_deg"] == pytest.approx(2.0)
    assert scores["wall_y6"]["offset_m"] == pytest.approx(0.0, abs=1e-12)
    # a plane tilted by a about the middle of a wall of width 6: rms of sin(a) u over u in [-3, 3]
    assert scores["wall_y6"]["rmse_m"] == pytest.approx(np.sin(tilt) * 3.0 / np.sqrt(3.0))
    assert scores["floor"]["rmse_m"] is None


def test_walls_in_one_plane_are_one(room):
    """The wall at x = 0 as two: one plane stands for both, and the second of two planes is still a ghost."""
    number = next(n for n, r in enumerate(room.reflectors) if r.name == "wall_x0")
    whole = room.reflectors[number]
    halves = [replace(whole, name=f"half_{k}", faces=whole.faces[k : k + 1]) for k in (0, 1)]
    split = replace(room, reflectors=(*room.reflectors[:number], *halves, *room.reflectors[number + 1 :]))
    estimate = map_of_walls([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [0.01, 0.3])
    scores = wall_scores(split, estimate)
    assert scores["half_0"]["offset_m"] == pytest.approx(0.01)
    assert scores["half_1"]["offset_m"] == pytest.approx(0.01)
    assert count_ghosts(split, estimate) == 1


def test_a_plane_stands_for_no_wall_that_no_path_meets(room):
    """The same plane, with and without a bound for the wall that it lies in."""
    estimate = map_of_walls([[1.0, 0.0, 0.0]], [0.01])
    heard = SchemeBound(np.zeros(1), np.zeros(1), {}, {"wall_x0": WallSpread(np.radians(0.5), 0.02)})
    scores = wall_scores(room, estimate, heard)["wall_x0"]
    assert (scores["offset_m"], scores["bound_m"]) == (pytest.approx(0.01), 0.02)
    assert scores["bound_deg"] == pytest.approx(0.5)
    elsewhere = heard._replace(walls={"ceiling": heard.walls["wall_x0"]})
    scores = wall_scores(room, estimate, elsewhere)
    assert all(wall["angle_deg"] is None for wall in scores.values())
    assert scores["ceiling"]["bound_m"] == 0.02
    assert scores["wall_x0"]["bound_m"] is None


def test_images_never_stand_for_landmarks(room, short_result):
    scheme = short_result.schemes["random"]
    cycles = len(scheme.position)
    position = np.tile(room.landmark_positions[0], (cycles, 2, 1)) + np.array([[0.1, 0.0, 0.0], [0.0, 0.0, 0.0]])
    held = replace(
        scheme, ident=np.array([4, 9]), parent=np.array([-1, 4]), held=np.ones((cycles, 2), dtype=bool),
        landmark_position=position, ris_probability=np.zeros((cycles, 2)),
    )  # fmt: skip
    track = landmark_track(room, held)
    assert (track.column[:, 0] == 0).all()
    np.testing.assert_allclose(track.error[:, 0], 0.1)
    assert (track.column[:, 1] == -1).all()


def test_a_panel_that_is_not_there_is_matched_with_nothing(room, short_result):
    """Without a panel a plain wall hangs in its place: a point of the map near it is a false one, not the panel."""
    scheme = short_result.schemes["optimized"]
    place = np.tile(room.landmark_positions[-1] + 0.3, (len(scheme.position), 1, 1))
    one = {"ident": [0], "parent": [-1], "held": np.ones(place.shape[:2], bool), "landmark_position": place,
           "ris_probability": np.zeros(place.shape[:2])}  # fmt: skip
    there = replace(scheme, **one)
    assert (landmark_track(room, there).column[:, -1] == 0).all()
    away = replace(there, levels=0, sent=there.sent[:, :0, :0], applied=there.applied[:, :0, :0])
    track = landmark_track(room, away)
    assert track.error.shape == (len(place), len(room.landmarks))
    assert (track.column == -1).all()


def test_summary_is_plain_and_complete(short_result):
    import json

    summary = summarise(short_result)
    json.dumps(summary, allow_nan=False)
    for scheme in summary["schemes"].values():
        assert set(scheme["landmarks"]) == {"sphere", "ris"}
        assert len(scheme["walls"]) == 6
        assert found_of_heard(scheme["walls"]) == f"{scheme['walls_found']} of {scheme['walls_heard']}"
        assert scheme["rmse_m"] > 0.0
        assert scheme["diverged"] is False


def test_the_relative_error_is_without_that_of_the_start(short_result):
    """The whole way told 3 cm to the side: the relative error is what it was. Not known where the start is not."""
    shift, scheme = np.array([0.03, 0.0, 0.0]), short_result.schemes["random"]
    moved = replace(scheme, position=scheme.position + shift, start_position=scheme.start_position + shift)
    told = moved.start_position - short_result.scene.agent.position[0]
    expected = np.linalg.norm(moved.position - short_result.scene.agent.position - told, axis=1)
    summary = {}
    for name, one in (("here", scheme), ("there", moved), ("unknown", replace(scheme, start_position=None))):
        summary[name] = summarise(replace(short_result, schemes={"random": one}))["schemes"]["random"]
    assert summary["there"]["relative_rmse_m"] == pytest.approx(np.sqrt(np.mean(expected**2)))
    assert summary["there"]["relative_rmse_m"] == pytest.approx(summary["here"]["relative_rmse_m"])
    assert summary["unknown"]["relative_rmse_m"] is None


def test_steps_over_budget_are_named():
    seconds = {"optimise": 0.2, "communicate": 0.0, "measure": 0.01, "localise": 0.02}
    budget = {"optimise_s": 0.1, "communicate_s": 0.1, "measure_s": 0.1, "localise_s": 0.01}
    assert over_budget(seconds, budget) == ["optimise", "localise"]


def test_a_run_whose_start_is_told_wrong_is_lost_and_says_so(run_short):
    """A hundred times the start's deviations: a metre and a metre a second. The same start told right is neither."""
    settings = ("cycles=10", "depth=1", 'schemes=["no_ris"]')
    wrong, right = (
        summarise(run_short(*settings, f"told.start_scale={scale}"))["schemes"]["no_ris"] for scale in (100.0, 1.0)
    )
    assert wrong["diverged"] is True
    assert right["diverged"] is False
    assert wrong["outcomes"].get("diverged", 0) >= 1  # by the filter's own word, which knows no truth
    assert "diverged" not in right["outcomes"]
    assert (wrong["lost"]["times"], wrong["lost"]["causes"]) == (1, {"start": 1})
    assert 0.0 < wrong["lost"]["first_s"] < 1.0
    assert right["lost"] == {"times": 0, "first_s": None, "causes": {}}
    assert sum(wrong["outcomes"].values()) == 10


def test_a_bound_is_wider_for_an_agent_that_may_be_livelier(short_result):
    """The same run held against other settings: hardly heard, it is known as well as its motion is."""

    def scores(sigma):
        config = dict(short_result.config)
        config["slam"] = {**config["slam"], "sigma_a": sigma}
        config["radio"] = {**config["radio"], "reference_snr_db": -40.0}
        return summarise(replace(short_result, config=config))["schemes"]["random"]

    calm, lively, wild = (scores(sigma) for sigma in (0.01, 0.1, 1.0))
    assert calm["bound_m"] < 0.95 * lively["bound_m"] < 0.5 * wild["bound_m"]
    assert calm["over_bound"] > lively["over_bound"] > wild["over_bound"]


@pytest.mark.parametrize("cycles", [slice(3, 4), slice(-1, None), slice(None)])
def test_a_run_is_lost_whose_error_was_large_in_any_cycle(short_result, cycles, capsys):
    """Half a metre is the limit. The summary says so among its warnings, which are what the terminal shows."""
    scheme = short_result.schemes["random"]
    for far, lost in ((0.4, False), (0.7, True)):
        position = scheme.position.copy()
        position[cycles, 0] = short_result.scene.agent.position[cycles, 0] + far
        astray = replace(short_result, schemes={"random": replace(scheme, position=position)})
        summary = summarise(astray)
        assert summary["schemes"]["random"]["diverged"] is lost
        assert [line.startswith("random: diverged without noticing") for line in summary["warnings"]] == [True] * lost
        show_scores(summary)
        assert capsys.readouterr().err == "".join(f"warning: {line}\n" for line in summary["warnings"])


@pytest.mark.parametrize(("name", "use_vt"), [("random", True), ("bp_slam", True), ("bp_slam", False)])
def test_a_wall_is_audible_as_long_as_a_path_over_it_that_the_scheme_uses_is_above_the_threshold(
    room, short_result, name, use_vt
):
    short_result = replace(short_result, config=put_dotted(dict(short_result.config), "bp_slam.planes", use_vt))
    paths, scheme = short_result.paths, replace(short_result.schemes["random"], scheme=name)
    settings = build_settings(PipelineSpec.model_validate(dict(short_result.config)))
    names, heard = build_walls(room).names, {}
    for path in range(paths.num_paths):
        loud = settings.radio.integrated_snr(scheme.gain[:, path]) >= settings.sensor.threshold
        loud &= paths.valid[:, path] & (paths.arrival[:, path, 2] >= 0.0)
        _, landmark, tx, rx = paths.identity(path)
        if landmark >= 0 or use_vt:
            for wall in {*tx, *rx}:
                heard[names[wall]] = heard.get(names[wall], False) | loud
    step = float(np.median(np.diff(short_result.scene.agent.time)))
    walls = summarise(replace(short_result, schemes={name: scheme}))["schemes"][name]["walls"]
    assert heard
    for wall in names:
        assert walls[wall]["audible_s"] == pytest.approx(step * np.sum(heard.get(wall, False)))
