"""New walls that are heard over a known one: which of a pair of mirror images can be, and what silence tells."""

from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt import slam
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.walls import build_walls
from rislam_rt.measurement import ReceiverConfig, measure, with_reference_snr
from rislam_rt.model import MapEstimate, Material, RadioConfig, Reflector, Scene, SensorModel, Trajectory
from rislam_rt.scene import load_scene
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import reflect
from rislam_rt.slam.window.hypotheses.hypotheses import KNOWN_WALL, WALL, WALL_KNOWN
from rislam_rt.slam.window.hypotheses.hypothesis_evidence import log_upright
from rislam_rt.slam.window.hypotheses.hypothesis_fits import Fits
from rislam_rt.slam.window.hypotheses.path_feasibility import bounces, log_possible
from rislam_rt.slam.window.hypotheses.unheard_returns import log_missed, log_silence
from rislam_rt.slam.window.landmarks.landmark_table import empty_table

ROOMS = Path(__file__).parents[4] / "scenes"
MIDDLE = np.array([1.0, -0.5, 0.8])
BASELINE = np.array([0.05, 0.01, 0.0])
CELL = np.full(2, 1e-9)  # everything is resolved
TX, RX = MIDDLE + BASELINE, MIDDLE - BASELINE


def _image(normal, distance):
    """Image of the agent's place in the wall that far from it in that direction."""
    return MIDDLE + 2.0 * distance * np.asarray(normal) / np.linalg.norm(normal)


def _case(kind, known):
    count = len(kind)
    table = SimpleNamespace(
        kind=np.array(kind),
        known=np.zeros(count, dtype=np.int64),
        trials=SimpleNamespace(track=np.zeros(count, dtype=np.int64)),
    )
    summary = SimpleNamespace(mean=(np.zeros((1, 3)), TX[None], RX[None]), middle=MIDDLE)
    return table, summary, SimpleNamespace(place=known[None], root=np.zeros((1, 3, 3)))


def test_of_a_wall_and_its_mirror_image_in_the_known_one_only_one_can_throw_the_path():
    rng, decided = np.random.default_rng(3), 0
    for _ in range(200):
        known, new = (_image([*rng.standard_normal(2), rng.uniform(0.0, 0.3)], rng.uniform(1.0, 6.0)) for _ in "ab")
        # the mirror image of a plane: of two of the points that it mirrors into each other
        agent, image = reflect(np.stack([MIDDLE, new]), known, MIDDLE)
        twin = reflect(MIDDLE, image, agent)
        table, summary, walls = _case([KNOWN_WALL, WALL_KNOWN], known)
        place = np.stack([new, twin])
        heard = [reflect(reflect(TX, first, MIDDLE), then, MIDDLE) for first, then in ((known, new), (twin, known))]
        assert np.allclose(*heard)
        found = np.exp(log_possible(table, place, np.zeros((2, 3, 3)), summary, walls, CELL))
        # twice its probability, as beforehand either can be
        assert found.sum() < 2.0 + 1e-6
        decided += found.max() > 1.98
    assert decided > 50


def test_a_path_over_the_floor_arrives_from_below_and_is_not_heard():
    upright, spread = np.stack(2 * [_image([1.0, 0.3, 0.0], 4.0)]), np.tile(1e-6 * np.eye(3), (2, 1, 1))
    for rise, heard in ((-0.8, False), (2.2, True)):
        table, summary, walls = _case([KNOWN_WALL, WALL_KNOWN], MIDDLE + 2.0 * rise * np.eye(3)[2])
        assert (np.exp(log_possible(table, upright, spread, summary, walls, CELL)).max() > 1.98) == heard


def test_the_path_meets_the_new_wall_in_that_wall():
    known, new = _image([1.0, 0.0, 0.0], 3.0), _image([0.2, 1.0, 0.0], 2.0)
    table, summary, walls = _case([KNOWN_WALL, WALL], known)
    rows, spot = bounces(table, np.stack([new, new]), summary, walls)
    assert rows.tolist() == [0]
    assert np.isclose((spot[0] - 0.5 * (new + MIDDLE)) @ (new - MIDDLE), 0.0, atol=1e-12)
    # of one length in and out: straight on to the image of the Tx
    image = reflect(reflect(TX, known, MIDDLE), new, MIDDLE)
    assert np.allclose(np.cross(spot[0] - RX, image - RX), 0.0, atol=1e-12)


def test_silence_has_the_probability_of_all_ways_in_which_something_may_hide_the_return():
    shows, total = np.array([0.9, 0.4, 0.95, 0.7]), 0.0
    move = np.array([[1.0 - CONSTANTS.cleared, CONSTANTS.cleared], [CONSTANTS.rare, 1.0 - CONSTANTS.rare]])
    for clear in product((0, 1), repeat=len(shows)):
        chance = CONSTANTS.steady**2 if clear[0] else 1.0 - CONSTANTS.steady**2
        chance *= np.prod([move[a, b] for a, b in pairwise(clear)])
        total += chance * np.prod(1.0 - shows * np.array(clear))
    assert np.isclose(log_silence(shows, np.zeros(4, dtype=bool)), np.log(total), rtol=1e-12)
    assert log_silence(shows, np.ones(4, dtype=bool)) == 0.0


def test_what_is_near_hides_a_return_that_shares_its_component():
    shows, present, itself = np.full(6, 0.9), np.arange(6) > 0, np.arange(6) > 3
    merged, apart = np.exp(log_silence(shows, present)), np.exp(log_silence(shows, itself))
    found = np.exp(log_missed(shows, present, itself))
    assert np.isclose(found, CONSTANTS.company * merged + (1.0 - CONSTANTS.company) * apart, rtol=1e-12)
    assert log_missed(shows, present, present) == pytest.approx(log_silence(shows, present), rel=1e-12)


