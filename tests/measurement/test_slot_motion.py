"""Motion within the slot: against the paths a moment later, and what the receiver makes of what it leaves."""

from dataclasses import replace
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest

from rislam_rt.arrays import take_rows
from rislam_rt.channel.doppler import doppler_shift, turn_rate
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.measurement import ReceiverConfig, measure, receive, slot_motion
from rislam_rt.measurement.components import ReportedComponents
from rislam_rt.measurement.panel_probability import panel_probability
from rislam_rt.measurement.slot_motion import code_signs, slot_mean, slot_weights, split_by_code
from rislam_rt.model import PathKind, RadioConfig, RxArray
from rislam_rt.scene import load_scene

ROOM = Path(__file__).parents[2] / "scenes" / "paper_room"
RADIO = RadioConfig()
ORDERS = get_args(get_type_hints(ReceiverConfig)["order"])
SPLIT = ReceiverConfig(clutter_rate=0.0, alternation=True)
UP = (0.3, -0.2, 0.9)
FASTEST = 0.2 / RADIO.wavelength
"""Doppler shift [Hz] of a return from ahead at 0.1 m/s."""


@pytest.mark.parametrize("order", ["AB", "ABBA"])
@pytest.mark.parametrize("dwell", [0.0, 50e-6])
def test_weights_are_means_over_the_slot(order: str, dwell: float) -> None:
    """Against the sum over 40 000 moments of the slot: 1e-4 of a turn apart."""
    config = replace(SPLIT, order=order, code_dwell=dwell)
    time = (np.arange(40_000) + 0.5) / 40_000 * config.slot
    length = dwell or config.slot / len(order)
    sign = code_signs(order, 1)[1][(time // length).astype(int) % len(order)]
    for shift in (0.0, 1.0, FASTEST, 40.0):
        turning = np.exp(2j * np.pi * shift * (time - 0.5 * config.slot))
        plain, signed = slot_weights(np.array([shift]), config)
        assert plain[0] == pytest.approx(np.mean(turning), abs=1e-6)
        assert signed[0] == pytest.approx(np.mean(sign * turning), abs=1e-3 if dwell else 1e-6)


def test_weights_are_those_of_the_paths_a_moment_later() -> None:
    """Geometry moved on by quarters of the slot, exactly: what the linear phase leaves out is a thousandth."""
    scene = load_scene(ROOM)
    assert scene.ris is not None
    motion = scene.agent[::60]
    channel = ImageSourceChannel(scene, RADIO, 2)
    paths = channel.paths(motion)
    config = replace(SPLIT, slot=0.012)
    later = []
    for time in (np.arange(4) - 1.5) * config.slot / 4.0:
        position, heading = motion.position + time * motion.velocity, motion.heading + time * turn_rate(motion)
        moved_paths = channel.paths(replace(motion, position=position, heading=heading))
        for own in ("kind", "landmark", "tx_walls", "rx_walls"):  # the same paths in the same columns
            np.testing.assert_array_equal(getattr(moved_paths, own), getattr(paths, own))
        later.append(moved_paths.gain)
    shift = doppler_shift(paths, motion, RADIO.wavelength)
    for order in ("AB", "ABBA"):
        signs = np.repeat(code_signs(order, 1)[1], 4 // len(order))
        moved = np.einsum("q,qkp->kp", signs, np.array(later)) / 4.0
        for cycle in range(len(motion)):
            # in the sidelobes of a panel under a fixed code the gain itself changes within millimetres
            heard = paths.valid[cycle] & (np.array(later)[:, cycle] != 0.0).all(axis=0) & (paths.kind < PathKind.RIS)
            _, signed = slot_weights(shift[cycle], replace(config, order=order))
            ratio = moved[cycle, heard] / paths.gain[cycle, heard]
            # and the turning within a quarter, 0.06 rad, which the moments leave out: its square over 24
            np.testing.assert_allclose(ratio, signed[heard], atol=5e-4)


def test_in_turn_and_back_cancels_what_moves_evenly() -> None:
    leak = {order: abs(slot_weights(np.array([FASTEST]), replace(SPLIT, order=order))[1][0]) for order in ORDERS}
    assert leak["AB"] == pytest.approx(np.pi * FASTEST * 0.005, rel=0.02)
    assert leak["ABBA"] == pytest.approx((np.pi * FASTEST * 0.005) ** 2 / 2.0, rel=0.02)
    fast = abs(slot_weights(np.array([FASTEST]), replace(SPLIT, order="ABBA", code_dwell=5e-6))[1][0])
    assert fast < 1e-6


@pytest.mark.parametrize("estimator", ["bound", "waveform"])
def test_a_moving_wall_leaks_into_the_difference_and_is_told_from_the_panel(
    make_paths, make_gain, estimator: str
) -> None:
    """A wall of 40 dB leaves 20 dB with two codes; beside another the panel, of 20 dB as well, of any phase."""
    config = replace(SPLIT, estimator=estimator, order="AB")
    rng, leaks, panels = np.random.default_rng(1), [], []
    for _ in range(30):
        phase = 2.0 * np.pi * rng.uniform(size=2)
        paths = make_paths(
            [
                (PathKind.VT, 5.0, UP, make_gain(40.0, RADIO, phase[0])),
                (PathKind.VT, 8.0, UP, make_gain(40.0, RADIO, phase[0])),
                (PathKind.RIS, 8.1, UP, make_gain(20.0, RADIO, phase[1])),
            ]
        )
        shift = np.array([FASTEST, 0.1 * FASTEST, 0.1 * FASTEST])
        measurement, truth = measure(paths, 0, 0.0, RADIO, config, None, shift, rng=rng)
        weak = measurement.amplitude < 0.3 * measurement.amplitude.max()
        leaks += measurement.from_panel[(truth.path == 0) & weak].tolist()
        panels += measurement.from_panel[(truth.path == 2) & weak].tolist()
    assert len(leaks) > 25
    assert len(panels) > 25
    assert np.mean(leaks) < 0.1
    assert np.mean(panels) > 0.65  # some have the phase of a leak
    # nothing of it with the order reversed half-way
    paths = make_paths([(PathKind.VT, 5.0, UP, make_gain(40.0, RADIO))])
    config = replace(config, order="ABBA", false_alarm_rate=1e-3)
    measurement, _ = measure(paths, 0, 0.0, RADIO, config, None, np.array([FASTEST]), rng=rng)
    assert len(measurement) == 1


@pytest.mark.parametrize(("rows", "cols"), [(4, 4), (4, 5), (5, 4)])
def test_a_leak_at_the_opposite_rim_of_the_disc_is_told_from_the_panel(make_paths, make_gain, rows, cols) -> None:
    """A level return of 45 dB leaves 12 dB with codes in turn and back: as likely beyond the rim as within, where an
    array of half a wavelength hears the opposite rim."""
    radio = RadioConfig(array=RxArray(rows=rows, cols=cols))
    config = replace(SPLIT, estimator="waveform")
    doppler = 0.4 / radio.wavelength
    leaves = np.abs(np.divide(*np.ravel(slot_weights(np.array([doppler]), config))[::-1]))
    assert 1.5 < np.log10(1.0 / leaves) < 1.8
    rng, told, across = np.random.default_rng(3), [], 0
    for _ in range(40):
        along = np.array([-0.975, -0.22]) * rng.choice([-1.0, 1.0], 2)
        level = (*along[:: rng.choice([-1, 1])], 0.03)
        paths = make_paths([(PathKind.VT, 4.4, level, make_gain(45.0, radio, 2.0 * np.pi * rng.uniform()))])
        measurement, _ = measure(paths, 0, 0.0, radio, config, None, np.array([doppler]), rng=rng)
        near = np.abs(measurement.tau * SPEED_OF_LIGHT - 4.4) < 0.3
        weak = near & (measurement.amplitude < 0.1 * measurement.amplitude.max())
        across += np.count_nonzero(measurement.cosines[weak] @ level[:2] < 0.0)
        told += measurement.from_panel[weak].tolist()
    assert len(told) > 25
    assert across > 5
    assert np.mean(told) < 0.1  # before: 0.23 to 0.43


def test_a_mean_over_the_slot_is_taken_once_for_paths_and_captures_that_share_it(monkeypatch, make_paths, make_gain):
    """The sum weighs walls as a panel's difference weighs the panel: two means for four pairs."""
    asked = []

    def counted(doppler, signs, config):
        asked.append(signs)
        return slot_mean(doppler, signs, config)

    monkeypatch.setattr(slot_motion, "slot_mean", counted)
    paths = make_paths(
        [(PathKind.VT, 7.0, UP, make_gain(20.0, RADIO)), (PathKind.RIS, 6.0, UP, make_gain(20.0, RADIO))]
    )
    heard = receive(paths, 0, 0.0, RADIO, SPLIT, np.array([FASTEST, FASTEST]))
    common, difference = split_by_code(heard, SPLIT)
    assert len(asked) == 2
    plain, signed = slot_weights(np.array([FASTEST]), SPLIT)
    np.testing.assert_allclose(common.gain / heard.gain, [plain[0], signed[0]])
    np.testing.assert_allclose(difference.gain / heard.gain, [signed[0], plain[0]])


@pytest.mark.parametrize("top_speed", [0.5, 1.5])
def test_probability_of_the_panel_is_the_frequency_with_which_it_was_the_panel(top_speed: float) -> None:
    """A wall's path or the panel's, of any Doppler shift up to a largest speed's, heard in both captures or in one: at
    1.5 m/s they turn by up to a whole turn within the slot, and either capture may hold the louder part."""
    config, rng = replace(SPLIT, top_speed=top_speed), np.random.default_rng(1)
    told, true = [], []
    for _ in range(1500):
        shift = rng.uniform(-1.0, 1.0) * rng.uniform() * 2.0 * top_speed / RADIO.wavelength
        panel = bool(rng.integers(2))
        weights = np.ravel(slot_weights(np.array([shift]), config))[:: -1 if panel else 1]
        noise = rng.standard_normal((2, 2)) @ [1.0, 1j] / np.sqrt(2.0)
        gain = 10.0 ** rng.uniform(0.0, 3.0) * np.exp(2j * np.pi * rng.uniform()) * weights + noise
        heard = np.abs(gain) ** 2 > 10.0
        if not heard.any():
            continue
        std = np.array([1e-9, 0.5, 0.5]) / np.abs(gain[:, None])
        found = ReportedComponents(
            np.zeros(2, dtype=np.int64), [30e-9, 0.1, 0.2] + std * rng.standard_normal((2, 3)), std, gain, np.ones(2),
            np.arange(2),
        )  # fmt: skip
        probability, _ = panel_probability(take_rows(found, heard), RADIO, config)
        told.append(probability[np.argmax(np.abs(gain[heard]))])
        true.append(panel)
    told, true = np.array(told), np.array(true)
    for low, high in ((0.0, 0.05), (0.05, 0.3), (0.3, 0.7), (0.7, 0.95), (0.95, 1.0)):
        some = (told >= low) & (told <= high)
        count, expected = np.count_nonzero(some), told[some]
        if count:  # three standard deviations of such a count, and what the shifts' steps leave out
            spread = np.sqrt(np.mean(expected * (1.0 - expected)) / count)
            assert abs(true[some].mean() - expected.mean()) < 3.0 * spread + 0.03
    assert np.mean((told > 0.5) != true) < 0.08  # before, each of a pair was held for what is left of the other: 0.27
