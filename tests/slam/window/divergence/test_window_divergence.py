"""Lost or not: the velocity that tracks agree on, and what a jump makes of the belief."""

from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.model import RadioConfig
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.window.births.track_classification import TrackDecision, is_clear
from rislam_rt.slam.window.divergence import divergence_monitor, recovery
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.landmarks.ris_identification import unknown
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.motion import egomotion, motion_agreement
from rislam_rt.slam.window.motion.length_rates import Heard, Rates, accelerations, lengths, rates
from rislam_rt.slam.window.smoother import motion, window_features, window_gaussian
from rislam_rt.slam.window.smoother.direction_priors import no_holds
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.smoother.rate_factor import RateFactor

TOLD, STD = np.array([0.3, 0.1, 0.0]), np.full(3, 0.01)


def _rates(velocity, rng, *, tracks=12, apart=4, error=0.01):
    """Tracks of which all but `apart` shorten as the agent nears them."""
    toward = rng.standard_normal((tracks, 3))
    toward *= -2.0 / np.linalg.norm(toward, axis=1)[:, None]
    rate = toward @ velocity + error * rng.standard_normal(tracks)
    rate[:apart] = rng.uniform(-2.0, 2.0, apart)
    return Rates(toward, rate, np.full(tracks, error**2), np.zeros(tracks), rate)


def _weigh_change(found, calm):
    """Even odds beforehand of a change of unit variance, rather than of a variance `calm`."""
    starts = egomotion.possible_changes(found, 0.0)
    return egomotion.weigh_change(found, starts, calm * np.eye(2), [np.eye(2)], 0.0)


def test_a_start_told_right_is_left_alone():
    """Posterior odds above 1 at prior odds of 1 in 100 come up in less than 1 of 100 runs (Markov's inequality)."""
    rng, wrong = np.random.default_rng(1), 0
    for _ in range(100):
        wrong += egomotion.weigh(_rates(TOLD + STD * [1, 1, 0] * rng.standard_normal(3), rng), TOLD, STD).log_odds > 0.0
    assert wrong <= 4  # 1 expected at most: 4 or fewer in 99.6 % of such samples


def test_a_speed_told_wrong_is_found_and_mended():
    rng = np.random.default_rng(2)
    for _ in range(10):
        angle = rng.uniform(-np.pi, np.pi)
        true = TOLD + 0.6 * np.array([np.cos(angle), np.sin(angle), 0.0])
        told = egomotion.weigh(_rates(true, rng), TOLD, STD)
        assert told.log_odds > 0.0
        # a component of each of 8 tracks: a third of their squares is along either axis, twice over
        assert np.linalg.norm(told.velocity - true) < 5.0 * 0.01 * np.sqrt(2.0 / (8 * 4 / 3))


def test_what_goes_to_and_fro_between_opposite_walls_speaks_against_no_start():
    """Two such tracks, from either side, keep their length: with one more stray they agree on another velocity."""
    toward = -2.0 * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [-0.3, -0.95, 0.0], [0.0, 0.0, 1.0], [0.5, 0.8, 0.33]])
    rate = toward @ TOLD
    rate[:2], rate[4] = 0.0, 1.0
    one = egomotion.weigh(Rates(toward, rate, np.full(5, 0.03**2), np.zeros(5), rate), TOLD, STD)
    assert one.log_odds < 0.0


def test_an_agent_that_stands_still_and_is_told_to_move_is_found():
    still = egomotion.weigh(_rates(np.zeros(3), np.random.default_rng(4), tracks=16), TOLD, STD)
    assert still.log_odds > 0.0
    assert np.linalg.norm(still.velocity) < 5.0 * 0.01


def test_a_turned_compass_is_told_from_a_wrong_speed():
    rng, turn = np.random.default_rng(3), 0.7
    cos, sin = np.cos(turn), np.sin(turn)
    shown = np.array([cos * TOLD[0] + sin * TOLD[1], cos * TOLD[1] - sin * TOLD[0], 0.0])
    told = egomotion.weigh(_rates(shown, rng), TOLD, STD)
    assert told.log_odds > 0.0
    assert told.is_compass
    assert told.turn == pytest.approx(turn, abs=5.0 * 0.01 / np.linalg.norm(TOLD))


def _bent(accel, rng, *, time=0.5):
    """Tracks of an agent that sets out as told, with an acceleration (3,) [m/s^2] from then on; what tells how the
    lengths bend errs as six measurements of 2 mm make it."""
    found, error = _rates(TOLD + 0.5 * time * accel, rng), 0.2
    bend = np.where(np.arange(len(found.rate)) < 4, 0.0, found.toward @ accel) + error * rng.standard_normal(12)
    return found._replace(bend=bend, bend_variance=np.full(12, error**2))


