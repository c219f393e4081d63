"""Who the panel is: evidence against quadrature, silence, what alternated codes tell, and whom to suspect."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.stats import rice

from rislam_rt import slam
from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.information import amplitude_std
from rislam_rt.measurement import ReceiverConfig, measure, with_reference_snr
from rislam_rt.model import Paths, RadioConfig, RisCode, RisSpec, RisSpecs, Scene, SensorModel, SlamEstimate, Trajectory
from rislam_rt.ris import rephase
from rislam_rt.ris.path_gain import point_amplitude
from rislam_rt.scene import load_scene
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD
from rislam_rt.slam.predicted_returns import NONE, poses_of
from rislam_rt.slam.predicted_returns import TX as MOVING
from rislam_rt.slam.window.births.births import _without_rival
from rislam_rt.slam.window.cycle_association import return_sides
from rislam_rt.slam.window.hypotheses.point_identification import log_none_shorter, longer
from rislam_rt.slam.window.landmarks.landmark_table import empty_table, enter
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.landmarks.ris_identification import PanelObservation, gains, spread_places, unknown, weigh
from rislam_rt.slam.window.measurement_log import Log, empty_log
from rislam_rt.slam.window.smoother.direction_priors import no_holds
from rislam_rt.slam.window.smoother.window_features import add_feature
from rislam_rt.slam.window.smoother.window_gaussian import extend, solve
from rislam_rt.slam.window.solver_limits import CERTAIN
from rislam_rt.slam.window.state import WindowState

SNR_13 = with_reference_snr(RadioConfig(), 13.0)
CONFIG = SlamConfig(filter="window", use_vt=True)
SENSOR = SensorModel(RadioConfig(noise_psd=3.52e-12))
SPEC = RisSpec(6, 6, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
PLACE, TX, RX = np.array([[3.0, 3.0, 3.0]]), np.array([[2.0, 2.5, 0.5]]), np.array([[2.1, 2.5, 0.5]])


def _sight(amplitude, side=UNTOLD, seen=True, std=1e-4):
    places = spread_places(PLACE, std**2 * np.eye(3)[None])
    flag = np.array([seen])
    return PanelObservation(places, TX, RX, np.ones(1), np.array([amplitude]), np.array([side]), flag)


def _code(rng):
    return RisCode(rng.integers(4, size=(6, 6)), 4)


def test_several_cycles_at_once_are_one_after_the_other():
    rng, cycles = np.random.default_rng(2), 7
    places = np.array([[3.0, 3.0, 3.0], [3.3, 2.8, 3.0]])
    spots = spread_places(places, np.tile(1e-8 * np.eye(3), (2, 1, 1)))
    codes, before = [_code(rng) for _ in range(cycles)], unknown(2)
    one_by_one, each = before, []
    for cycle, code in enumerate(codes):
        ends = (np.tile(end + 0.01 * cycle, (2, 1)) for end in (TX, RX))
        seen, side = np.array([cycle % 3 > 0, cycle % 2 > 0]), np.array([UNTOLD, PANEL if cycle < 4 else OTHER])
        sight = PanelObservation(spots, *ends, np.ones(2), rng.uniform(1e-6, 1e-5, 2), side, seen)
        each.append((sight, gains(sight, SPEC, code, SENSOR.radio)))
        one_by_one = weigh(one_by_one, *each[-1], SENSOR)
    every = PanelObservation(*(np.concatenate(fields) for fields in zip(*(sight for sight, _ in each), strict=True)))
    index = np.repeat(np.stack([code.index for code in codes]), 2, axis=0)[:, None]
    gain = gains(every, SPEC, RisCode(index, 4), SENSOR.radio)
    np.testing.assert_allclose(gain, np.concatenate([one for _, one in each], axis=1), rtol=1e-12)
    for whole, part in zip(weigh(before, every, gain, SENSOR), one_by_one, strict=True):
        np.testing.assert_allclose(whole, part, rtol=1e-9, atol=1e-12)
    assert (one_by_one.hidden > 0.0).any()
    assert abs(np.diff(one_by_one.log_ris, axis=0)).min() > 1.0


def test_one_amplitude_tells_what_quadrature_tells():
    code, radio, noise = _code(np.random.default_rng(1)), SENSOR.radio, amplitude_std(SENSOR.radio)
    sight = _sight(3.0 * noise)
    gain = gains(sight, SPEC, code, radio)
    sight = sight._replace(amplitude=abs(gain[0]).mean(axis=1) + noise)
    found = weigh(unknown(1), sight, gain, SENSOR).log_ris[0, 0] - np.log(CONSTANTS.panels)
    loud = abs(gain[0, 0])
    spread = np.hypot(noise, CONSTANTS.law * loud)
    panel = np.mean(rice.pdf(sight.amplitude[0], loud / spread, scale=spread))
    # the root of the cross-section is log-normal; far beyond the filter's own grid
    log = np.linspace(np.log(1e-4), np.log(30.0), 4001)
    prior = np.exp(-0.5 * ((log - np.log(CONSTANTS.strength)) / CONSTANTS.strength_std) ** 2)
    level = point_amplitude(np.exp(log), np.linalg.norm(PLACE - TX), np.linalg.norm(PLACE - RX), radio)
    width = np.hypot(noise, CONSTANTS.law * level)
    other = np.sum(prior * rice.pdf(sight.amplitude[0], level / width, scale=width)) / prior.sum()
    # the filter's grid ends 2.5 deviations above the median: 1 % of the prior
    np.testing.assert_allclose(found, np.log(panel / other), atol=0.03)


def test_amplitudes_and_silence_tell_panel_from_scatterer():
    rng, noise = np.random.default_rng(2), amplitude_std(SENSOR.radio)
    least = np.sqrt(2.0 * SENSOR.threshold) * noise
    for is_panel in (True, False):
        belief = unknown(1)
        for _ in range(25):
            gain = gains(_sight(1.0), SPEC, _code(rng), SENSOR.radio)
            level = float(abs(gain[0, 0, 0])) if is_panel else 2.0 * least
            heard = float(np.hypot(level + noise * rng.standard_normal(), noise * rng.standard_normal()))
            belief = weigh(belief, _sight(max(heard, least), seen=heard > least), gain, SENSOR)
        assert (belief.log_ris[0, 0] > 3.0) == is_panel
        assert abs(belief.log_ris[0, 0]) > 3.0


def test_what_is_hidden_tells_nothing_by_silence_and_alternation_excludes():
    code = _code(np.random.default_rng(3))
    gain = 10.0 * gains(_sight(1.0), SPEC, code, SENSOR.radio)
    silent = _sight(1.0, seen=False)
    blocked = unknown(1)._replace(hidden=np.ones((1, 2)))
    assert weigh(blocked, silent, gain, SENSOR).log_ris[0, 0] == pytest.approx(np.log(CONSTANTS.panels))
    # a panel this loud would have been heard
    assert weigh(unknown(1), silent, gain, SENSOR).log_ris[0, 0] < np.log(CONSTANTS.panels)
    level = float(abs(gain).mean())
    told = [weigh(unknown(1), _sight(level, side=side), gain, SENSOR).log_ris[0, 0] for side in (OTHER, UNTOLD, PANEL)]
    assert told[0] < np.log(CONSTANTS.panels) < told[1] < told[2]


@pytest.mark.parametrize(("told", "cycles"), [(True, 4), (False, 20)])
def test_two_panels_of_one_data_sheet_are_told_apart(told, cycles):
    """By the codes alone within 20 cycles, by whose signs a component has within four; a scatterer is neither."""
    sheets, spots = RisSpecs((SPEC, SPEC)), np.array([[3.0, 3.0, 3.0], [1.5, 3.2, 3.0], [2.0, 1.0, 1.5]])
    rng, noise = np.random.default_rng(5), amplitude_std(SENSOR.radio)
    least, sides = np.sqrt(2.0 * SENSOR.threshold) * noise, np.array([PANEL, PANEL + 1, OTHER])
    belief, places = unknown(3, 2), spread_places(spots, np.tile(1e-8 * np.eye(3), (3, 1, 1)))
    for _ in range(cycles):
        code = RisCode(rng.integers(4, size=(1, 72)), 4)
        look = PanelObservation(
            places, np.tile(TX, (3, 1)), np.tile(RX, (3, 1)), np.ones(3), *np.zeros((2, 3)), np.ones(3)
        )
        gain = gains(look, sheets, code, SENSOR.radio)
        level = np.array([abs(gain[0, 0, 0]), abs(gain[1, 1, 0]), 3.0 * least])
        heard = np.hypot(level + noise * rng.standard_normal(3), noise * rng.standard_normal(3))
        look = look._replace(amplitude=heard, side=sides if told else np.full(3, UNTOLD), seen=heard > least)
        belief = weigh(belief, look, gain, SENSOR)
    own, other = belief.log_ris[[0, 1], [0, 1]], belief.log_ris[[0, 1], [1, 0]]
    assert (own > 4.0).all()
    assert (own - other > 4.0).all()
    assert (belief.log_ris[2] < -2.0).all()


def test_forms_take_the_side_of_the_panel_that_their_point_is_held_for():
    forms = np.full((4, 5), -1)
    forms[:, 0] = [0, 1, 2, MOVING]

    def sides(odds):
        landmarks = empty_table(2)
        for row in odds:
            landmarks = enter(landmarks, False, np.zeros(3), 1, 0.0, unknown(1, 2)._replace(log_ris=np.array([row])))
        return return_sides(forms, landmarks), landmarks.panels

    found, held = sides([[-9.0, 9.0], [9.0, -9.0], [-9.0, -9.0]])
    assert held == (1, 0)
    np.testing.assert_array_equal(found, [PANEL + 1, PANEL, OTHER, OTHER])
    found, held = sides([[-9.0, 0.0], [9.0, -9.0], [-9.0, 0.0]])  # the other panel may be either of two points
    assert held == (1, -1)
    np.testing.assert_array_equal(found, [UNTOLD, PANEL, UNTOLD, OTHER])
    found, held = sides([[0.0, 0.0]] * 3)
    assert held == (-1, -1)
    assert (found == UNTOLD).all()


class Walk(NamedTuple):
    """A walk below the panel of the paper's room, at 13 dB."""

    scene: Scene
    motion: Trajectory
    paths: Paths
    radio: RadioConfig


