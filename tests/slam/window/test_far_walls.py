"""Far walls: what is heard a period of the sounding too early."""

import numpy as np
import pytest

from rislam_rt import slam
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.measurement import ReceiverConfig, build_sensor, with_reference_snr
from rislam_rt.model import Body, Measurement, RadioConfig
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.observations import free_space
from rislam_rt.slam.predicted_returns import AXES, poses_of

REPEAT = SPEED_OF_LIGHT * 128 / 1e9
"""[m] after which 128 tones over 1 GHz repeat."""
CYCLES, START, SPEED = 40, np.array([14.0, 9.0, 1.1]), np.array([0.08, 0.05, 0.0])
BODY = Body()


def _go(ways, *, seed):
    """The last map of a walk along which these ways over planes (unit normal outwards, offset) are heard."""
    rng, radio, config = np.random.default_rng(seed), with_reference_snr(RadioConfig(), 13.0), SlamConfig()
    sensor = build_sensor(radio, ReceiverConfig())
    state = slam.init(StartPrior(START, SPEED, 0.0), BODY, None, sensor, config, rng=rng)
    for cycle in range(CYCLES):
        poses, images = poses_of(START + 0.1 * cycle * SPEED, np.zeros(()), BODY), []
        for way in ways:
            image = poses.tx
            for normal, offset in way:
                image = image + 2.0 * (offset - normal @ image) * normal
            images.append(image - poses.rx)
        span = np.array(images)
        length = np.linalg.norm(span, axis=1)
        cosines = (span / length[:, None])[:, :2] + 0.004 * rng.standard_normal((len(length), 2))
        heard = length % REPEAT + 0.005 * rng.standard_normal(len(length))
        level = np.exp(free_space(radio) - 0.6 * np.array([len(way) for way in ways])) / length
        every = np.ones(len(length))
        measurement = Measurement(
            heard / SPEED_OF_LIGHT, cosines / np.maximum(np.linalg.norm(cosines, axis=1), 1.0)[:, None], level,
            0.005 / SPEED_OF_LIGHT * every, 0.004 * np.ones((len(length), 2)), 0.03 * level,
        )  # fmt: skip
        state, _ = slam.step(state, measurement, None, 0.1 if cycle else 0.0, 0.0, config, rng=rng)
    return slam.estimate(state, config).map


@pytest.mark.parametrize("seed", [1, *(pytest.param(x, marks=pytest.mark.slow) for x in (2, 3))])
def test_a_wall_a_period_away_is_found_where_it_is(seed):
    # 39.6 m - 14 m: 51 m of way, heard as 12.8, a quarter as loud as a wall in 6.4 m
    far, side, ceiling = (AXES[0], 39.6), (AXES[1], 18.0), (AXES[2], 7.6)
    found = _go([[far], [side], [ceiling], [far, ceiling]], seed=seed)
    along = found.wall_offset[np.abs(found.wall_normal[:, 0]) > 0.9]
    # the first 2 m of speed that is told to 0.01 m/s, and 4 mrad of each look over 25 m
    assert along == pytest.approx([39.6], abs=0.1)
    assert sorted(found.wall_offset[np.abs(found.wall_normal[:, 0]) < 0.1]) == pytest.approx([7.6, 18.0], abs=0.05)
