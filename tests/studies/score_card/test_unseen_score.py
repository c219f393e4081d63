"""The score card on results made by hand, whose scores are known."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest

from rislam_rt.model import Body, MapEstimate, Measurement, PathKind, RisSpec, SlamEstimate, empty_map
from rislam_rt.pipeline.recordings.replay import Answers, Inputs, answers_from_arrays
from rislam_rt.pipeline.scores.true_loss import lost_scores
from rislam_rt.slam import StartPrior
from rislam_rt.studies.score_card.score import OVER_TIME, score_run
from rislam_rt.studies.score_card.truth import Truth

K = 150
TIME = 0.1 * np.arange(K)
TOLD = np.array([0.012, -0.009, 0.0])
WALLS = np.array([[5.0, 0.0, 1.5], [0.0, 4.0, 1.5]])
NORMALS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
POINTS = np.array([[2.0, 2.0, 2.0], [3.0, 1.0, 3.0]])
KINDS = np.array([PathKind.PS, PathKind.VS, PathKind.RIS, PathKind.VT])


class Info(NamedTuple):
    landmark: Any
    outcome: str = "ok"


def truth() -> Truth:
    position = 1.0 + np.outer(TIME, [0.1, 0.05, 0.0])
    spread = np.array([np.diag([0.0, 1.3, 0.75]), np.diag([2.1, 0.0, 0.75])])
    audible = np.ones((K, 2), dtype=np.bool_)
    audible[:20] = False
    parts = np.tile([0, 2, 1, -1], (K, 1))
    return Truth(
        position, np.tile([0.1, 0.05, 0.0], (K, 1)), POINTS, True, audible, WALLS, NORMALS, spread, audible.copy(),
        KINDS, np.array([0, 0, 1, -1]), parts, np.full(K, 0.02), np.full(K, 0.001),
    )  # fmt: skip


def panel() -> RisSpec:
    return RisSpec(4, 4, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))


def inputs() -> Inputs:
    none = np.zeros(0)
    nothing = Measurement(none, np.zeros((0, 2)), none, none, np.zeros((0, 2)), none)
    start = StartPrior(truth().position[0] + TOLD, np.array([0.1, 0.06, 0.0]), 0.0)
    return Inputs(start, Body(), panel(), TIME, np.zeros(K), K * (nothing,), K * (None,))


def whole_map(shift: Any = TOLD) -> MapEstimate:
    """Both landmarks, the second as the panel, an image, and both walls, one of them turned round."""
    normal = NORMALS * [[1.0], [-1.0]]
    offset = np.einsum("wi,wi->w", normal, WALLS + shift)
    position = np.concatenate([POINTS, [[8.0, 2.0, 2.0]]]) + shift
    return MapEstimate(
        np.array([4, 7, 9]), position, np.tile(1e-6 * np.eye(3), (3, 1, 1)), np.array([-1, -1, 0]),
        np.array([0.0, 0.9, 0.0]), np.ones(3), normal, offset, np.full((2, 2), 1e-3),
    )  # fmt: skip


def answers(error: Any = TOLD, found: MapEstimate | None = None, from_cycle: int = 30, std: float = 0.01) -> Answers:
    covariance = np.diag([std**2, std**2, 0.0, 1e-4, 1e-4, 0.0])
    position = truth().position + error
    estimates = [
        SlamEstimate(
            position[k], np.zeros(3), 0.0, covariance, np.zeros((0, 3)), Body(),
            (found or whole_map()) if k >= from_cycle else empty_map(),
        )
        for k in range(K)
    ]  # fmt: skip
    infos = [Info(np.array([4, 7, 9, -1]) if k >= from_cycle else np.full(4, -1)) for k in range(K)]
    return Answers(tuple(estimates), tuple(infos), 0.001)


def test_a_perfect_run_has_the_starts_error_alone() -> None:
    scores = score_run(truth(), inputs(), answers())
    assert scores["rmse_m"] == pytest.approx(np.linalg.norm(TOLD))
    assert scores["relative_rmse_m"] < 1e-12
    assert scores["ratio"] == pytest.approx(np.linalg.norm(TOLD) / 0.02)
    assert scores["nees"] == pytest.approx(np.sum(TOLD**2) / 0.01**2 / 2.0)
    assert scores["horizontal_nees"] == pytest.approx(scores["nees"])
    assert not scores["lost"]
    assert not scores["silent"]
    assert scores["walls_heard"] == scores["walls_found"] == scores["walls_good"] == 2
    assert scores["points_heard"] == scores["points_found"] == 2
    assert scores["panel_found"]
    assert scores["ghost_walls"] == scores["ghost_points"] == 0
    assert scores["gospa_m"] < 1e-12
    # audible from cycle 20 on, in the map from cycle 30 on
    for name in ("wall_delay_s", "point_delay_s", "panel_delay_s"):
        assert scores[name] == pytest.approx(1.0)
    # told 0.01 m/s too much along y: the error grows evenly with time
    assert scores["dead_reckoning_m"] == pytest.approx(0.01 * np.sqrt(np.mean(TIME**2)))


def test_the_height_counts_in_the_nees_but_not_in_that_across() -> None:
    given, up = answers(), np.array([0.0, 0.0, 0.02])
    more = np.diag([0.0, 0.0, 0.01**2, 0.0, 0.0, 0.0])
    estimates = [
        replace(each, position=each.position + up, covariance=each.covariance + more) for each in given.estimates
    ]
    scores = score_run(truth(), inputs(), given._replace(estimates=tuple(estimates)))
    across = np.sum(TOLD**2) / 0.01**2
    assert scores["horizontal_nees"] == pytest.approx(across / 2.0)
    assert scores["nees"] == pytest.approx((across + 2.0**2) / 3.0)


def test_what_is_expected_over_the_starts_error_is_the_mean_over_its_draws() -> None:
    """4000 draws: the mean square of two numbers is within 2.5 % then, four deviations."""
    given, rng, draws = answers(), np.random.default_rng(3), 4000
    bent = np.column_stack([0.004 * np.sin(TIME), 0.002 * TIME, np.zeros(K)])
    spread = np.zeros((6, 6))
    spread[:2, :2] = [[1.2e-4, 3e-5], [3e-5, 1.6e-4]]
    drawn = np.sqrt(0.01**2 + 0.01**2 + 0.001**2)  # the start's error along x and y, and what the bound has besides
    known = truth()._replace(bound=np.full(K, drawn))
    moved = [
        replace(each, position=each.position + by, covariance=spread)
        for each, by in zip(given.estimates, bent, strict=True)
    ]
    found = score_run(known, inputs(), given._replace(estimates=tuple(moved)))
    start = 0.01 * rng.standard_normal((draws, 2))
    error = (bent[:, :2] + start[:, None]).reshape(-1, 2)
    assert found["expected_ratio"] == pytest.approx(np.sqrt(np.mean(np.sum(error**2, axis=1))) / drawn, rel=0.0125)
    inside = np.einsum("ki,ij,kj->k", error, np.linalg.inv(spread[:2, :2]), error)
    assert found["expected_nees"] == pytest.approx(np.mean(inside) / 2.0, rel=0.025)
    # the run's own draw tells of neither
    assert found["ratio"] != pytest.approx(found["expected_ratio"], rel=0.05)
    assert found["horizontal_nees"] != pytest.approx(found["expected_nees"], rel=0.05)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("across", [(0.0, 0.0), (1e-4, 0.0), (1e-300, 1e300), (1e200, 1e200)])
def test_what_cannot_be_expected_is_none(across: tuple[float, float]) -> None:
    """Without a bound, and by covariances that are none or beyond numbers."""
    given, sure = answers(), np.diag([*across, 1.0, 1.0, 1.0, 1.0])
    claimed = tuple(replace(each, covariance=sure) for each in given.estimates)
    nothing = truth()._replace(bound=np.zeros(K), relative_bound=np.zeros(K))
    scores = score_run(nothing, inputs(), given._replace(estimates=claimed))
    assert scores["expected_ratio"] is None
    assert scores["expected_nees"] is None or np.isfinite(scores["expected_nees"])


def test_relative_errors_and_what_is_late() -> None:
    error = TOLD + np.outer(np.where(TIME >= 10.0, 0.003, 0.0), [1.0, 0.0, 0.0])
    scores = score_run(truth(), inputs(), answers(error))
    assert scores["late_relative_rmse_m"] == pytest.approx(0.003)
    assert scores["late_relative_ratio"] == pytest.approx(3.0)
    assert scores["relative_rmse_m"] == pytest.approx(0.003 * np.sqrt(np.mean(TIME >= 10.0)))


def test_kinds_of_births() -> None:
    scores = score_run(truth(), inputs(), answers())
    assert (scores["births"], scores["births_judged"], scores["births_right"]) == (3, 3, 3)
    # what the filter holds for a point gets the components of an image, and the other way round
    crossed = answers()
    infos = [i._replace(landmark=np.array([9, 7, 4, -1])) if k >= 30 else i for k, i in enumerate(crossed.infos)]
    scores = score_run(truth(), inputs(), crossed._replace(infos=tuple(infos)))
    assert (scores["births"], scores["births_judged"], scores["births_right"]) == (3, 3, 1)


def test_walls_far_off_are_ghosts_and_those_a_little_off_are_found_but_not_well() -> None:
    found = whole_map()
    turned = np.array([np.cos(0.03), 0.0, np.sin(0.03)])
    normal = np.array([turned, [0.0, 0.0, 1.0]])
    offset = np.array([turned @ (WALLS[0] + TOLD), 9.0])
    scores = score_run(truth(), inputs(), answers(found=_with_walls(found, normal, offset)))
    assert (scores["walls_found"], scores["walls_good"], scores["ghost_walls"]) == (1, 0, 1)
    assert scores["wall_deg"] == pytest.approx(np.degrees(0.03))
    assert scores["wall_m"] < 1e-9


def test_a_landmark_that_is_nowhere_is_a_ghost() -> None:
    away = whole_map(TOLD + np.array([0.0, 0.0, 30.0]))
    scores = score_run(truth(), inputs(), answers(found=away))
    assert scores["points_found"] == 0
    assert scores["ghost_points"] == 2
    assert not scores["panel_found"]


def with_point(known: MapEstimate, place: Any, ris: Any) -> MapEstimate:
    """The map with a second landmark at a place, and other probabilities of being the panel."""
    return replace(
        known, ident=[*known.ident, 11], position=[*known.position, place], parent=[*known.parent, -1],
        covariance=np.tile(1e-6 * np.eye(3), (4, 1, 1)), ris_probability=ris, strength=np.ones(4),
    )  # fmt: skip


def test_the_panel_is_found_whatever_lies_beside_it() -> None:
    """Of two landmarks in one place, the one that is not held for the panel may be the nearer."""
    known = whole_map()
    known = replace(known, position=known.position + np.outer([0.0, 0.004, 0.0], [1.0, 0.0, 0.0]))
    both = with_point(known, POINTS[1] + TOLD, [0.0, 0.9, 0.0, 0.01])
    scores = score_run(truth(), inputs(), answers(found=both))
    assert scores["panel_found"]
    assert scores["panel_delay_s"] == pytest.approx(1.0)
    assert (scores["points_found"], scores["ghost_points"]) == (2, 1)
    # the landmark at the panel's place is not held for the panel, another far off is
    other = with_point(whole_map(), [9.0, 9.0, 1.0], [0.0, 0.4, 0.0, 0.9])
    scores = score_run(truth(), inputs(), answers(found=other))
    assert (scores["panel_heard"], scores["panel_found"], scores["panel_delay_s"]) == (True, False, None)


def test_a_panel_that_is_lost_again_is_not_found_and_has_no_delay() -> None:
    given, without = answers(), replace(whole_map(), ris_probability=np.zeros(3))
    estimates = (*given.estimates[:-1], replace(given.estimates[-1], map=without))
    scores = score_run(truth(), inputs(), given._replace(estimates=estimates))
    assert (scores["panel_found"], scores["panel_delay_s"]) == (False, None)
    assert scores["points_found"] == 2


def test_of_several_panels_all_have_to_be_found() -> None:
    true, both = truth()._replace(panel=2), replace(whole_map(), ris_probability=np.array([0.9, 0.8, 0.0]))
    for number, found in (([0, 1, 0], True), ([0, 0, 0], False), ([1, 0, 0], False)):
        scores = score_run(true, inputs(), answers(found=replace(both, panel=np.array(number))))
        assert (scores["panel_heard"], scores["panel_found"]) == (True, found)
    assert score_run(true, inputs()._replace(panel=None), answers())["points_heard"] == 0


def test_the_last_map_alone_is_scored_alike_and_tells_nothing_of_the_time_before() -> None:
    whole = answers(found=with_point(whole_map(), POINTS[1] + TOLD, [0.0, 0.9, 0.0, 0.01]))
    given = inputs()._replace(
        measurements=K * (Measurement(*(np.ones((4, *n)) for n in ((), (2,), (), (), (2,), ()))),)
    )
    position, covariance = (
        np.array([getattr(each, name) for each in whole.estimates]) for name in ("position", "covariance")
    )
    arrays = position, covariance[:, :3, :3]
    taken = [info.landmark for info in whole.infos]
    last = score_run(truth(), given, answers_from_arrays(given, *arrays, [whole.estimates[-1].map], landmark=taken))
    maps = [each.map for each in whole.estimates]
    every = score_run(truth(), given, answers_from_arrays(given, *arrays, maps, landmark=taken))
    assert every == score_run(truth(), given, whole)
    assert {name: last[name] for name in OVER_TIME} == dict.fromkeys(OVER_TIME)
    assert not [name for name in OVER_TIME if every[name] is None]
    assert {name: last[name] for name in last.keys() - OVER_TIME} == {n: every[n] for n in every.keys() - OVER_TIME}
    assert last["panel_found"]


def test_without_a_panel_there_is_none_to_find() -> None:
    scores = score_run(truth(), inputs()._replace(panel=None), answers())
    assert scores["points_heard"] == 1
    assert (scores["panel_heard"], scores["panel_found"], scores["panel_delay_s"]) == (None, None, None)
    assert scores["ghost_points"] == 1


@pytest.mark.parametrize(("cycles", "lost"), [(9, False), (10, True)])
def test_lost_is_far_off_for_a_second(cycles: int, lost: bool) -> None:
    error = np.zeros(K)
    error[50 : 50 + cycles] = 0.11
    scores = lost_scores(error, np.full(K, 0.01), np.full(K, 0.01), TIME, K * ["ok"])
    assert scores["lost"] is lost
    assert scores["silent"] is lost
    assert scores["lost_at_s"] == (pytest.approx(5.0) if lost else None)


def test_lost_asks_for_more_where_the_bound_is_large() -> None:
    assert not lost_scores(np.full(K, 0.4), np.full(K, 0.1), np.full(K, 0.1), TIME, K * ["ok"])["lost"]
    assert lost_scores(np.full(K, 0.6), np.full(K, 0.1), np.full(K, 0.1), TIME, K * ["ok"])["lost"]


def test_an_alarm_counts_from_the_loss_on() -> None:
    error = np.where(TIME >= 5.0, 1.0, 0.0)
    early, late = K * ["ok"], K * ["ok"]
    early[20], late[140] = "diverged", "diverged"
    assert lost_scores(error, np.full(K, 0.01), np.full(K, 0.01), TIME, early)["silent"]
    assert not lost_scores(error, np.full(K, 0.01), np.full(K, 0.01), TIME, late)["silent"]


def test_a_deviation_that_covers_the_error_says_so_too() -> None:
    error, bound, outcomes = np.where(TIME >= 5.0, 1.0, 0.0), np.full(K, 0.01), K * ["ok"]
    assert lost_scores(error, bound, np.full(K, 0.19), TIME, outcomes)["silent"]
    assert not lost_scores(error, bound, np.full(K, 0.21), TIME, outcomes)["silent"]
    assert lost_scores(error, bound, np.full(K, 0.21), TIME, outcomes)["lost"]


def _with_walls(found: MapEstimate, normal: Any, offset: Any) -> MapEstimate:
    return MapEstimate(
        found.ident, found.position, found.covariance, found.parent, found.ris_probability, found.strength, normal,
        offset, np.full((len(offset), 2), 1e-3),
    )  # fmt: skip
