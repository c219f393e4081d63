"""A filter without a map: the lengths of its tracks tell that it is lost, where nothing else does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt import slam
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import ReceiverConfig, measure, with_reference_snr
from rislam_rt.model import RadioConfig, SensorModel
from rislam_rt.scene import load_scene
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.step_info import StepOutcome

ROOM, CONFIG = Path(__file__).parents[4] / "scenes" / "paper_room", SlamConfig(filter="window", use_vt=False)
COUNT = 50


@pytest.mark.parametrize(("seed", "speed"), [(0, 0.8), (1, 0.8), (2, 0.0), (3, 0.0)])
def test_who_hears_walls_alone_and_sets_off_says_so(seed, speed):
    """In a room of walls alone, whose returns are thrown away, the agent speeds up within 2 s, or is as it was told."""
    rng, time = np.random.default_rng(seed), 0.1 * np.arange(COUNT)
    late = np.clip(time - 1.5, 0.0, 0.5)
    way = 0.1 * time + speed * (late**2 + np.maximum(time - 2.0, 0.0))
    place = np.array([1.2, 3.1, 0.8]) + way[:, None] * [1.0, 0.2, 0.0]
    velocity = np.gradient(place, time, axis=0)
    scene, radio = load_scene(ROOM), with_reference_snr(RadioConfig(), 13.0)
    motion = replace(scene.agent[:COUNT], position=place, velocity=velocity, heading=np.zeros(COUNT))
    paths = ImageSourceChannel(replace(scene, agent=motion, scatterers=(), ris=None), radio, 1).paths(motion)
    start = StartPrior(place[0], velocity[0], 0.0)
    state, lost = slam.init(start, motion.body, None, SensorModel(radio), CONFIG, rng=rng), np.zeros(COUNT, np.bool_)
    for cycle in range(COUNT):
        heard, _ = measure(paths, cycle, 0.0, radio, ReceiverConfig("bound", alternation=False), rng=rng)
        state, info = slam.step(state, heard, None, 0.1 if cycle else 0.0, 0.0, CONFIG, rng=rng)
        lost[cycle] = info.outcome == StepOutcome.DIVERGED
    assert not len(state.landmarks.ident)
    assert lost[40:].all() if speed else not lost.any()  # it went 2.6 m in silence where the tracks were not asked
    assert not lost[:20].any()
