"""What a track could be: prior densities, forms that put the same feature in the same place, returns that are taken."""

from types import SimpleNamespace

import numpy as np

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import NONE, TX
from rislam_rt.slam.window.births import births, track_classification
from rislam_rt.slam.window.hypotheses import hypothesis_evidence
from rislam_rt.slam.window.hypotheses.hypotheses import (
    BESIDE,
    KNOWN_WALL,
    OVER_RX,
    POINT,
    WALL,
    WALL_KNOWN,
    hypotheses,
    known_features,
)
from rislam_rt.slam.window.hypotheses.hypothesis_fits import Fits
from rislam_rt.slam.window.landmarks.horizon_detection import nothing_heard
from rislam_rt.slam.window.landmarks.landmark_table import empty_table, enter
from rislam_rt.slam.window.landmarks.landmark_update import VisibilityObservations, pack
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.landmarks.ris_identification import unknown
from rislam_rt.slam.window.measurement_log import empty_log


def _table(kind, pair=None):
    count = len(kind)
    walls = ~np.isin(kind, (POINT, OVER_RX))
    pair = np.zeros(count, dtype=bool) if pair is None else np.array(pair)
    return SimpleNamespace(
        kind=np.array(kind), trials=SimpleNamespace(is_wall=walls & ~pair, is_pair=pair, far=pair & False)
    )


def test_places_of_walls_and_points_have_densities_that_integrate_to_one():
    rng, middle = np.random.default_rng(5), np.array([3.0, -2.0, 1.0])
    for kind, radius in ((WALL, 2.0 * CONSTANTS.size), (POINT, CONSTANTS.size)):
        # shells, sampled evenly in distance: the density times the area of each
        reach = rng.uniform(0.0, radius, 20_000)
        way = rng.standard_normal((len(reach), 3))
        place = middle + reach[:, None] * way / np.linalg.norm(way, axis=1)[:, None]
        density = np.exp(hypothesis_evidence.log_place(_table([kind] * len(reach)), place, middle))
        share = radius * density * 4.0 * np.pi * reach**2
        # within the depth of a surface a wall is no likelier: two thirds of the share of that shell are missing
        missing = 2.0 / 3.0 * 2.0 * CONSTANTS.depth / radius if kind == WALL else 0.0
        assert abs(share.mean() - (1.0 - missing)) < 5.0 * np.std(share) / len(reach) ** 0.5


def test_a_wall_twice_as_far_is_as_likely_in_the_same_step_of_distance():
    far = np.array([[4.0, 0.0, 0.0], [8.0, 0.0, 0.0]])
    density = np.exp(hypothesis_evidence.log_place(_table([WALL, WALL]), far, np.zeros(3)))
    assert np.isclose(density[0] * 4.0**2, density[1] * 8.0**2)


