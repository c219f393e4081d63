"""Filter, rivals and receiver reckon with one threshold and one rate of false alarms unless they are told otherwise."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.measurement import ReceiverConfig, build_sensor, measure
from rislam_rt.model import Body, PathKind, Paths, RadioConfig, SensorModel
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.specification.pipeline_spec import Settings, build_settings
from rislam_rt.slam import StartPrior
from rislam_rt.slam.observations import observations_of, stranger_density
from rislam_rt.slam.schemes.bp_slam.filter import assumed_odds
from rislam_rt.slam.window import WindowState

PIPELINE = Path(__file__).parents[2] / "pipelines" / "trace_then_slam.toml"
RECEIVERS = (
    [],
    ["receiver.false_alarm_rate=0.01"],
    ["receiver.detection_threshold_db=14.0", "receiver.clutter_rate=3.0"],
    ["receiver.estimator=waveform"],
)


def settings_of(words: list[str]) -> Settings:
    return build_settings(load_spec(PIPELINE, words))


def begin(settings: Settings, scheme: str, sensor: SensorModel) -> WindowState:
    """The filter as a run begins it."""
    estimator, start = ESTIMATORS[scheme], StartPrior(np.array([1.0, 1.0, 0.5]), np.array([0.1, 0.0, 0.0]), 0.0)
    body = Body(np.array([-0.05, 0.0, 0.0]), np.array([0.05, 0.0, 0.0]))
    state = estimator.init(start, body, None, sensor, estimator.config(settings), rng=np.random.default_rng(0))
    assert isinstance(state, WindowState)
    return state


def faint_paths(radio: RadioConfig, threshold: float) -> Paths:
    """Forty paths far from each other, about as strong as the threshold."""
    count, amplitude = 40, np.sqrt(threshold * radio.noise_psd / (radio.array.num_antennas * radio.energy))
    up = np.broadcast_to(np.array([0.3, -0.2, 0.933]), (1, count, 3))
    return Paths(
        kind=np.full(count, int(PathKind.PS)),
        landmark=np.zeros(count, np.int64),
        tx_walls=np.full((count, 1), -1),
        rx_walls=np.full((count, 1), -1),
        valid=np.ones((1, count), bool),
        tau=(2.0 + 0.5 * np.arange(count))[None] / SPEED_OF_LIGHT,
        departure=up,
        arrival=up,
        gain=np.full((1, count), amplitude, complex),
        vertices=np.zeros((1, count, 1, 3)),
        num_vertices=np.ones(count, np.int64),
        walls=("wall",),
        landmarks=("ball",),
    )


@pytest.mark.parametrize("words", RECEIVERS)
def test_the_filter_reckons_with_the_threshold_that_the_receiver_applies(words: list[str]) -> None:
    """The faintest of some 400 components that the receiver reports lies just above what the filter expects.

    Measured SNRs about the threshold t have a density of 0.28 / sqrt(t) a unit at least: of 400, the lowest lies within
    a tenth of t all but surely.
    """
    settings = settings_of(words)
    paths = faint_paths(settings.radio, settings.sensor.threshold)
    receiver = replace(settings.receiver, estimator="bound")  # the waveform's threshold is the same number
    heard = [
        measure(paths, 0, 0.0, settings.radio, receiver, rng=np.random.default_rng(seed))[0].amplitude
        for seed in range(20)
    ]
    faintest = float(settings.radio.integrated_snr(np.concatenate(heard)).min())
    state = begin(settings, "slam", settings.sensor)
    assert state.scene.sensor.threshold <= faintest * (1.0 + 1e-9)
    assert state.scene.sensor.threshold == pytest.approx(faintest, rel=0.1)


@pytest.mark.parametrize(("words", "level"), [([], 12.16), (["receiver.alternation=false"], 11.96)])
def test_a_rate_of_false_alarms_moves_the_threshold_of_both(words: list[str], level: float) -> None:
    """METHOD: one false component in a hundred cycles takes 12 dB; of two captures each may have half of it."""
    sensor = settings_of(["receiver.false_alarm_rate=0.01", *words]).sensor
    assert 10.0 * np.log10(sensor.threshold) == pytest.approx(level, abs=0.01)
    assert settings_of([]).sensor.threshold == pytest.approx(10.0)


def test_what_is_told_wrong_is_believed() -> None:
    settings = settings_of([])
    state = begin(settings, "slam", replace(settings.sensor, threshold=20.0))
    assert state.scene.sensor.threshold == 20.0
    assert settings.sensor.threshold == pytest.approx(10.0)


@pytest.mark.parametrize("rate", [0.5, pytest.param(5.0, marks=pytest.mark.slow)])
def test_filter_and_rival_expect_the_false_components_that_the_receiver_makes(rate: float) -> None:
    """Density of strangers without new paths, over the volume in which components lie, against a count."""
    config, radio = ReceiverConfig(estimator="bound", clutter_rate=rate), RadioConfig()
    sensor, rng = build_sensor(radio, config), np.random.default_rng(3)
    false = [measure(faint_paths(radio, 0.0), 0, 0.0, radio, config, rng=rng)[0] for _ in range(400)]
    count = np.mean([len(m) for m in false])
    # 400 cycles of a Poisson rate
    assert count == pytest.approx(rate, abs=5.0 * np.sqrt(rate / 400))
    # the mean of one over the density of what is drawn is the volume that it is drawn from, over the rate
    glances = [observations_of(m, radio, Body()) for m in false]
    inverse = np.concatenate([1.0 / stranger_density(g, sensor, 0.0) for g in glances])
    level = 0.5 * np.log(sensor.threshold)
    strong = np.concatenate([g.log_amplitude for g in glances]) - 0.5 * np.log(radio.integrated_snr(np.ones(1)))
    assert (strong + np.log(radio.integrated_snr(np.ones(1))) >= level - 1e-9).all()
    volume = np.pi * 80e-9 * SPEED_OF_LIGHT
    near = np.concatenate([radio.integrated_snr(m.amplitude) for m in false]) < sensor.threshold + 1.0
    span = 0.5 * np.log1p(1.0 / sensor.threshold)
    # importance sampling over the first unit of SNR above the threshold: some 130 draws, each within a factor e
    assert np.sum(inverse[near]) / len(inverse) * rate == pytest.approx(volume * span, rel=0.25)
    assert assumed_odds(settings_of([]).bp_slam, sensor).clutter_density == pytest.approx(
        rate / (80e-9 * SPEED_OF_LIGHT)
    )