@pytest.fixture(scope="module")
def walk() -> Walk:
    scene, radio = load_scene(Path(__file__).parents[4] / "scenes" / "paper_room"), SNR_13
    motion = scene.agent[:18]
    motion = replace(motion, position=motion.position + np.array([1.7, 0.9, 0.4]))
    return Walk(scene, motion, ImageSourceChannel(replace(scene, agent=motion), radio, 1).paths(motion), radio)


def begun(walk: Walk, rng: np.random.Generator) -> WindowState:
    motion, sensor = walk.motion, SensorModel(walk.radio, alternation=True)
    start = StartPrior(motion.position[0], motion.velocity[0], float(motion.heading[0]))
    return slam.init(start, motion.body, walk.scene.ris.spec, sensor, CONFIG, rng=rng)


def followed(walk: Walk, state: WindowState, rng: np.random.Generator) -> Iterator[SlamEstimate]:
    """What the filter expects after each cycle, under random codes, alternated."""
    receiver, spec = ReceiverConfig(estimator="bound", alternation=True), walk.scene.ris.spec
    for cycle in range(len(walk.motion)):
        code = RisCode(rng.integers(spec.levels, size=(spec.rows, spec.cols)), spec.levels)
        here, heading = rephase(walk.paths.of_cycle(cycle), code), float(walk.motion.heading[cycle])
        heard, _ = measure(here, 0, heading, walk.radio, receiver, rng=rng)
        state, _ = slam.step(state, heard, code, 0.1 if cycle else 0.0, heading, CONFIG, rng=rng)
        yield slam.predict(state, 0.1, CONFIG)


