"""Births where the panel's code is held for the whole slot, so that no component tells whether it ran over a panel."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from rislam_rt import slam
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import ReceiverConfig, measure, with_reference_snr
from rislam_rt.model import RadioConfig, RisCode, SensorModel
from rislam_rt.ris import rephase
from rislam_rt.scene import load_scene
from rislam_rt.slam import SlamConfig, StartPrior


def test_walls_louder_than_any_point_are_not_held_for_the_panel_heard_elsewhere():
    """Paper's room, 13 dB: five walls are born within 2 s; held against a scatterer alone, most
    of their tracks seemed to run over the panel."""
    room, rng, cycles = Path(__file__).parents[4] / "scenes" / "paper_room", np.random.default_rng(4), 20
    scene, radio = load_scene(room), with_reference_snr(RadioConfig(), 13.0)
    motion = scene.agent[:cycles]
    motion = replace(motion, position=motion.position + np.array([1.7, 0.9, 0.4]))
    paths = ImageSourceChannel(replace(scene, agent=motion), radio, 1).paths(motion)
    receiver, config = ReceiverConfig(alternation=False, estimator="bound"), SlamConfig(filter="window", use_vt=True)
    spec, sensor = scene.ris.spec, SensorModel(radio)
    start = StartPrior(motion.position[0], motion.velocity[0], float(motion.heading[0]))
    state = slam.init(start, motion.body, spec, sensor, config, rng=rng)
    for cycle in range(cycles):
        code = RisCode(rng.integers(spec.levels, size=(spec.rows, spec.cols)), spec.levels)
        heading = float(motion.heading[cycle])
        heard, _ = measure(rephase(paths.of_cycle(cycle), code), 0, heading, radio, receiver, rng=rng)
        state, _ = slam.step(state, heard, code, 0.1 if cycle else 0.0, heading, config, rng=rng)
    assert len(state.landmarks.walls) >= 5
