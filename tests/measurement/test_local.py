"""The local receiver: the waveform estimator's decisions and bounds without its search."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.measurement import ReceiverConfig, build_sensor, measure
from rislam_rt.measurement.atoms import build_sounding, factors, inner_products
from rislam_rt.measurement.detect import build_grid
from rislam_rt.measurement.estimate import estimate_paths
from rislam_rt.measurement.false_alarms import rim_share
from rislam_rt.measurement.inner import inner_of, waves_at
from rislam_rt.measurement.local import estimate_local
from rislam_rt.model import PathKind, RadioConfig, RxArray

RADIO = RadioConfig()
LOCAL = ReceiverConfig(estimator="local")
WINDOW = (0.0, 80.0)
UP = (0.3, -0.2, 0.9)


def crowd(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Paths of 8 to 40 dB within ten cells of delay, many of them closer than a cell."""
    places = np.column_stack([rng.uniform(5.0, 15.0, count), rng.uniform(-0.7, 0.7, (count, 2))])
    snr = 10.0 ** rng.uniform(0.8, 4.0, count)
    return places, np.sqrt(snr / 2048.0) * np.exp(2j * np.pi * rng.uniform(size=count))


def noise(rng: np.random.Generator) -> np.ndarray:
    return (rng.standard_normal((16, 128)) + 1j * rng.standard_normal((16, 128))) / np.sqrt(2.0)


@pytest.mark.parametrize("array", [RxArray(), RxArray(3, 5, spacing=0.4), RxArray(1, 4)])
@pytest.mark.parametrize("tones", [128, 129])
def test_inner_products_are_those_of_the_signals(array: RxArray, tones: int) -> None:
    """Against the complex ones of `atoms`, to rounding."""
    sounding = build_sounding(tones, RadioConfig(array=array))
    places, _ = crowd(12, np.random.default_rng(1))
    found, wanted = (
        inner_of(sounding, waves_at(sounding, places, np.zeros(12, int))),
        inner_products(factors(sounding, places)),
    )
    np.testing.assert_allclose(found.signal, wanted.signal, atol=1e-9 * sounding.num_samples)
    np.testing.assert_allclose(found.mixed.transpose(1, 0, 2), wanted.mixed, atol=1e-8 * sounding.num_samples)
    np.testing.assert_allclose(found.slope.transpose(0, 2, 1, 3), wanted.slope, atol=1e-8 * sounding.num_samples)


def test_it_finds_what_the_search_finds() -> None:
    """On the same samples of twelve crowds: the same paths at the same places, with the same deviations.

    The search has twelve steps and trials that are spared here: one in ten may come out otherwise. What it finds more
    than a cell from any path is noise, which is not asked for here.
    """
    sounding, rng = build_sounding(128, RADIO), np.random.default_rng(2)
    grid, total, common, ratio = build_grid(sounding, WINDOW), 0, 0, []
    for _ in range(12):
        places, amplitude = crowd(10, rng)
        waves = waves_at(sounding, places, np.zeros(10, int))
        samples = waves.sum(amplitude, 1) + noise(rng)
        search = estimate_paths(sounding, grid, samples[0], 10.0, WINDOW, 40)
        local = estimate_local(sounding, waves, samples, 10.0, WINDOW)
        away = np.abs(search.fit.parameters[:, None] - places) / np.array([1.0, 0.5, 0.5])
        true = away.max(axis=-1).min(axis=1) < 1.0
        gap = np.abs(search.fit.parameters[:, None] - local.parameters) / search.accuracy.parameters[:, None]
        nearest = np.argmin(gap.max(axis=-1), axis=1)
        alike = true & (gap.max(axis=-1)[np.arange(len(nearest)), nearest] < 1.0)
        total, common = total + int(true.sum()), common + int(alike.sum())
        ratio += (local.deviation[nearest[alike]] / search.accuracy.parameters[alike]).ravel().tolist()
    assert total > 90
    assert common > 0.9 * total
    assert np.median(ratio) == pytest.approx(1.0, abs=0.02)


def test_captures_side_by_side_are_captures_alone() -> None:
    sounding, rng = build_sounding(128, RADIO), np.random.default_rng(3)
    places, amplitude = crowd(8, rng)
    alone, samples = [], []
    for _ in range(2):
        waves = waves_at(sounding, places, np.zeros(8, int))
        samples.append((waves.sum(amplitude, 1) + noise(rng))[0])
        alone.append(estimate_local(sounding, waves, samples[-1][None], 10.0, WINDOW))
    side = np.repeat([0, 1], 8)
    both = estimate_local(sounding, waves_at(sounding, np.tile(places, (2, 1)), side), np.array(samples), 10.0, WINDOW)
    for number, one in enumerate(alone):
        mine = both.capture == number
        np.testing.assert_allclose(np.sort(both.parameters[mine][:, 0]), np.sort(one.parameters[:, 0]), rtol=1e-6)


@pytest.mark.parametrize("alternation", [False, True])
def test_false_components_come_at_the_rate_of_the_sensor(make_paths, alternation: bool) -> None:
    config = replace(LOCAL, alternation=alternation)
    sensor, rng = build_sensor(RADIO, config), np.random.default_rng(4)
    found = [measure(make_paths([]), 0, 0.0, RADIO, config, rng=rng)[0] for _ in range(100)]
    count = np.mean([len(m) for m in found])
    # 100 cycles of a Poisson rate
    assert count == pytest.approx(sensor.false_alarms, abs=5.0 * np.sqrt(sensor.false_alarms / 100))
    edge = np.mean(np.linalg.norm(np.concatenate([m.cosines for m in found]), axis=1) > 1.0 - 1e-9)
    assert edge == pytest.approx(rim_share(sensor.threshold, RADIO, 80e-9), abs=0.2)


def test_level_returns_can_come_out_on_the_other_side(make_paths, make_gain) -> None:
    """Half a wavelength apart the elements cannot tell u = 1 from u = -1: some do, and are as unsure as that."""
    paths = make_paths([(PathKind.VT, 5.0, (0.995, 0.1, 0.0), make_gain(15.0, RADIO))])
    rng, sides = np.random.default_rng(5), []
    for _ in range(120):
        measurement, truth = measure(paths, 0, 0.0, RADIO, LOCAL, rng=rng)
        for row in np.flatnonzero(truth.path == 0):
            sides.append((measurement.cosines[row, 0], measurement.cosines_std[row, 0]))
    cosine, deviation = np.array(sides).T
    assert 0.02 < np.mean(cosine < 0.0) < 0.6
    assert (deviation[cosine < 0.0] > 0.3).mean() > 0.8


def test_two_paths_too_close_come_out_as_one_between_them(make_paths, make_gain) -> None:
    gap = 0.03
    paths = make_paths([
        (PathKind.VT, 5.0, UP, make_gain(25.0, RADIO)), (PathKind.PS, 5.0 + gap, UP, make_gain(25.0, RADIO)),
    ])  # fmt: skip
    rng, config = np.random.default_rng(6), replace(LOCAL, false_alarm_rate=1e-3)
    lengths = [measure(paths, 0, 0.0, RADIO, config, rng=rng)[0].tau * 299_792_458.0 for _ in range(60)]
    assert np.mean([len(one) == 1 for one in lengths]) > 0.95
    mean = np.mean([one[0] for one in lengths])
    assert mean == pytest.approx(5.0 + 0.5 * gap, abs=0.005)  # two of 25 dB: 5 mm deviation of one, 60 of them