def test_panel_is_found_as_soon_as_it_was_heard_six_times(walk: Walk) -> None:
    """Until it is named there is a suspect."""
    rng, center = np.random.default_rng(4), walk.scene.ris.center
    named, suspected = [], []
    for found in followed(walk, begun(walk, rng), rng):
        if found.map.ris >= 0:
            named.append(np.linalg.norm(found.map.position[found.map.ris] - center))
        suspected += [np.linalg.norm(one.position - center) for one in found.suspects]
    assert len(named) >= 3
    assert named[-1] < 0.1
    assert len(suspected) >= 2
    assert min(suspected) < 0.5


@pytest.mark.parametrize(
    ("offset", "log_odds"),
    [
        ([0.0, 0.0, 3.0], 12.0),  # what is heard by a shorter way than the direct one over it is not it over walls
        ([0.0, 0.8, -0.8], 2.0),  # what is hardly there is hardly the panel
    ],
)
def test_a_point_that_is_held_for_the_panel_gives_way(walk: Walk, offset: list[float], log_odds: float) -> None:
    rng, center = np.random.default_rng(4), walk.scene.ris.center
    wrong, state = center + np.array(offset), begun(walk, rng)
    held = unknown(1)._replace(log_ris=np.array([[CERTAIN]]), hidden=np.ones((1, 2)))  # silence tells nothing of it
    state = state._replace(
        window=add_feature(state.window, wrong, no_holds(), 1e4),
        landmarks=enter(state.landmarks, False, np.zeros(3), 9, log_odds, held),
    )
    maps = [found.map for found in followed(walk, state, rng)]
    np.testing.assert_allclose(maps[0].position[maps[0].ris], wrong, atol=0.1)
    np.testing.assert_allclose(maps[-1].position[maps[-1].ris], center, atol=0.1)
    assert np.linalg.norm(maps[-1].position - wrong, axis=1).min() > 0.5