def test_who_sets_out_has_another_velocity_soon_and_was_told_right():
    """Lengths that bend as the rates say tell a manoeuvre from a start told wrong, whose lengths change evenly."""
    rng, time = np.random.default_rng(6), 0.5
    moved = egomotion.Manoeuvres(motion.first_motion_mode(0.01), motion.ladder(), time)
    for size in (0.15, 0.3, 0.6, 1.0):
        for angle in rng.uniform(-np.pi, np.pi, 6):
            accel = size * np.array([np.cos(angle), np.sin(angle), 0.0])
            found = _bent(accel, rng)
            assert egomotion.weigh(found, TOLD, STD, moved).log_odds < 0.0
            even = found._replace(bend=0.2 * rng.standard_normal(12))
            if size >= 0.6:
                assert egomotion.weigh(found, TOLD, STD).log_odds > 0.0
                assert egomotion.weigh(even, TOLD, STD, moved).log_odds > 0.0


@pytest.mark.parametrize("heading", [0.0, 0.4])
@pytest.mark.parametrize("bend", [0.0, 1.0])
def test_rates_are_those_of_walls_points_and_square_corners(heading, bend):
    """Lengths of a point, a wall's image and a corner's, as an agent without a baseline hears them: of an agent that
    accelerates by `bend` as well, where they are those of its mean velocity."""
    step, count = 0.1, 8
    time = step * np.arange(count)[:, None]
    place = np.array([0.2, -0.1, 0.0]) * time + 0.5 * bend * np.array([0.3, 1.0, 0.0]) * time**2
    found = rates(lengths(Heard(_log(place, heading), np.full(count, heading), place, step, np.zeros(3), 0.5)))
    assert len(found.rate) == 3
    velocity = (place[-1] - place[0]) / (step * (count - 1))
    # the direction of a point turns a little on the way: (0.2 m / 3 m)^2 of a velocity of 0.2 m/s
    np.testing.assert_allclose(found.rate, found.toward @ velocity, atol=2e-3 * (1.0 + 2.0 * bend))
    # and its rate bends by (0.2 m/s)^2 / 2 m, or as foreseen
    wanted = found.toward @ (bend * np.array([0.3, 1.0, 0.0]))
    assert (np.abs(found.bend - wanted) < 0.05 * (1.0 + bend)).all()
    # the highest power of time in eight lengths of 1 mm, each counted for `crowd`
    column = np.vander(step * np.arange(count), 3)
    spread = 4.0 * CONSTANTS.crowd * 1e-6 * np.linalg.inv(column.T @ column)[0, 0]
    assert (found.bend_variance > spread * (1.0 - 1e-9)).all()
    assert found.bend_variance[0] == pytest.approx(spread, abs=(4.0 * velocity @ velocity / 2.0) ** 2)


@pytest.mark.parametrize("steps", [5, 10])
def test_an_acceleration_that_the_positions_leave_out_is_told_by_all_lengths(steps):
    """Of who is held for standing still, and was until so many steps ago."""
    step, count, accel = 0.1, 12, np.array([0.6, -0.3, 0.0])
    time = step * np.maximum(np.arange(count) - (count - 1 - steps), 0.0)
    place = 0.5 * time[:, None] ** 2 * accel
    heard = Heard(_log(place, 0.2), np.full(count, 0.2), 0.0 * place, step, np.zeros(3), 0.5)
    found = accelerations(lengths(heard), steps)
    np.testing.assert_allclose(found.rate, found.toward @ accel, atol=0.06)  # a point turns on the way
    log_odds, told = _weigh_change(found, 1e-6)
    assert log_odds > 0.0
    np.testing.assert_allclose(told, accel[:2], atol=0.06)
    still = accelerations(lengths(heard._replace(place=place)), steps)
    assert _weigh_change(still, 1e-6)[0] < 0.0


