"""Manoeuvres: an agent that sets off from rest or climbs, where its map measures nothing of it, and what is none."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rislam_rt import slam
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import ReceiverConfig, measure, with_reference_snr
from rislam_rt.model import Measurement, RadioConfig, SensorModel
from rislam_rt.pipeline.scheme_simulation import without_panel
from rislam_rt.scene import load_scene
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window import filter as window_filter
from rislam_rt.slam.window.motion import egomotion, length_rates, manoeuvres, motion_agreement
from rislam_rt.slam.window.smoother import motion as motion_modes

ROOM, COUNT = Path(__file__).parents[4] / "scenes" / "paper_room", 28
CONFIG = SlamConfig(filter="window", use_vt=True)
RECEIVER = ReceiverConfig("bound", alternation=False)
NOWHERE = np.zeros((1, 2))
NOTHING = Measurement(*(np.zeros((0, 2) if at in (1, 4) else 0) for at in range(6)))


def follow(place, velocity, turned, seed, depth=2, **settings):
    """Errors (K, 3) [m] and squared deviations (K,) across of the filter for an agent that faces `turned` [rad], in a
    room that throws signals back over up to `depth` walls."""
    off, square = [], []
    for cycle, state in enumerate(states(place, velocity, turned, seed, depth, **settings)):
        found = slam.estimate(state, CONFIG)
        off.append(found.position - place[cycle])
        square.append(float(off[-1][:2] @ np.linalg.solve(found.covariance[:2, :2], off[-1][:2])))
    return np.array(off), np.array(square)


@cache
def about_to_hear(count):
    """The state of a level walk that has moved on after `count` cycles and asks for manoeuvres next."""
    place = np.array([1.2, 2.4, 0.8]) + np.arange(count)[:, None] * [0.06, 0.02, 0.0]
    *_, state = states(place, np.tile([0.6, 0.2, 0.0], (count, 1)), 0.32, 0)
    return manoeuvres.with_rates(window_filter._move(state, 0.1, 0.32))


def states(place, velocity, turned, seed, depth=2, dark=(), first=0.0, wrong=0.0):
    """States of the filter after each cycle, for an agent as `follow` has it, which hears nothing in `dark` cycles,
    `first` [s] after the start in the first, and told a start that is faster by `wrong` [m/s] along x."""
    scene, rng, count = load_scene(ROOM), np.random.default_rng(seed), len(place)
    motion = replace(scene.agent[:count], position=place, velocity=velocity, heading=np.full(count, turned))
    radio = with_reference_snr(RadioConfig(), 13.0)
    paths = without_panel(ImageSourceChannel(replace(scene, agent=motion), radio, depth).paths(motion))
    told = velocity[0] + 0.01 * rng.standard_normal(3) * [1.0, 1.0, 0.0] + [wrong, 0.0, 0.0]
    start = StartPrior(place[0], told, turned)
    state = slam.init(start, motion.body, None, SensorModel(radio), CONFIG, rng=rng)
    for cycle in range(count):
        heard, _ = measure(paths, cycle, turned, radio, RECEIVER, rng=rng)
        if cycle in dark:
            heard = NOTHING
        state, _ = slam.step(state, heard, None, 0.1 if cycle else first, turned, CONFIG, rng=rng)
        yield state


@pytest.mark.parametrize(
    ("turned", "seed"), [pytest.param(0.0, 0, marks=pytest.mark.slow), (0.7, 1)], ids=["along the array", "across it"]
)
def test_who_sets_off_along_the_walls_is_followed(turned, seed):
    """At 1 m/s^2 from rest, before anything is born. Along the walls the array hears ahead and behind alike."""
    time = np.maximum(0.1 * (np.arange(COUNT) - 1), 0.0)
    way = np.where(time < 1.4, 0.5 * time**2, 1.4 * time - 0.98)
    place = np.array([1.2, 3.4, 0.8]) + way[:, None] * [1.0, 0.0, 0.0]
    off, square = follow(place, np.minimum(time, 1.4)[:, None] * [1.0, 0.0, 0.0], turned, seed)
    # held for standing still, it was 2.5 m off, at a claimed 2 cm
    assert np.linalg.norm(off[-8:, :2], axis=1).max() < 5e-3
    assert square[-8:].max() < 9.2  # chi^2, 2 dof: 0.99


@pytest.mark.parametrize(("push", "seed"), [(0.5, 0), (0.8, 1), pytest.param(0.8, 2, marks=pytest.mark.slow)])
def test_who_sets_off_at_once_is_followed_before_anything_is_born(push, seed):
    """From rest in the first cycle: the first tracks tell of it as soon as two of their lengths have to agree."""
    time, way = 0.1 * np.arange(9)[:, None], np.array([np.cos(0.4), np.sin(0.4), 0.0])
    off, square = follow(np.array([1.6, 1.8, 0.9]) + 0.5 * push * time**2 * way, push * time * way, 0.4, seed)
    # until the first births it was held for standing still: 37 to 100 mm off in these cycles
    assert np.linalg.norm(off[4:, :2], axis=1).max() < 0.01
    assert square[4:].max() < 9.2  # chi^2, 2 dof: 0.99


@pytest.mark.parametrize(
    ("dark", "first", "since"), [((4,), 0.0, 6), pytest.param((2,), 0.0, 5, marks=pytest.mark.slow), ((), 0.1, 4)]
)
def test_who_sets_off_at_once_is_followed_whatever_is_not_heard(dark, first, since):
    """A cycle without components delays by a cycle or two; so long as there are no longer tracks, four lengths do."""
    time, way = 0.1 * np.arange(9)[:, None], np.array([np.cos(0.4), np.sin(0.4), 0.0])
    place = np.array([1.6, 1.8, 0.9]) + 0.4 * time**2 * way
    off, _ = follow(place, 0.8 * time * way, 0.4, 1, dark=dark, first=first)
    assert np.linalg.norm(off[since:, :2], axis=1).max() < 0.015  # 0.14 m in cycle 6 where it was not asked


@pytest.mark.parametrize(("count", "many"), [(0, 4), (4, 4), (5, 5), (6, 6), (40, 6)])
def test_the_first_tracks_are_asked_sooner(count, many):
    """No track can be longer than there were cycles with components."""
    assert length_rates.enough_measured(np.repeat(np.arange(10, 10 + count), 3)) == many


@pytest.mark.parametrize("seed", [0, *(pytest.param(x, marks=pytest.mark.slow) for x in (1, 2, 3))])
def test_a_start_told_wrong_is_no_manoeuvre(seed):
    """The first tracks tell of it in the cycle before a manoeuvre is asked for: no acceleration would explain it."""
    place = np.array([1.6, 1.8, 0.9]) + np.arange(9)[:, None] * [0.03, 0.01, 0.0]
    every = list(states(place, np.tile([0.3, 0.1, 0.0], (9, 1)), 0.4, seed, wrong=0.6))
    assert [state.start_was_wrong for state in every] == [False] * 3 + [True] * 6
    for state, there in zip(every[5:], place[5:], strict=True):
        assert np.linalg.norm(slam.estimate(state, CONFIG).position - there) < 0.01  # 0.3 m a second


@pytest.mark.parametrize(("lively", "level"), [(1e-3, True), (1e-3, False), (0.999, True), (0.999, False)])
def test_a_manoeuvre_that_begins_has_to_be_held_for_true(lively, level, monkeypatch):
    """One that goes on only to be likelier than not; and most floors are level."""
    state, found, accel = about_to_hear(12), {}, np.zeros(3)
    mode = np.full(state.level.shape, (1.0 - lively) / (state.level.shape[1] - 1))
    mode[:, -1] = lively
    monkeypatch.setattr(
        motion_agreement, "weigh_manoeuvre", lambda _, __, steps, prior: found.update({steps: prior}) or (-1.0, accel)
    )
    assert manoeuvres.with_manoeuvre(state._replace(level=mode, is_level=level)).window is state.window
    going_on = (mode[:2] @ motion_modes.transition(CONSTANTS.stay))[:, -1]
    for steps, prior in found.items():
        share = np.maximum(going_on, 1.0 - CONSTANTS.stay**steps)
        begins = 0.0 if lively > 0.5 else CONSTANTS.log_born
        least = np.array([begins, begins + level * CONSTANTS.log_upright])
        np.testing.assert_allclose(prior, np.log(share / (1.0 - share)) - least, rtol=1e-12)
    assert len(found) == 3


@pytest.mark.parametrize("blind", [None, "turns", "no walls", "told"])
def test_who_knows_all_that_it_hears_asks_as_well(monkeypatch, blind):
    """Where the map explains every component no track has a rate, and the explained paths tell of a manoeuvre."""
    state, asked = about_to_hear(25), []
    state = state._replace(window=state.window._replace(rates=None))
    if blind == "turns":
        state = state._replace(window=state.window._replace(accel=np.zeros((24, 4))))
    if blind == "no walls":
        state = state._replace(scene=state.scene._replace(use_vt=False))
    if blind == "told":
        state = state._replace(config=replace(CONFIG, motion="told"))
    monkeypatch.setattr(motion_agreement, "weigh_manoeuvre", lambda *_: asked.append(1) or (-1.0, np.zeros(3)))
    assert manoeuvres.with_manoeuvre(state) is state
    assert (len(asked) > 0) == (blind is None)


def test_no_path_tells_more_than_that_it_is_another(monkeypatch):
    """Each counts for a rare event at most, for and against, in the cycles that the manoeuvre has lasted."""
    returns, since = iter([np.array([-50.0, -60.0, 2.0, 30.0]), np.array([0.0, -1.0, 1.0, 1.0])]), []
    monkeypatch.setattr(manoeuvres, "_log_returns", lambda _, begin: since.append(begin) or next(returns))
    found = manoeuvres._log_borne_out(None, None, 22)
    assert found == pytest.approx(2.0 * CONSTANTS.log_rare + 1.0 - CONSTANTS.log_rare, rel=1e-12)
    assert since == [22, 22]


def test_no_manoeuvre_is_believed_that_the_map_contradicts(monkeypatch):
    """Tracks speak for a climb while the ceiling is heard where it is from a level floor: as much as they outweigh that
    its path is another than it was held for, and no more."""
    state = about_to_hear(25)
    accel = state.window.accel + np.array([0.0, 0.0, 0.3]) * (np.arange(len(state.window.accel)) > 12)[:, None]
    climbed = state._replace(window=state.window._replace(accel=accel))
    assert manoeuvres._log_borne_out(state, state, 22) == 0.0
    contradicted = manoeuvres._log_borne_out(state, climbed, 22)
    assert contradicted <= CONSTANTS.log_rare
    monkeypatch.setattr(manoeuvres, "solve_livelier", lambda window, *_, **__: climbed.window)
    monkeypatch.setattr(manoeuvres, "_with_scatter_relearnt", lambda state, _: state)
    monkeypatch.setattr(manoeuvres, "with_rates", lambda state: state)
    monkeypatch.setattr(manoeuvres.window_gaussian, "solve", lambda _: climbed.window)
    for odds in (-contradicted - 0.1, -contradicted + 0.1):
        monkeypatch.setattr(
            motion_agreement, "weigh_manoeuvre", lambda *_, odds=odds: (odds, np.array([0.0, 0.0, 0.3]))
        )
        assert (manoeuvres.with_manoeuvre(state) is state) == (odds < -contradicted)


def test_a_climb_for_one_cycle_that_the_steps_contradict_leaves_no_height_open(monkeypatch):
    """A cycle is associated as if the agent climbed, and the floor is held for level all the same."""
    place = np.array([1.2, 2.4, 0.8]) + np.arange(5)[:, None] * [0.06, 0.02, 0.0]
    over, found = window_filter._associate_over_motions, []

    def climbing(state, *rest):
        state, view, _ = over(state, *rest)
        found.append(state.cycle)
        window = manoeuvres.solve_livelier(state.window, 3, upwards=True) if state.cycle == 4 else state.window
        return state._replace(window=window), view, (0.0, 1e-3 * (state.cycle == 4))

    monkeypatch.setattr(window_filter, "_associate_over_motions", climbing)
    *_, state = states(place, np.tile([0.6, 0.2, 0.0], (5, 1)), 0.32, 0)
    assert found[-1] == 4
    assert state.is_level
    # but for a heave that there may be; it was 0.02 m
    assert np.sqrt(slam.estimate(state, CONFIG).covariance[2, 2] - state.heave_uncertainty) < 1e-3


@pytest.mark.parametrize("seed", [0, *(pytest.param(x, marks=pytest.mark.slow) for x in (1, 2))])
def test_who_takes_the_stairs_is_followed(seed):
    """From a level floor to 0.34 m/s upwards within half a second, as the ceiling is known."""
    climb = np.clip(0.068 * (np.arange(COUNT) - 15), 0.0, 0.34)
    height = np.concatenate([[0.0], np.cumsum(0.05 * (climb[1:] + climb[:-1]))])
    place = (
        np.array([1.2, 2.4, 0.5]) + np.arange(COUNT)[:, None] * [0.06, 0.02, 0.0] + height[:, None] * [0.0, 0.0, 1.0]
    )
    velocity = np.stack([np.full(COUNT, 0.6), np.full(COUNT, 0.2), climb], axis=1)
    off, _ = follow(place, velocity, 0.32, seed)
    assert np.abs(off[15:, 2]).max() < 0.02  # a level floor is 0.34 m off
    assert np.abs(off[-3:, 2]).max() < 5e-3


@pytest.mark.parametrize("seed", [0, *(pytest.param(x, marks=pytest.mark.slow) for x in (1, 2))])
def test_a_climb_that_one_return_tells_of_is_no_pull(seed):
    """At 0.1 m/s after half a second, where the ceiling's own return alone tells of it: what grows from cycle to cycle
    was held for a neighbour's pull, until its variance let the floor be level."""
    climb = np.clip(0.02 * (np.arange(COUNT) - 15), 0.0, 0.1)
    height = np.concatenate([[0.0], np.cumsum(0.05 * (climb[1:] + climb[:-1]))])
    place = (
        np.array([1.2, 2.4, 0.5]) + np.arange(COUNT)[:, None] * [0.05, 0.02, 0.0] + height[:, None] * [0.0, 0.0, 1.0]
    )
    off, _ = follow(place, np.stack([np.full(COUNT, 0.5), np.full(COUNT, 0.2), climb], axis=1), 0.32, seed, depth=1)
    assert np.abs(off[15:, 2]).max() < 0.02  # 0.03 while it was held for pull
    assert np.abs(off[-3:, 2]).max() < 5e-3


