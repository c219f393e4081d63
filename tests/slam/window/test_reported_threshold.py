"""A detection threshold told too high is taken down to what is reported."""

from dataclasses import replace

import numpy as np
import pytest
from lit_candidates import CODES, HERE, SENSOR, SHEET

from rislam_rt import slam
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Body, Measurement
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.reported_threshold import sensor_of_reports


def test_few_below_it_say_nothing():
    """One at any time, or as many as are rare, however faint."""
    loud = np.full(20, 2.0 * SENSOR.threshold)
    for faint, cycles in ((0, 1), (1, 1), (1, 40), (int(CONSTANTS.rare * 800) + 1, 40)):
        heard = [loud.copy() for _ in range(cycles)]
        for number in range(faint):
            heard[number % cycles][number // cycles] = 1e-9
        assert sensor_of_reports(SENSOR, tuple(heard)) is SENSOR


def test_what_has_no_amplitude_says_nothing():
    assert sensor_of_reports(SENSOR, (np.zeros(20),)) is SENSOR


def test_it_is_found_again_from_what_passes_it():
    """Reports of 40 cycles above a threshold of a half: within what is rare, whatever a stray component may be."""
    rng = np.random.default_rng(2)
    snr = np.exp(rng.uniform(np.log(0.5), np.log(50.0), (40, 20))) * SENSOR.threshold
    snr[3, 4] = 0.0
    found = sensor_of_reports(SENSOR, tuple(snr))
    below = (snr < found.threshold).mean()
    assert below == pytest.approx(CONSTANTS.rare, abs=2.0 / snr.size)
    assert 0.5 * SENSOR.threshold < found.threshold < 0.5 * 100.0 ** (2.0 * CONSTANTS.rare) * SENSOR.threshold
    assert replace(found, threshold=SENSOR.threshold) == SENSOR


def test_a_filter_told_too_much_becomes_one_that_is_told_what_is_heard():
    """Components of one SNR: a filter told a higher threshold believes no less of them than one that is told theirs."""
    body, config = Body(), SlamConfig(filter="window")
    snr = 1.2 * SENSOR.threshold
    gain, three = np.sqrt(snr / SENSOR.radio.integrated_snr(np.ones(()))), np.ones(3)
    heard = Measurement(
        np.array([12.0, 15.0, 18.0]) / SPEED_OF_LIGHT, np.array([[0.3, 0.2], [0.1, -0.4], [-0.5, 0.1]]), gain * three,
        1e-10 * three, np.full((3, 2), 0.02), 0.2 * gain * three, 0.999 * three,
    )  # fmt: skip
    found = []
    for threshold in (SENSOR.threshold, snr, 2.0 * snr):
        sensor, rng = replace(SENSOR, threshold=threshold), np.random.default_rng(1)
        state = slam.init(StartPrior(HERE, np.zeros(3), 0.0), body, SHEET, sensor, config, rng=rng)
        for dt in (0.0, 0.1):
            state, _ = slam.step(state, heard, CODES[-1], dt, 0.0, config, rng=rng)
        found.append((state.scene.sensor.threshold, *state.tracks.log_real))
    np.testing.assert_allclose([each[0] for each in found], [SENSOR.threshold, snr, snr])
    np.testing.assert_allclose(found[2], found[1], rtol=1e-9)
    assert (np.array(found[0][1:]) > np.array(found[1][1:])).all()  # noise is rarer the farther above the threshold
