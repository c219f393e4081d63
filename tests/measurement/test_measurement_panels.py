"""Several panels that take turns: each has signs of its own, and its paths come out apart."""

from dataclasses import replace
from itertools import combinations
from typing import get_args, get_type_hints

import numpy as np
import pytest

from rislam_rt.information import measurement_std
from rislam_rt.measurement import ReceiverConfig, load_signals, measure, signals_dataset
from rislam_rt.measurement.received_paths import receive
from rislam_rt.measurement.slot_motion import code_signs, codes_in_turn, slot_mean, split_by_code
from rislam_rt.model import PathKind, Paths, RadioConfig, Trajectory

RADIO = RadioConfig()
ORDERS = get_args(get_type_hints(ReceiverConfig)["order"])
BOTH = ReceiverConfig(clutter_rate=0.0, alternation=True, panels=2)
UP = (0.3, -0.2, 0.9)
SHIFT = 6.0
"""Doppler shift [Hz] of what nears by 0.09 m/s at both ends."""


def two_panels(make_paths, make_gain, loud: float = 40.0) -> Paths:
    """A wall, a path over each of two panels in one cell with it, and one over the second elsewhere."""
    paths = make_paths([
        (PathKind.VT, 5.0, UP, make_gain(40.0, RADIO, 0.3)),
        (PathKind.RIS, 5.05, UP, make_gain(loud, RADIO, 1.0)),
        (PathKind.RIS, 5.1, UP, make_gain(30.0, RADIO, 2.0)),
        (PathKind.VRIS, 8.0, UP, make_gain(30.0, RADIO, 3.0)),
    ])  # fmt: skip
    return replace(paths, landmark=np.array([-1, 1, 2, 2]), landmarks=("ball", "a", "b"), num_panels=2)


@pytest.mark.parametrize("panels", [1, 2, 3, 5])
def test_signs_of_panels_are_apart_and_even(panels: int) -> None:
    for order in ORDERS:
        signs = code_signs(order, panels)
        assert signs.shape[0] == 1 + panels
        np.testing.assert_array_equal(signs @ signs.T, signs.shape[1] * np.eye(1 + panels))
    for one, other in combinations(code_signs("ABBA", panels), 2):
        np.testing.assert_array_equal(one * other, (one * other)[::-1])
    assert len(codes_in_turn(panels)) == len(code_signs("AB", panels)[0]) >= 1 + panels
    np.testing.assert_array_equal(code_signs("ABBA", 1)[1], [1.0, -1.0, -1.0, 1.0])


@pytest.mark.parametrize("order", ORDERS)
def test_captures_are_sums_over_the_slot_with_the_signs_of_each(make_paths, make_gain, order: str) -> None:
    """Against the sum over 40 000 moments of the slot."""
    config, paths = replace(BOTH, order=order), two_panels(make_paths, make_gain)
    doppler = np.array([0.0, SHIFT, -2.0 * SHIFT, 1.0])
    heard = receive(paths, 0, 0.0, RADIO, config, doppler)
    np.testing.assert_array_equal(heard.panel, [-1, 0, 1, 1])
    time = (np.arange(40_000) + 0.5) / 40_000
    signs = code_signs(order, 2)
    at = signs[:, (time * signs.shape[1]).astype(int)]
    turning = np.exp(2j * np.pi * doppler[:, None] * (time - 0.5) * config.slot)
    for number, capture in enumerate(split_by_code(heard, config)):
        want = np.mean(turning * at[heard.panel + 1] * at[number], axis=1)
        np.testing.assert_allclose(capture.gain, heard.gain * want, atol=1e-6 * np.abs(heard.gain).max())
    first = [abs(slot_mean(np.array([SHIFT]), signs[a] * signs[b], config)[0]) for a, b in ((0, 1), (0, 2), (1, 2))]
    assert max(first) > 0.03 if order == "AB" else max(first) < 0.02