@pytest.mark.parametrize("dark", [range(0), range(18, 24)], ids=["heard", "nothing heard for a while"])
def test_steady_motion_is_no_manoeuvre(dark, monkeypatch):
    """At 1 m/s in the paper's room: neither what directions err by nor cycles without components tell of one."""
    scene, rng, count = load_scene(ROOM), np.random.default_rng(3), 30
    way = np.arange(count)[:, None] * np.array([0.1, 0.02, 0.0])
    motion = replace(
        scene.agent[:count], position=np.array([1.2, 2.4, 0.8]) + way, velocity=np.tile([1.0, 0.2, 0.0], (count, 1)),
        heading=np.full(count, 0.2),
    )  # fmt: skip
    radio = with_reference_snr(RadioConfig(), 13.0)
    paths = without_panel(ImageSourceChannel(replace(scene, agent=motion), radio, 2).paths(motion))
    start = StartPrior(motion.position[0], motion.velocity[0], 0.2)
    state, found = slam.init(start, motion.body, None, SensorModel(radio), CONFIG, rng=rng), []
    weigh = motion_agreement.weigh_manoeuvre
    monkeypatch.setattr(motion_agreement, "weigh_manoeuvre", lambda *each: found.append(weigh(*each)) or found[-1])
    for cycle in range(count):
        heard, _ = measure(paths, cycle, 0.2, radio, RECEIVER, rng=rng)
        if cycle in dark:
            heard = NOTHING
        state, _ = slam.step(state, heard, None, 0.1 if cycle else 0.0, 0.2, CONFIG, rng=rng)
    assert len(found) > 8
    assert max(odds for odds, _ in found) < 0.0