def test_a_track_that_changes_paths_may_have_any_rate_and_one_that_keeps_to_its_path_next_to_none():
    """What a step between two paths leaves beside a line tells of it; what moves is rare besides."""
    step, count = 0.1, 12
    time = step * np.arange(count)
    rest, place = np.zeros((count, 3)), np.zeros((count, 3))
    place[:, 0] = 0.5 * time**2
    moves, still = (_log(each, 0.0) for each in (place, rest))
    hops = [
        still._replace(seen=still.seen + 0.3 * (still.cycle >= at)[:, None] * [1.0, 0.0, 0.0]) for at in range(2, 12)
    ]
    for steps in (3, 5, 10):
        for log in (still, *hops):  # wherever it changes paths
            found = accelerations(lengths(Heard(log, np.zeros(count), rest, step, np.zeros(3), 0.5)), steps)
            assert (found.astray >= 0.9 * CONSTANTS.rare).all()
    found = accelerations(lengths(Heard(moves, np.zeros(count), rest, step, np.zeros(3), 0.5)), 10)
    astray = np.sort(found.astray / CONSTANTS.rare)[:2]  # one path hears nothing of the way
    assert (astray <= 1e-9 + CONSTANTS.rare).all()


def test_a_climb_is_told_by_the_rates_of_all_lengths():
    """Two ways: Laplace's evidence at the likeliest climb, against the integral over all climbs."""
    rng = np.random.default_rng(5)
    for climb in (0.4, -0.9):
        found = _rates(np.array([0.0, 0.0, climb]), rng)._replace(believed=np.zeros(3))
        log_odds, told = egomotion.weigh_climb(found, 1e-8, 0.0)
        assert told == pytest.approx(climb, abs=4.0 * 0.01 / np.sqrt(np.sum(found.toward[4:, 2] ** 2)))
        every = np.linspace(-3.0, 3.0, 60001)[:, None]
        log_like = np.log(egomotion._likelihoods(found, np.zeros((1, 2)), every)[0]).sum(axis=1)
        prior = np.exp(-0.5 * every[:, 0] ** 2 / CONSTANTS.liveliest**2) / np.sqrt(2.0 * np.pi) / CONSTANTS.liveliest
        whole = np.log(np.sum(np.exp(log_like - log_like.max()) * prior) * 1e-4) + log_like.max()
        level = np.log(egomotion._likelihoods(found, np.zeros((1, 2)), 0.0)[0]).sum()
        assert log_odds == pytest.approx(whole - level, abs=0.3)  # other maxima, and what is no Gaussian
        assert log_odds > 5.0


def test_no_climb_is_told_by_the_rates_of_a_level_motion():
    """Posterior odds above 1 at prior odds of 1 in 10 come up in less than 1 of 10 runs (Markov's inequality)."""
    rng = np.random.default_rng(6)
    every = [_rates(np.zeros(3), rng)._replace(believed=np.zeros(3)) for _ in range(200)]
    wrong = sum(egomotion.weigh_climb(found, 1e-8, np.log(0.1))[0] > 0.0 for found in every)
    assert wrong < 20


def test_what_is_at_rest_changes_its_length_by_no_more_than_twice_the_agents_speed():
    """Two tracks of many agree on a motion; were the others' rates just any, two would be chance."""
    toward = -2.0 * np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 1.0, 0.0]])
    rate = np.array([-1.6, -0.96, 0.0])
    rest = Rates(toward, rate, np.full(3, 0.02**2), np.zeros(3), rate, believed=np.zeros(3))
    free = rest._replace(believed=None)
    bounded, any_rate = (_weigh_change(each, 1e-4)[0] for each in (rest, free))
    assert bounded > any_rate + 3.0


def _log(place, heading):
    """Measurements (3 tracks in each cycle) of a wall, a corner and a point from an agent's positions (K, 3)."""
    normal, corner, point = np.array([0.6, 0.8, 0.0]), np.array([-3.0, 2.0, 0.0]), np.array([1.0, 4.0, 1.5])
    away = [(2.0 - place @ normal)[:, None] * normal, corner - place, point - place]
    rows = []
    for track, ray in enumerate(away):
        length = 2.0 * np.linalg.norm(ray, axis=1)
        unit = 2.0 * ray / length[:, None]
        cosines = [np.cos(heading), np.sin(heading)] @ np.stack([unit[:, :2], unit[:, 1::-1] * [1, -1]], axis=1)
        rows += [(cycle, length[cycle], cosines[cycle], track) for cycle in range(len(place))]
    rows.sort(key=lambda row: row[0])
    number = len(rows)
    return Log(
        np.array([row[0] for row in rows]), np.array([[row[1], *row[2]] for row in rows]), np.full((number, 3), 1e-3),
        np.zeros(number), np.zeros(number), np.zeros(number, dtype=np.int64), np.array([row[3] for row in rows]),
        np.full((number, 2, 5), UNKNOWN), np.zeros(number), np.zeros((number, 3)), np.zeros((number, 3)),
    )  # fmt: skip