@pytest.mark.parametrize("estimator", ["bound", "waveform"])
def test_each_panel_is_told_from_the_other_and_from_the_wall(make_paths, make_gain, estimator: str) -> None:
    config, paths = replace(BOTH, estimator=estimator, false_alarm_rate=1e-3), two_panels(make_paths, make_gain)
    measurement, truth = measure(paths, 0, 0.0, RADIO, config, rng=np.random.default_rng(2))
    assert sorted(truth.path.tolist()) == [0, 1, 2, 3]
    order = np.argsort(truth.path)
    assert (measurement.from_panel[order][1:] > 0.9).all()
    assert measurement.from_panel[order][0] < 0.1
    np.testing.assert_array_equal(measurement.panel[order][1:], [0, 1, 1])
    # with one sign for both the two that lie in one cell come out as one, of either panel
    lumped, _ = measure(paths, 0, 0.0, RADIO, replace(config, panels=1), rng=np.random.default_rng(2))
    assert lumped.panel is None
    assert np.sum(lumped.from_panel > 0.5) == 2


def test_what_a_fast_path_leaves_in_another_panels_difference_is_not_taken_for_that_panels(
    make_paths, make_gain
) -> None:
    """A path of 55 dB over the second panel, nearing by 0.45 m/s, leaves a third of it in the sum and a tenth in the
    first panel's difference where the order is not gone back: where it comes from is left open, or told."""
    config, rng, leaks = replace(BOTH, order="AB"), np.random.default_rng(3), []
    paths = two_panels(make_paths, make_gain)
    paths = paths.with_gain(np.where(np.arange(4) == 3, make_gain(55.0, RADIO), paths.gain))
    shift = np.array([0.0, 0.0, 0.0, 30.0])
    level = [abs(capture.gain[3]) for capture in split_by_code(receive(paths, 0, 0.0, RADIO, config, shift), config)]
    np.testing.assert_allclose(np.array(level) / abs(make_gain(55.0, RADIO)), [0.44, 0.10, 0.86], atol=0.01)
    for _ in range(20):
        measurement, truth = measure(paths, 0, 0.0, RADIO, config, None, shift, rng=rng)
        faint = (truth.path == 3) & (measurement.amplitude < 0.3 * measurement.amplitude.max())
        leaks += list(zip(measurement.panel[faint], measurement.from_panel[faint], strict=True))
    assert len(leaks) == 20
    assert all(number == 1 and probability > 0.5 for number, probability in leaks)


def test_signals_of_two_panels_name_the_panel_of_every_component(make_paths, make_gain, tmp_path) -> None:
    still = Trajectory(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1))
    config = replace(BOTH, estimator="waveform", false_alarm_rate=1e-3)
    data = signals_dataset(two_panels(make_paths, make_gain), still, RADIO, config, rng=np.random.default_rng(1))
    data.to_netcdf(tmp_path / "signals.nc", engine="h5netcdf")
    loaded = load_signals(tmp_path / "signals.nc")
    assert loaded["samples"].shape[1] == 3
    path = loaded["found_path"].values[0]
    assert sorted(path.tolist()) == [0, 1, 2, 3]
    which = loaded["found_which_panel"].values[0][np.argsort(path)]
    np.testing.assert_array_equal(which[1:], [0, 1, 1])


@pytest.mark.parametrize("panels", [1, 2])
def test_a_panel_that_takes_turns_is_measured_as_well_as_one_that_has_the_slot(make_paths, make_gain, panels) -> None:
    """Sum and differences have the energy and the noise of one sounding: a lone path errs as at the full SNR."""
    paths = make_paths([(PathKind.RIS, 3.0 + i, UP, make_gain(30.0, RADIO, 1.0)) for i in range(20)])
    config = replace(BOTH, estimator="bound", panels=panels)
    rng = np.random.default_rng(5)
    runs = [measure(paths, 0, 0.0, RADIO, config, rng=rng)[0] for _ in range(20)]
    assert all((heard.from_panel > 0.99).all() for heard in runs)
    bound = measurement_std(np.array(1e3), RADIO)
    # a deviation from 400 draws has a relative standard error of 3.5 %: five of them
    tau, cosines = (np.array([getattr(heard, name) for heard in runs]) for name in ("tau", "cosines"))
    assert np.std(tau - paths.tau[0]) == pytest.approx(float(bound.tau), rel=0.18)
    np.testing.assert_allclose(np.std(cosines - paths.arrival[0, :, :2], axis=(0, 1)), bound.cosines, rtol=0.18)