@pytest.mark.parametrize("seed", [0, *(pytest.param(x, marks=pytest.mark.slow) for x in (6, 7))])
def test_who_takes_off_where_the_map_knows_the_height_is_followed(seed):
    """At 0.8 m/s^2 from rest, straight up: what the map explains follows the climb, and the tracks that are left are
    those that keep their lengths, as what goes over floor and ceiling does."""
    time = np.maximum(0.1 * (np.arange(30) - 10), 0.0)
    rise = np.where(time < 1.0, 0.4 * time**2, 0.8 * time - 0.4)
    place, up = np.array([1.5, 1.5, 0.4]) + rise[:, None] * [0.0, 0.0, 1.0], np.minimum(0.8 * time, 0.8)
    off, _ = follow(place, up[:, None] * [0.0, 0.0, 1.0], 0.6, seed)
    # while the climb that is believed in did not count as motion of the agent, its steps were taken back: 0.4 m
    assert np.abs(off[17:, 2]).max() < 5e-3


def test_only_the_whole_motion_blurs_a_rate():
    """Whether a climb is believed in or asked for, a path is as likely."""
    rng = np.random.default_rng(0)
    toward = -2.0 * np.array([[0.6, 0.0, 0.8], [0.0, 0.98, 0.2], [-0.3, 0.3, 0.9]])
    rate, whole, climb = rng.standard_normal(3), rng.standard_normal(3), 0.4 + rng.standard_normal((5, 1))
    rest = length_rates.Rates(toward, rate, np.full(3, 0.01), np.full(3, 0.05), whole, believed=np.zeros(3), astray=0.1)
    told = rest._replace(rate=rate - toward[:, 2] * 0.7, believed=np.array([0.0, 0.0, 0.7]))
    found, expected = (egomotion._likelihoods(*of)[0] for of in ((told, NOWHERE, climb - 0.7), (rest, NOWHERE, climb)))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_low_return_tells_less_of_a_climb():
    """An error of its cosines is one of its elevation's sine by the cotangent of the elevation; level ones tell what
    their own error lets them."""
    up, blur = np.array([1.0, 0.8, 0.2, 0.0]), 0.02
    toward = -2.0 * np.stack([np.sqrt(1.0 - up**2), np.zeros(4), up], axis=1)
    found = length_rates.Rates(toward, np.zeros(4), np.ones(4), np.full(4, blur), np.zeros(4))
    angle = np.arcsin(np.maximum(up, np.sqrt(0.5 * blur)))
    np.testing.assert_allclose(found.lean, blur / np.tan(angle), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(found._replace(blur=np.zeros(4)).lean, 0.0)