def test_a_body_that_turns_on_the_spot_is_not_held_for_one_that_moves():
    """Over two walls lengths change as Tx and Rx turn; unless that is foreseen, some agree on a velocity by chance."""
    rng, wrong = np.random.default_rng(5), np.zeros(2)
    for _ in range(60):
        found = _rates(np.zeros(3), rng, tracks=28, apart=0, error=0.005)
        found.rate[:24] += 0.05 * rng.standard_normal(24)
        every = (found, found._replace(turning=0.05))
        wrong += [egomotion.weigh(one, np.zeros(3), np.full(3, 5e-4)).log_odds > 0.0 for one in every]
    assert wrong[1] <= 3  # as of a start told right: 0.6 expected at most, 3 or fewer in 99.7 % of such samples
    assert wrong[0] > 30


@pytest.mark.parametrize(("turned", "clear"), [(0.0, True), (0.05, False)])
def test_tracks_speak_against_a_birth_that_turns_the_motion(turned, clear):
    """A window before a birth knows its velocity within 0.05 m/s, after it within 0.002 m/s, right or wrong."""
    velocity, count = np.array([0.2, -0.1, 0.0]), 10
    place = 0.1 * velocity * np.arange(count)[:, None]
    before = _moving(velocity, 0.05, count)
    state = SimpleNamespace(
        window=before, log=_log(place, 0.0), heading=np.zeros(count), level=np.zeros((2, 3)),
        scene=SimpleNamespace(body=SimpleNamespace(tx_offset=np.zeros(3), rx_offset=np.zeros(3)), radio=RadioConfig()),
    )  # fmt: skip
    ratio = motion_agreement.log_agreement(state, _moving(velocity + turned * np.eye(3)[0], 0.002, count))
    at_length = TrackDecision(
        0, 0.98, -1, -1, np.ones(3), 1e-6 * np.eye(3), no_holds(), 0.0, 0.0, unknown(1, 1), 5.0
    )  # fmt: skip
    assert is_clear(at_length)
    assert is_clear(at_length, ratio) == clear
    assert (ratio > 0.0) == clear


def _moving(velocity, std, count):
    """Window of an agent with nothing but a told velocity (3,), within `std` [m/s]."""
    window = window_gaussian.begin(np.zeros(3), velocity, np.array([1e-5] * 3 + [std] * 3 + [0.0]))
    for _ in range(count - 1):
        window = window_gaussian.extend(window, 0.1, np.full(3, 1e6))
    return window_gaussian.solve(window)


def test_a_rate_whose_direction_is_not_told_counts_for_little():
    log = _log(0.1 * np.arange(8)[:, None] * np.array([0.2, -0.1, 0.0]), 0.0)
    vague = log._replace(std=np.where(np.arange(3) == 0, log.std, 0.4))
    found = [
        rates(lengths(Heard(one, np.zeros(8), np.zeros((8, 3)), 0.1, np.zeros(3), 0.5))).blur for one in (log, vague)
    ]
    np.testing.assert_allclose(found[1], 2.0 * 0.4 / np.sqrt(8.0))
    assert (found[0] < 0.1).all()


def _window(rng):
    """Three poses and two features that measurements tie together."""
    window = window_gaussian.begin(np.zeros(3), np.array([0.1, 0.2, 0.0]), np.array([1e-5] * 3 + [0.01] * 3 + [0.0]))
    for place in ([1.0, 2.0, 1.0], [-2.0, 1.0, 2.0]):
        window = window_features.add_feature(window, np.array(place), no_holds())
    for _ in range(2):
        window = window_gaussian.extend(window, 0.1, np.full(3, 25.0))
    root = rng.standard_normal(window.slots.hessian.shape) * 10.0
    root[-1] = 0.0  # nothing is measured from the last pose as yet
    slots = window.slots._replace(hessian=root @ np.swapaxes(root, 1, 2))
    return window_gaussian.solve(window._replace(slots=slots))


