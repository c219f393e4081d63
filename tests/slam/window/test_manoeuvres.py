"""An agent that sets off from rest along the walls, with nothing in its map that measures the way."""

from dataclasses import replace
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
from rislam_rt.slam.window.divergence import motion_agreement

ROOM, COUNT = Path(__file__).parents[3] / "scenes" / "paper_room", 28
CONFIG = SlamConfig(filter="window", use_vt=True)
RECEIVER = ReceiverConfig("bound", alternation=False)


@pytest.mark.parametrize(("turned", "seed"), [(0.0, 0), (0.7, 1)], ids=["along the array", "across it"])
def test_who_sets_off_along_the_walls_is_followed(turned, seed):
    """At 1 m/s^2 from rest, before anything is born. Along the walls the array hears ahead and behind alike."""
    scene, rng = load_scene(ROOM), np.random.default_rng(seed)
    time = np.maximum(0.1 * (np.arange(COUNT) - 1), 0.0)
    way = np.where(time < 1.4, 0.5 * time**2, 1.4 * time - 0.98)
    place = np.array([1.2, 3.4, 0.8]) + way[:, None] * [1.0, 0.0, 0.0]
    motion = replace(
        scene.agent[:COUNT], position=place, velocity=np.minimum(time, 1.4)[:, None] * [1.0, 0.0, 0.0],
        heading=np.full(COUNT, turned),
    )  # fmt: skip
    radio = with_reference_snr(RadioConfig(), 13.0)
    paths = without_panel(ImageSourceChannel(replace(scene, agent=motion), radio, 2).paths(motion))
    told = 0.01 * rng.standard_normal(3) * [1.0, 1.0, 0.0]
    state = slam.init(StartPrior(place[0], told, turned), motion.body, None, SensorModel(radio), CONFIG, rng=rng)
    off, square = [], []
    for cycle in range(COUNT):
        heard, _ = measure(paths, cycle, turned, radio, RECEIVER, rng=rng)
        state, _ = slam.step(state, heard, None, 0.1 if cycle else 0.0, turned, CONFIG, rng=rng)
        found = slam.estimate(state, CONFIG)
        error = (found.position - place[cycle])[:2]
        off.append(float(np.linalg.norm(error)))
        square.append(float(error @ np.linalg.solve(found.covariance[:2, :2], error)))
    # held for standing still, it was 2.5 m off, at a claimed 2 cm
    assert max(off[-8:]) < 5e-3
    assert max(square[-8:]) < 9.2  # chi^2, 2 dof: 0.99


@pytest.mark.parametrize("dark", [range(0), range(24, 30)], ids=["heard", "nothing heard for a while"])
def test_steady_motion_is_no_manoeuvre(dark, monkeypatch):
    """At 1 m/s in the paper's room: neither what directions err by nor cycles without components tell of one."""
    scene, rng, count = load_scene(ROOM), np.random.default_rng(3), 38
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
            heard = Measurement(*(np.zeros((0, 2) if at in (1, 4) else 0) for at in range(6)))
        state, _ = slam.step(state, heard, None, 0.1 if cycle else 0.0, 0.2, CONFIG, rng=rng)
    assert len(found) > 8
    assert max(odds for odds, _ in found) < 0.0