def test_forms_that_put_the_wall_in_one_place_speak_for_it_together():
    place = np.array([[5.0, 0.0, 0.0], [5.01, 0.0, 0.02], [5.5, 0.0, 0.0], [5.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    spread = np.tile(0.03**2 * np.eye(3), (5, 1, 1))
    cost = np.array([1.0, 1.0, 1.0, 1.0, np.inf])
    fits = Fits(place, spread, spread, cost, np.zeros(5), np.zeros(5))
    table = _table([KNOWN_WALL, WALL_KNOWN, WALL, POINT, WALL])
    found = track_classification._alike(table, fits, np.arange(5), 0)
    # not itself, not half a metre off, not a point, not what could not be fitted
    assert found.tolist() == [False, True, False, False, False]
    pair = _table([WALL, WALL, WALL, WALL, WALL], [True, True, False, False, False])
    assert not track_classification._alike(pair, fits, np.arange(5), 0).any()


def test_two_components_at_a_time_are_not_the_same_return():
    form = np.array([TX, NONE, NONE, 3, NONE])
    log = empty_log()
    cycle, forms = np.repeat(np.arange(6), 2), np.full((12, 2, 5), UNKNOWN)
    forms[::2, 0] = form
    log = log._replace(cycle=cycle, form=forms)
    context = SimpleNamespace(log=log)
    assert births._taken(context, np.arange(1, 12, 2), form)
    assert not births._taken(context, np.arange(1, 12, 2), np.array([TX, NONE, NONE, 4, NONE]))
    log.form[4:, 0] = UNKNOWN  # only in two of six cycles
    assert not births._taken(context, np.arange(1, 12, 2), form)


def test_tracks_of_one_cycle_do_not_come_by_one_way_and_speak_for_each_other_by_two():
    place, spread = np.array([[2.0, 1.0, 1.0], [2.02, 1.0, 1.0]]), np.tile(0.05**2 * np.eye(3), (2, 1, 1))
    fits = Fits(place, spread, spread, np.ones(2), np.zeros(2), np.zeros(2))
    evidence, none, apart = np.zeros(2), np.full(2, -5.0), ~np.eye(2, dtype=bool)

    def gain(kinds, walls, concurrent):
        table = _table(kinds)
        table.trials.track, table.known, table.over = np.arange(2), np.array(walls), np.full(2, NONE)
        return hypothesis_evidence.log_shared(table, fits, evidence, none, [], np.zeros(3), concurrent)

    one_after_the_other = gain([POINT, POINT], [NONE, NONE], apart & False)
    assert (one_after_the_other > 1.0).all()
    assert (gain([POINT, POINT], [NONE, NONE], apart) == 0.0).all()
    np.testing.assert_array_equal(gain([POINT, OVER_RX], [NONE, 4], apart), one_after_the_other)
    assert (gain([OVER_RX, OVER_RX], [4, 4], apart) == 0.0).all()
    assert (gain([OVER_RX, OVER_RX], [4, 5], apart) > 1.0).all()


def test_tracks_are_concurrent_that_were_heard_in_one_cycle():
    context = SimpleNamespace(log=empty_log()._replace(cycle=np.array([1, 2, 2, 3, 5, 5])))
    found = hypothesis_evidence.concurrent(context, [np.array([0, 1]), np.array([2, 3]), np.array([4])])
    assert found.tolist() == [[True, True, False], [True, True, False], [False, False, True]]


def test_a_wall_comes_out_with_its_edge_only_where_the_level_wall_is_heard():
    middle = np.array([1.0, 1.0, 1.0])
    landmarks = enter(empty_table(1), True, middle, 10, 5.0, unknown(1, 1))
    ceiling = np.array([[1.0, 1.0, 4.0]])  # the agent's image in it: 1.5 m above, 0.1 m longer beside a wall 20 m away
    known = known_features(ceiling, 1e-6 * np.eye(3), landmarks, middle)
    form = np.array([[TX, NONE, NONE, 0, NONE]])
    table = SimpleNamespace(
        kind=np.array([WALL, BESIDE]), known=np.array([-1, 0]), trials=SimpleNamespace(track=np.zeros(2, dtype=int))
    )
    summary = SimpleNamespace(mean=(np.array([[40.0, 1.0, 0.0]]), None, None), middle=middle)
    scene = SimpleNamespace(sensor=SimpleNamespace(cell_length=np.array([0.75])))
    found = {}
    for clear in (1.0, 0.0):
        looked = VisibilityObservations(pack(form, landmarks), np.array([clear]), np.ones(1), nothing_heard(1))
        context = SimpleNamespace(landmarks=landmarks, scene=scene, visibility=looked)
        found[clear] = hypothesis_evidence.log_beside(table, summary, known, context)
    # heard a moment ago, the ceiling throws an edge too; never heard from here, it throws none
    assert found[1.0][1] > found[1.0][0] + 2.0
    assert found[0.0][0] > found[0.0][1] + 2.0
    # by itself, or as one with its edge wherever that is not hidden
    clear = 1.0 - CONSTANTS.rare
    assert np.allclose(np.exp(found[1.0]), [1.0 - CONSTANTS.shown * clear, clear])


def test_a_wall_that_is_heard_hides_what_is_behind_it_and_one_that_is_not_may_have_ended():
    middle = np.array([1.0, 1.0, 1.0])
    landmarks = enter(empty_table(1), True, middle, 10, 5.0, unknown(1, 1))
    known = known_features(np.array([[5.0, 1.0, 1.0]]), 1e-6 * np.eye(3), landmarks, middle)  # 2 m ahead
    place = middle + np.array([[6.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    kind = np.array([WALL, WALL, POINT, POINT])  # walls 3 and 1.5 m ahead, points 3 and 1 m
    trials = SimpleNamespace(
        is_wall=kind == WALL,
        is_pair=np.zeros(4, dtype=bool),
        track=np.zeros(4, dtype=int),
        turn=np.tile(np.eye(3), (4, 2, 1, 1)),
    )
    table = SimpleNamespace(kind=kind, known=np.full(4, -1), trials=trials)
    fits = SimpleNamespace(place=place, held=np.tile(1e-6 * np.eye(3), (4, 1, 1)))
    summary = SimpleNamespace(middle=middle, mean=(np.ones((1, 3)), middle[None], middle[None]))
    found = {}
    for clear in (1.0, 0.0):
        form = np.array([[TX, NONE, NONE, 0, NONE]])
        looked = VisibilityObservations(pack(form, landmarks), np.array([clear]), np.ones(1), nothing_heard(1))
        context = SimpleNamespace(landmarks=landmarks, scene=SimpleNamespace(use_vt=True), visibility=looked)
        found[clear], before = hypothesis_evidence.log_opacity(table, fits, summary, known, context)
        np.testing.assert_allclose(before, [0.0, CONSTANTS.log_rare, 0.0, 0.0])  # it would hide the known one
    hides = np.array([1.0, 0.0, 1.0, 0.0])
    # heard a cycle ago it is there but for a rare event, and so is what lets it be heard through; hidden it is cleared
    there = (1.0 - CONSTANTS.rare) * np.array([1.0 - CONSTANTS.rare, CONSTANTS.cleared])
    np.testing.assert_allclose(found[1.0], hides * np.log(1.0 - there[0]), atol=1e-12)
    np.testing.assert_allclose(found[0.0], hides * np.log(1.0 - there[1]), atol=1e-12)


def test_a_small_wall_may_stand_before_all_that_is_known_and_never_be_heard_itself():
    table = _table([WALL, WALL, WALL, POINT])
    wide = np.array([0.0, -1.0, -100.0, -100.0])
    found = hypothesis_evidence.log_wide_or_small(table, wide)
    odds = (1.0 - CONSTANTS.rare) * np.exp(wide[:3]) + CONSTANTS.rare
    np.testing.assert_allclose(np.exp(found[:3]), odds, rtol=1e-12)
    assert found[3] == -100.0  # a point is never wide


def test_a_ceiling_beside_an_upright_wall_starts_out_level_and_a_far_wall_upright():
    middle = np.array([1.0, 1.0, 1.0])
    landmarks = enter(empty_table(1), True, middle, 10, 5.0, unknown(1, 1))
    known = known_features(np.array([[3.0, 1.0, 1.0]]), 1e-6 * np.eye(3), landmarks, middle)
    edge = np.array([0.6, 0.0, 6.0])  # a ceiling's return, pulled towards its edge with that wall
    seen = np.array([np.append(np.linalg.norm(edge), edge[:2] / np.linalg.norm(edge)), [20.0, 0.0, 0.98]])
    ray = np.column_stack([seen[:, 1:], np.sqrt(1.0 - (seen[:, 1:] ** 2).sum(axis=1))])
    both = np.tile(middle, (2, 1))
    summary = SimpleNamespace(mean=(seen, both, both), direction=ray, seen=np.zeros((2, 8, 3)), middle=middle)
    table = hypotheses(summary, known, landmarks)
    start = table.trials.start[table.kind == BESIDE] - middle
    np.testing.assert_allclose(start[0], [0.0, 0.0, 6.0], atol=1e-9)
    assert abs(start[1, 2]) < 1e-9


def test_without_wall_returns_a_path_of_no_kind_is_as_frequent_as_a_point_and_with_them_rarer_by_two_walls():
    rng, count = np.random.default_rng(5), 200_000
    length, radius = 2.0 * CONSTANTS.size * rng.random(count), np.sqrt(0.99 * rng.random(count))
    angle = 2.0 * np.pi * rng.random(count)
    seen = np.column_stack([length, radius * np.cos(angle), radius * np.sin(angle)])
    domain = 2.0 * CONSTANTS.size * 0.99 * np.pi
    share = {use_vt: domain * np.exp(track_classification.log_no_kind(seen, use_vt)) for use_vt in (False, True)}
    # a point is anywhere in the ball: of its upper half, seen at elevations whose sine is a tenth or more, nine tenths
    error = 4.0 * share[False].std() / np.sqrt(count)
    assert abs(share[False].mean() - 0.5 * 0.9) < error
    two_walls = np.exp(2.0 * CONSTANTS.wall_ratio) ** 2
    assert np.allclose(share[True] / share[False], two_walls)
