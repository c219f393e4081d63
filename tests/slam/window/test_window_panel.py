"""Who the panel is: evidence against quadrature, silence, what alternated codes tell, and whom to suspect."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import rice

from rislam_rt import slam
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.information import amplitude_std
from rislam_rt.measurement import ReceiverConfig, measure, with_reference_snr
from rislam_rt.model import RadioConfig, RisCode, RisSpec, SensorModel
from rislam_rt.ris import rephase
from rislam_rt.scene import load_scene
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.identity import MODEL_ERROR, point_amplitude
from rislam_rt.slam.tracks import OTHER, PANEL, UNTOLD
from rislam_rt.slam.window.levels import LEVELS
from rislam_rt.slam.window.panel import Sight, gains, spread_places, unknown, weigh

SENSOR = SensorModel(RadioConfig(noise_psd=3.52e-12))
SPEC = RisSpec(6, 6, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
PLACE, TX, RX = np.array([[3.0, 3.0, 3.0]]), np.array([[2.0, 2.5, 0.5]]), np.array([[2.1, 2.5, 0.5]])


def _sight(amplitude, side=UNTOLD, seen=True, std=1e-4):
    places = spread_places(PLACE, std**2 * np.eye(3)[None])
    flag = np.array([seen])
    return Sight(places, TX, RX, np.ones(1), np.array([amplitude]), np.array([side]), flag)


def _code(rng):
    return RisCode(rng.integers(4, size=(6, 6)), 4)


def test_one_amplitude_tells_what_quadrature_tells():
    code, radio, noise = _code(np.random.default_rng(1)), SENSOR.radio, amplitude_std(SENSOR.radio)
    sight = _sight(3.0 * noise)
    gain = gains(sight, SPEC, code, radio)
    sight = sight._replace(amplitude=abs(gain).mean(axis=1) + noise)
    found = weigh(unknown(1), sight, gain, SENSOR).log_ris[0] - np.log(LEVELS.panels)
    loud = abs(gain[0])
    spread = np.hypot(noise, MODEL_ERROR * loud)
    panel = np.mean(rice.pdf(sight.amplitude[0], loud / spread, scale=spread))
    # the root of the cross-section is log-normal; far beyond the filter's own grid
    log = np.linspace(np.log(1e-4), np.log(30.0), 4001)
    prior = np.exp(-0.5 * ((log - np.log(LEVELS.strength)) / LEVELS.strength_std) ** 2)
    level = point_amplitude(np.exp(log), np.linalg.norm(PLACE - TX), np.linalg.norm(PLACE - RX), radio)
    width = np.hypot(noise, MODEL_ERROR * level)
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
            level = float(abs(gain[0, 0])) if is_panel else 2.0 * least
            heard = float(np.hypot(level + noise * rng.standard_normal(), noise * rng.standard_normal()))
            belief = weigh(belief, _sight(max(heard, least), seen=heard > least), gain, SENSOR)
        assert (belief.log_ris[0] > 3.0) == is_panel
        assert abs(belief.log_ris[0]) > 3.0


def test_what_is_hidden_tells_nothing_by_silence_and_alternation_excludes():
    code = _code(np.random.default_rng(3))
    gain = 10.0 * gains(_sight(1.0), SPEC, code, SENSOR.radio)
    silent = _sight(1.0, seen=False)
    blocked = unknown(1)._replace(hidden=np.ones((1, 2)))
    assert weigh(blocked, silent, gain, SENSOR).log_ris[0] == pytest.approx(np.log(LEVELS.panels))
    # a panel this loud would have been heard
    assert weigh(unknown(1), silent, gain, SENSOR).log_ris[0] < np.log(LEVELS.panels)
    level = float(abs(gain).mean())
    told = [weigh(unknown(1), _sight(level, side=side), gain, SENSOR).log_ris[0] for side in (OTHER, UNTOLD, PANEL)]
    assert told[0] < np.log(LEVELS.panels) < told[1] < told[2]


def test_panel_is_found_as_soon_as_it_was_heard_six_times():
    """Paper's room, 13 dB, random codes, alternated; until it is named there is a suspect."""
    room, rng, cycles = Path(__file__).parents[3] / "scenes" / "paper_room", np.random.default_rng(4), 18
    scene, radio = load_scene(room), with_reference_snr(RadioConfig(), 13.0)
    motion = scene.agent[:cycles]
    motion = replace(motion, position=motion.position + np.array([1.7, 0.9, 0.4]))
    paths = ImageSourceChannel(replace(scene, agent=motion), radio, 1).paths(motion)
    receiver, config = ReceiverConfig(alternation=True), SlamConfig(filter="window", use_vt=True)
    spec = scene.ris.spec
    sensor = SensorModel(radio, alternation=True)
    start = StartPrior(motion.position[0], motion.velocity[0], float(motion.heading[0]))
    state = slam.init(start, motion.body, spec, sensor, config, rng=rng)
    named, suspected = [], []
    for cycle in range(cycles):
        code = RisCode(rng.integers(spec.levels, size=(spec.rows, spec.cols)), spec.levels)
        here = rephase(paths.of_cycle(cycle), code)
        heading = float(motion.heading[cycle])
        heard, _ = measure(here, 0, heading, radio, receiver, rng=rng)
        state, _ = slam.step(state, heard, code, 0.1 if cycle else 0.0, heading, config, rng=rng)
        found = slam.predict(state, 0.1, config)
        if found.map.ris >= 0:
            named.append(np.linalg.norm(found.map.position[found.map.ris] - scene.ris.center))
        suspected += [np.linalg.norm(one.position - scene.ris.center) for one in found.suspects]
    assert len(named) >= 3
    assert named[-1] < 0.1
    assert len(suspected) >= 2
    assert min(suspected) < 0.5