@pytest.mark.parametrize(("use_vt", "told"), [(True, True), (False, False)])
def test_without_wall_returns_they_tell_no_jump(use_vt, told):
    """Returns of four walls and two points, predicted for an agent 1.2 m from where it is; without
    `use_vt` those of the walls have no say, and of points that agree there are two."""
    rng, by = np.random.default_rng(6), np.array([0.9, -0.8, 0.0])
    forms, seen = (
        np.full((6, 5), UNKNOWN),
        np.column_stack([rng.uniform(3.0, 9.0, 6), np.linspace(-0.9, 0.9, 6), np.zeros(6)]),
    )
    forms[:, 0] = [TX, TX, TX, TX, 0, 1]
    toward = np.zeros((6, 3, 10))
    toward[:, 0, :2] = 2.0 * np.array([[1.0, 0.0], [0.0, 1.0], [0.7, 0.7], [-0.7, 0.7], [-1.0, 0.1], [0.3, -0.9]])
    heard = seen + toward[:, :, :3] @ by
    level = np.full(6, -8.0)
    groups = SimpleNamespace(leader=np.arange(6), log_amplitude=level)
    view = SimpleNamespace(groups=groups, expected=SimpleNamespace(forms=forms, seen=seen, jacobian=toward))
    found = divergence_monitor.jump(view, SimpleNamespace(seen=heard, log_amplitude=level), use_vt)
    np.testing.assert_allclose(found, by if told else 0.0, atol=1e-3)


def test_after_a_jump_all_but_the_place_is_as_it_was():
    window, by = _window(np.random.default_rng(5)), np.array([0.7, -0.4, 0.0])
    mean, covariance = window_gaussian.now(window)
    after, spread = window_gaussian.now(recovery.window_after_jump(window, by))
    np.testing.assert_allclose(after, mean + np.concatenate([by, np.zeros(len(mean) - 3)]), atol=1e-6)
    wide = covariance.copy()
    wide[[0, 1], [0, 1]] += CONSTANTS.walk**2
    free = np.delete(np.arange(len(mean)), 6)  # the compass is held
    np.testing.assert_allclose(spread[np.ix_(free, free)], wide[np.ix_(free, free)], atol=1e-5)


def test_a_look_elsewhere_moves_the_last_pose_alone():
    window, by = _window(np.random.default_rng(6)), np.array([0.7, -0.4, 0.1])
    there = divergence_monitor.shifted(window, by)
    np.testing.assert_allclose(
        window_gaussian.poses(there)[-1, :3] - window_gaussian.poses(window)[-1, :3], by, atol=1e-12
    )
    np.testing.assert_allclose(window_gaussian.now(there)[0][3:6], window_gaussian.now(window)[0][3:6], atol=1e-9)
    np.testing.assert_allclose(window_gaussian.now(there)[0][HEAD:], window_gaussian.now(window)[0][HEAD:])


@pytest.mark.parametrize("by", [-2.8, 0.3, 1.7])
def test_a_turn_is_read_from_directions_of_paths_alike_in_length(by):
    """Of eight paths three arrive elsewhere. Mirrored directions are no turn, and what comes from above tells none."""
    rng = np.random.default_rng(8)
    length, angle = np.linspace(2.0, 9.0, 8), rng.uniform(-np.pi, np.pi, 8)
    flat = rng.uniform(0.4, 0.9, 8)

    def cosines(azimuth):
        return np.stack([length, flat * np.cos(azimuth), flat * np.sin(azimuth)], axis=1)

    view = SimpleNamespace(
        expected=SimpleNamespace(seen=cosines(angle)),
        groups=SimpleNamespace(leader=np.arange(8), log_amplitude=np.zeros(8)),
    )  # fmt: skip

    def heard(azimuth):
        return SimpleNamespace(seen=cosines(azimuth), log_amplitude=np.zeros(8))

    away = np.where(np.arange(8) < 3, rng.uniform(-np.pi, np.pi, 8), angle - by)
    assert divergence_monitor.turn(view, heard(away), 0.3) == pytest.approx(by, abs=1e-6)
    assert divergence_monitor.turn(view, heard(-angle), 0.01) == 0.0
    flat[:] = 0.05
    assert divergence_monitor.turn(view, heard(angle - by), 0.3) == 0.0


def test_a_compass_that_is_found_wrong_takes_the_rates_of_its_directions_with_it():
    """A free heading is one axis more, in which what lengths tell along known directions has no place."""
    window = window_gaussian.begin(np.zeros(3), TOLD, np.full(7, 0.01))
    for _ in range(4):
        window = window_gaussian.extend(window, 0.1, np.full(3, 25.0))
    many, none = window.num_poses, np.zeros((3, 3))
    rates = RateFactor(np.zeros((many, 3, 3)), np.zeros((many, 3, 2)), np.zeros((many, 3)),
                       window_gaussian.poses(window)[:, :3], none, none[0])  # fmt: skip
    found = recovery.with_free_compass(window_gaussian.solve(window._replace(rates=rates)), 0.1)
    assert found.turns
    assert found.rates is None
    assert np.isfinite(found.head).all()