def test_what_slants_and_a_ceiling_that_slopes_are_as_rare_as_each_other_pitch_by_pitch():
    slanting, sloping, level = ([np.sin(angle), 0.3 * np.sin(angle), np.cos(angle)] for angle in (0.9, 0.35, 0.0))
    place = np.stack([_image(normal, 2.5) for normal in (slanting, sloping, level)])
    spread, cost = np.tile(1e-6 * np.eye(3), (3, 1, 1)), np.ones(3)
    flag, turn = np.zeros(3, dtype=bool), np.tile(np.eye(3), (3, 2, 1, 1))
    trials = SimpleNamespace(is_wall=~flag, is_pair=flag, turn=turn, track=np.zeros(3, dtype=np.int64))
    fits = Fits(place, spread, spread, cost, np.zeros(3), np.zeros(3))
    summary = SimpleNamespace(mean=(np.zeros((1, 3)), TX[None], RX[None]), middle=MIDDLE)
    known = SimpleNamespace(place=np.zeros((0, 3)))
    held = log_upright(SimpleNamespace(trials=trials, kind=np.full(3, WALL)), fits, summary, known, empty_table(), True)
    pitch = np.log(0.5 * np.pi * np.hypot(*(place[:2, :2] - MIDDLE[:2]).T) / 5.0)
    assert np.allclose(held.gain[:2] + pitch, np.log(1.0 - CONSTANTS.upright), atol=1e-4)
    assert held.gain[2] > 0.0
    assert held.log_odds[2] > CONSTANTS.log_born > held.log_odds[1]
    alone = log_upright(
        SimpleNamespace(trials=trials, kind=np.full(3, WALL)), fits, summary, known, empty_table(), False
    )
    assert alone.gain[0] == 0.0


def _map_after(scene: Scene, walk: Trajectory, radio: RadioConfig, seed: int, receiver: ReceiverConfig) -> MapEstimate:
    """Map of the default filter after a walk through a room without a panel."""
    paths, config, rng = ImageSourceChannel(scene, radio, 2).paths(walk), SlamConfig(), np.random.default_rng(seed)
    start = StartPrior(walk.position[0], walk.velocity[0], float(walk.heading[0]))
    state = slam.init(start, walk.body, None, SensorModel(radio), config, rng=rng)
    for cycle, heading in enumerate(walk.heading.tolist()):
        heard, _ = measure(paths.of_cycle(cycle), 0, heading, radio, receiver, rng=rng)
        state, _ = slam.step(state, heard, None, 0.1 if cycle else 0.0, heading, config, rng=rng)
    return slam.estimate(state, config).map


@pytest.mark.parametrize("receiver", [pytest.param("waveform", marks=pytest.mark.slow), "bound"])
def test_a_wall_that_leans_out_is_found_by_what_comes_down_from_the_ceiling(receiver: str) -> None:
    """`wall_y1` leans out by 3.4 degrees: alone it throws its return below the horizon, where nothing is heard."""
    scene, radio = load_scene(ROOMS / "tilted_room"), with_reference_snr(RadioConfig(), 13.0)
    walk = scene.agent[100:130]
    true, heard_by = build_walls(scene), ReceiverConfig(estimator=receiver)
    found = _map_after(replace(scene, ris=None), walk, radio, 2, heard_by).wall_normal
    angle = np.degrees(np.arccos(np.clip(abs(found @ true.normal.T), 0.0, 1.0)))
    assert angle[:, true.names.index("wall_y1")].min() < 2.0
    assert angle.min(axis=1).max() < 10.0


@pytest.mark.parametrize(
    ("receiver", "seed"), [*(pytest.param("waveform", seed, marks=pytest.mark.slow) for seed in (1, 2)), ("bound", 2)]
)
def test_a_beam_before_known_things_is_found_by_what_comes_over_the_ceiling(receiver: str, seed: int) -> None:
    """A beam hangs 0.7 m down from the ceiling before a wall and three spheres, and begins 2 m on: it is never heard by
    itself, and they are known when the return over ceiling and beam begins."""
    room, radio = load_scene(ROOMS / "paper_room"), with_reference_snr(RadioConfig(), 13.0)
    time = 0.1 * np.arange(40)
    place = np.stack([np.full(40, 1.6), 0.8 + time, np.full(40, 0.5)], axis=1)
    walk = Trajectory(time, place, np.tile([0.0, 1.0, 0.0], (40, 1)), np.full(40, np.pi / 2.0 + 0.3), room.agent.body)
    corners = np.array([[3.2, 2.8, 2.3], [3.2, 6.0, 2.3], [3.2, 6.0, 3.0], [3.2, 2.8, 3.0]])
    beam = Reflector("beam", corners, np.array([[0, 1, 2], [0, 2, 3]]), Material(reflection=0.85))
    spheres = (
        replace(room.scatterers[0], name=f"sphere_{row}", position=np.array(spot))
        for row, spot in enumerate([(4.5, 2.0, 1.0), (5.0, 3.5, 1.4), (4.2, 4.6, 0.8)])
    )
    scene = replace(
        room, ris=None, reflectors=(*room.reflectors, beam), scatterers=(*room.scatterers, *spheres), agent=walk
    )
    found = _map_after(scene, walk, radio, seed, ReceiverConfig(estimator=receiver))
    square = np.abs(found.wall_normal).max(axis=1) > np.cos(np.radians(1.0))
    assert square.all()
    assert np.abs(found.wall_offset[found.wall_normal[:, 0] > 0.9] - 3.2).min() < 0.02
