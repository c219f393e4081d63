"""A walk in the paper's room, at the moment when the last cycle's components are explained and births are next."""

from dataclasses import fields, replace
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
from rislam_rt.slam.window import filter as window_filter

ROOM, COUNT, TURNED = Path(__file__).parents[4] / "scenes" / "paper_room", 25, 0.32


def without(heard, rows):
    """The measurement without some of its components."""
    return Measurement(*(getattr(heard, one.name)[~rows] for one in fields(heard)[:6]))


def walk(silent=()):
    """State, true positions (K, 3), association and residuals after 25 cycles of a level walk, before births, in which
    the path heard with the most amplitude of all but the direct one is not heard in the cycles `silent`."""
    scene, rng = load_scene(ROOM), np.random.default_rng(0)
    place = np.array([1.2, 2.4, 0.8]) + np.arange(COUNT)[:, None] * [0.06, 0.02, 0.0]
    velocity = np.tile([0.6, 0.2, 0.0], (COUNT, 1))
    motion = replace(scene.agent[:COUNT], position=place, velocity=velocity, heading=np.full(COUNT, TURNED))
    radio, loudest, config = with_reference_snr(RadioConfig(), 13.0), -1, SlamConfig(filter="window", use_vt=True)
    paths = without_panel(ImageSourceChannel(replace(scene, agent=motion), radio, 2).paths(motion))
    start = StartPrior(place[0], velocity[0], TURNED)
    state, last = slam.init(start, motion.body, None, SensorModel(radio), config, rng=rng), []
    with pytest.MonkeyPatch.context() as patch:
        ends = window_filter.remove_or_add_features
        patch.setattr(window_filter, "remove_or_add_features", lambda *given: last.append(given) or ends(*given))
        for cycle in range(COUNT):
            heard, truth = measure(paths, cycle, TURNED, radio, ReceiverConfig("bound", alternation=False), rng=rng)
            loudest = loudest if cycle else truth.path[np.argsort(heard.amplitude)[-2]]
            if cycle in silent:
                heard = without(heard, truth.path == loudest)
            state, _ = slam.step(state, heard, None, 0.1 * (cycle > 0), TURNED, config, rng=rng)
    before, left, view = last[-1]
    return before, place, view, left


@pytest.fixture(scope="session")
def walked():
    return walk()


@pytest.fixture(scope="session")
def interrupted():
    """A walk in which one path is silent while it would have been born."""
    return walk(silent=range(4, 10))
