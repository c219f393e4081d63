"""Codes of the policies against other codes; classes of components against the paths' own walls."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import ReceiverConfig
from rislam_rt.model import PathKind, RadioConfig, RisCode, Trajectory
from rislam_rt.ris import rephase
from rislam_rt.scene import load_scene
from rislam_rt.studies.classifier.training_examples import CLUTTER, OVER_RX, OVER_TX, gather_walk
from rislam_rt.studies.classifier.walks import POLICIES, set_codes

ROOM = Path(__file__).parents[3] / "scenes" / "paper_room"


@pytest.fixture(scope="module")
def walked():
    """The panel, a walk of ten seconds, looked at four times, and its paths."""
    scene = load_scene(ROOM)
    agent, rows = scene.agent, slice(0, 100, 25)
    motion = Trajectory(agent.time[rows], agent.position[rows], agent.velocity[rows], agent.heading[rows], agent.body)
    return scene.ris.spec, motion, ImageSourceChannel(scene, RadioConfig(), depth=2).paths(motion)


def panel_gain(paths):
    return np.abs(paths.gain[:, np.flatnonzero(paths.kind == PathKind.RIS)[0]])


def test_the_best_code_is_the_best_and_the_aimed_one_is_it_in_the_middle(walked):
    """Gains from the responses themselves; the aimed code is as good in the cycle in the middle, and no better in
    any."""
    panel, _, paths = walked
    rng = np.random.default_rng(1)
    gain = {name: panel_gain(set_codes(paths, panel, name, rng=rng)) for name in POLICIES}
    best = set_codes(paths, panel, "exact", rng=rng)
    assert gain["aimed"][2] == pytest.approx(gain["exact"][2], rel=1e-12)
    for name in ("random", "held", "aimed"):
        assert (gain[name] <= gain["exact"] * (1.0 + 1e-12)).all()
    assert (gain["held"] < 0.9 * gain["exact"]).all()
    column = int(np.flatnonzero(best.kind == PathKind.RIS)[0])
    response = (best.ris.tx[:, best.ris.tx_leg[column]] * best.ris.rx[:, best.ris.rx_leg[column]]).reshape(4, -1)
    index = rng.integers(panel.levels, size=(4, panel.rows, panel.cols))
    flat = index.reshape(4, -1)
    other = np.abs(np.sum(response * np.exp(-2j * np.pi / panel.levels * flat), axis=1))
    assert other == pytest.approx(panel_gain(rephase(paths, RisCode(index, panel.levels))), rel=1e-9)
    assert (other < gain["exact"]).all()


def test_a_random_code_is_new_each_cycle_and_a_held_one_is_not(walked):
    panel, _, paths = walked
    held = set_codes(paths, panel, "held", rng=np.random.default_rng(2))
    again = set_codes(paths, panel, "held", rng=np.random.default_rng(2))
    assert (panel_gain(held) == panel_gain(again)).all()
    fixed = np.random.default_rng(2).integers(panel.levels, size=(panel.rows, panel.cols))
    assert panel_gain(held) == pytest.approx(panel_gain(rephase(paths, RisCode(fixed, panel.levels))), rel=1e-12)
    changing = np.random.default_rng(2).integers(panel.levels, size=(4, panel.rows, panel.cols))
    random = set_codes(paths, panel, "random", rng=np.random.default_rng(2))
    assert panel_gain(random) == pytest.approx(panel_gain(rephase(paths, RisCode(changing, panel.levels))), rel=1e-12)
    assert set_codes(paths, None, "exact", rng=np.random.default_rng(2)) is paths


def test_examples_have_the_class_of_their_path(walked):
    """Every look is at a path whose own identity says so: kinds and legs that are there, LOS near, wall returns far."""
    panel, motion, paths = walked
    lit = set_codes(paths, panel, "exact", rng=np.random.default_rng(3))
    receiver = ReceiverConfig(clutter_rate=2.0)
    found = gather_walk(lit, motion, RadioConfig(), receiver, (7, 3), 1, rng=np.random.default_rng(4))
    there = {
        (int(kind), OVER_RX * int((rx >= 0).any()) + OVER_TX * int((tx >= 0).any()) if kind >= PathKind.PS else 0)
        for kind, tx, rx in zip(paths.kind, paths.tx_walls, paths.rx_walls, strict=True)
    }
    assert set(zip(found.kind.tolist(), found.legs.tolist(), strict=True)) <= there | {(CLUTTER, 0)}
    assert {(3, OVER_RX), (3, OVER_TX), (4, 0)} <= set(zip(found.kind.tolist(), found.legs.tolist(), strict=True))
    assert found.near[found.kind == PathKind.LOS].all()
    assert not found.near[found.kind == PathKind.VT].any()
    assert (found.age[~found.near] >= 1).all()
    assert set(found.walk) == {7}
    assert set(found.policy) == {3}