def test_a_point_held_for_another_panel_stays() -> None:
    """Even if the new point might be either."""
    context: Any = SimpleNamespace(landmarks=SimpleNamespace(ident=np.arange(3)))
    born = unknown(1, 2)._replace(log_ris=np.array([[9.0, 5.0]]))
    assert _without_rival(context, born, (-1, 0)) is context


def test_a_track_is_longer_than_the_direct_path_over_a_panel_by_its_deviations(walk: Walk) -> None:
    rng, center = np.random.default_rng(4), walk.scene.ris.center
    state = begun(walk, rng)
    known = unknown(1)._replace(log_ris=np.array([[CERTAIN]]))
    state = state._replace(
        window=add_feature(state.window, center, no_holds(), 0.05**-2),
        landmarks=enter(state.landmarks, False, np.zeros(3), 9, 5.0, known),
    )
    state = state._replace(window=solve(state.window))
    ends = poses_of(walk.motion.position[:1], state.heading[:1], walk.motion.body)
    legs = [np.linalg.norm(center - end[0]) for end in (ends.tx, ends.rx)]
    count, std = 3, 0.01
    log = empty_log()._replace(
        cycle=np.zeros(count, dtype=np.int64), seen=np.array([[sum(legs) + by, 0.0, 0.0] for by in (-0.5, 0.0, 0.5)]),
        std=np.full((count, 3), std),
    )  # fmt: skip
    found = longer(state._replace(log=log), [np.array([row]) for row in range(count)])
    slope = sum((center - end[0]) / leg for end, leg in zip((ends.tx, ends.rx), legs, strict=True))
    # the pose is the start's, which is held
    expected = np.array([-0.5, 0.0, 0.5]) / np.hypot(0.05 * np.linalg.norm(slope), std)
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-3, atol=1e-6)
    none = longer(state._replace(log=log, landmarks=empty_table()), [np.array([0])])
    assert np.isposinf(none).all()


def test_a_panel_is_not_where_what_is_heard_straight_over_it_would_be_too_short(walk: Walk) -> None:
    state, period = begun(walk, np.random.default_rng(4)), 1e-7
    ends = poses_of(walk.motion.position[:1], state.heading[:1], walk.motion.body)
    center, cycles, known = walk.scene.ris.center, 6, unknown(1)._replace(log_ris=np.array([[CERTAIN]]))
    beyond = center + 0.5 * (center - ends.rx[0])
    long = sum(np.linalg.norm(center - end[0]) for end in (ends.tx, ends.rx))
    window = add_feature(state.window, center, no_holds(), 0.05**-2)
    for _ in range(cycles - 1):  # an agent that stands
        window = extend(window, 0.1, np.full(3, 1e8))
    state = state._replace(
        window=window, heading=np.repeat(state.heading, cycles), cycle=cycles - 1,
        landmarks=enter(state.landmarks, False, np.zeros(3), 9, 5.0, known),
        scene=state.scene._replace(sensor=replace(state.scene.sensor, period=period)),
    )  # fmt: skip
    log = empty_log()._replace(
        cycle=np.arange(cycles), seen=np.tile([long, 0.0, 0.0], (cycles, 1)), std=np.full((cycles, 3), 0.01),
        side=np.full(cycles, PANEL), form=np.tile([state.landmarks.ident[0], NONE, NONE, NONE, NONE], (cycles, 2, 1)),
    )  # fmt: skip
    places, spread, none = np.stack([center, beyond]), np.tile(1e-4 * np.eye(3), (2, 1, 1)), np.zeros(0, dtype=np.int64)

    def found(log: Log, at: Integers = none) -> Floats:
        return log_none_shorter(state._replace(log=log), at, places, spread)[:, 0]

    assert found(log)[0] > -1e-3
    assert found(log)[1] < -CERTAIN
    # as heard a period of the sounding too early, it is as long
    np.testing.assert_allclose(
        found(log._replace(seen=log.seen - [SPEED_OF_LIGHT * period, 0.0, 0.0])), found(log), atol=1e-6
    )
    # a track does not speak against itself, nor what is heard over no panel, nor by another way
    assert not found(log, np.arange(cycles)).any()
    assert not found(log._replace(side=np.full(cycles, OTHER))).any()
    assert not found(log._replace(form=np.full((cycles, 2, 5), UNKNOWN))).any()
    empty = state._replace(log=log, landmarks=empty_table())
    assert not log_none_shorter(empty, none, places, spread).any()
