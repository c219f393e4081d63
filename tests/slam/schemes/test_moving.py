"""Both rivals in the setting of the package: both ends move, and the interface is that of its own filter."""

import inspect
from typing import Any

import numpy as np
import pytest
from rooms import BODY, CYCLE, HEADING, RADIO, build_room, measurement_of

from rislam_rt import slam
from rislam_rt.errors import ConfigError
from rislam_rt.model import SensorModel
from rislam_rt.slam import StepOutcome
from rislam_rt.slam.schemes import bp_slam, bp_slam_aoa, channel_slam
from rislam_rt.slam.step_info import REMOVED

SCHEMES = [
    pytest.param(bp_slam, bp_slam.BpSlamConfig(sigma_a=0.01, planes=False), id="bp_slam"),
    pytest.param(channel_slam, channel_slam.ChannelSlamConfig(planes=False), id="channel_slam"),
]


@pytest.mark.parametrize(("scheme", "config"), SCHEMES)
def test_a_short_walk_keeps_to_the_line_that_was_told(scheme: Any, config: Any) -> None:
    """Delays alone do not tell how map and course are turned. How well they tell the way along it stands in
    `tests/studies/unseen/test_every_estimator.py`.
    """
    room, rng = build_room(40, 1), np.random.default_rng(2)
    state = scheme.init(room.start, BODY, None, SensorModel(RADIO), config, rng=rng)
    for cycle, measurement in enumerate(room.measurements):
        dt = CYCLE if cycle else 0.0
        state, info = scheme.step(state, measurement, None, dt, HEADING, config, rng=rng)
        belief = scheme.estimate(state, config)
        assert np.linalg.eigvalsh(belief.covariance)[0] > -1e-12
        assert len(info.landmark) == len(measurement)
        assert np.isfinite([info.nis, info.log_evidence, info.ess]).all()
        way, told = (belief.position - room.start.position)[:2], room.start.velocity[:2]
        off = told[0] * way[1] - told[1] * way[0]
        # mirrored course and map give the same delays: the mean is on the line that was told, up to rounding
        assert abs(off) < 1e-12
    assert info.num_landmarks >= 1
    assert info.outcome == StepOutcome.OK
    assert len(belief.samples) == config.num_samples
    ahead = scheme.predict(state, CYCLE, config)
    assert np.allclose(ahead.position, belief.position + CYCLE * belief.velocity, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(("scheme", "config"), SCHEMES)
def test_direct_path_and_wall_returns_are_set_aside(scheme: Any, config: Any) -> None:
    """By length and by strength; nothing is left, and the filter survives it."""
    room, rng = build_room(1, 1), np.random.default_rng(3)
    state = scheme.init(room.start, BODY, None, SensorModel(RADIO), config, rng=rng)
    bright = measurement_of(np.array([0.1, 3.0, 7.0]), ratio=0.85)
    _, info = scheme.step(state, bright, None, CYCLE, HEADING, config, rng=rng)
    assert np.array_equal(info.landmark, [REMOVED, REMOVED, REMOVED])
    assert info.outcome == StepOutcome.NO_LANDMARKS
    _, info = scheme.step(state, measurement_of(np.zeros(0)), None, CYCLE, HEADING, config, rng=rng)
    assert info.outcome == StepOutcome.NO_MEASUREMENTS


@pytest.mark.parametrize(("scheme", "config"), SCHEMES)
def test_a_known_height_stays(scheme: Any, config: Any) -> None:
    """The filter keeps the height that it was told, exactly."""
    room, rng = build_room(5, 1), np.random.default_rng(4)
    state = scheme.init(room.start, BODY, None, SensorModel(RADIO), config, rng=rng)
    for measurement in room.measurements:
        state, _ = scheme.step(state, measurement, None, CYCLE, HEADING, config, rng=rng)
    assert np.all(scheme.estimate(state, config).samples[:, 2] == room.start.position[2])


@pytest.mark.parametrize(
    ("config", "fields"),
    [
        (bp_slam.BpSlamConfig, "max_features sigma_a detection_probability height wanderers"),
        (channel_slam.ChannelSlamConfig, "max_paths max_misses gate share_threshold height specular_ratio wanderers"),
        (bp_slam_aoa.BpSlamAoaConfig, "max_features sigma_a visible drift_std crowd survival_probability"),
    ],
)
def test_bad_settings_are_named(config: Any, fields: str) -> None:
    """With the names of section and field."""
    section = config.__module__.split(".")[-2]
    for field in fields.split():
        with pytest.raises(ConfigError, match=f"^{section}.{field}"):
            config(**{field: "up" if field == "height" else -1})


@pytest.mark.parametrize("rival", [bp_slam, bp_slam_aoa, channel_slam], ids=lambda rival: rival.__name__)
def test_every_rival_takes_what_the_default_takes(rival: Any) -> None:
    """Names and order of the arguments of the four functions."""
    for function in ("init", "step", "predict", "estimate"):
        own, default = (inspect.signature(getattr(each, function)) for each in (rival, slam))
        assert list(own.parameters) == list(default.parameters)
