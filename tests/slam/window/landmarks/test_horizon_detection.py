"""Whether returns arrive above the plane of an array that looks up, while the body sways."""

import numpy as np
import pytest

from rislam_rt.slam.window.landmarks import horizon_detection as horizon
from rislam_rt.slam.window.smoother import attitude

AROUND = 2.0 * np.pi * (np.arange(12) + 0.5) / 12
COSINES = np.stack([np.cos(AROUND), np.sin(AROUND)], axis=1)
LEVEL = horizon.elevations(np.zeros(12), np.full(12, 0.01), COSINES)
SURE = LEVEL._replace(std=np.zeros(12))


def swaying(level):
    """Level probabilities (2, L) of a body that sways by the deviation number `level`, with a compass."""
    return np.tile(np.eye(len(attitude.levels()))[level], (2, 1))


def test_a_body_that_does_not_sway_hears_all_and_one_that_does_half_of_what_is_level():
    nothing = horizon.nothing_heard(12)
    still = attitude.tilts(swaying(0), None)
    np.testing.assert_allclose(horizon.expected_above(SURE, nothing, still), 1.0, atol=1e-6)
    lively = attitude.tilts(swaying(4), None)
    np.testing.assert_allclose(horizon.expected_above(SURE, nothing, lively), 0.5, atol=0.08)
    high = horizon.elevations(np.full(12, 0.2), np.full(12, 0.01), COSINES)
    np.testing.assert_array_equal(horizon.expected_above(high, nothing, lively), 1.0)


def test_a_known_tilt_decides_as_its_lift_does_and_an_uncertain_one_by_the_normal_law():
    lift, nothing = LEVEL.slopes @ [0.006, -0.002], np.full(12, 1e-12)
    np.testing.assert_allclose(horizon.above_within(SURE, lift, nothing), lift > -horizon.GRAZING, atol=1e-3)
    wide = horizon.above_within(SURE, np.full(12, -horizon.GRAZING), np.full(12, 0.01**2))
    np.testing.assert_allclose(wide, 0.5, atol=0.02)


def weighed(tilt, probability):
    """What a cycle tells in which all level returns that a body of this tilt (2,) hears are heard, and no others."""
    heard, every = LEVEL.slopes @ tilt > -horizon.GRAZING, np.ones(12, dtype=np.bool_)
    tilts = attitude.tilts(attitude.foreseen(probability), None)
    return heard, horizon.weigh_tilts(SURE, horizon.nothing_heard(12), 0.95 * every, every, heard, tilts)


def test_silence_on_one_side_tells_the_tilt_and_the_tilt_excuses_the_silence():
    tilt, first = np.array([0.008, 0.003]), attitude.first_levels(compass=True)
    heard, found = weighed(tilt, first)
    level = found.tilts.weight.sum(axis=1)
    assert level[2:].sum() > 0.99 > first[0, 2:].sum()
    assert found.above[heard].min() > 0.5 > found.above[~heard].max()
    assert found.gain > 1.0  # all under one tilt are likelier than each under its own
    mean = np.tensordot(found.tilts.weight, found.tilts.point, 2)
    assert mean @ tilt > 0.8 * np.linalg.norm(mean) * np.linalg.norm(tilt)


def test_a_body_that_hears_all_is_still_and_all_stays_expected():
    probability = attitude.first_levels(compass=True)
    for _ in range(5):
        heard, found = weighed(np.zeros(2), probability)
        probability[0] = found.tilts.weight.sum(axis=1)
    assert heard.all()
    assert probability[0, :2].sum() > 0.98
    assert found.above.min() > 0.98


@pytest.mark.parametrize("rise", [0.0, 0.02])
def test_when_a_path_is_heard_tells_how_high_it_comes_in(rise):
    """Its own elevation is unknown to 10 mrad; the tilts are told by others."""
    rng, one = np.random.default_rng(2), np.ones(1, dtype=np.bool_)
    path = horizon.elevations(np.full(1, 0.01), np.full(1, 0.01), COSINES[:1])
    log_like, still = horizon.nothing_heard(1), np.zeros((5, 32))
    still[3] = 1.0 / 32
    for _ in range(60):
        tilt = 0.009 * rng.standard_normal(2)
        heard = path.slopes @ tilt + rise > -horizon.GRAZING
        tilts = attitude.Tilts(np.tile(tilt, (5, 32, 1)), still)
        log_like = horizon.weigh_tilts(path, log_like, 0.95 * one, one, heard, tilts).log_like
    low = attitude.Tilts(np.full((5, 32, 2), path.slopes[0] * -0.006), still)
    found = horizon.expected_above(path, log_like, low)[0]
    assert found == pytest.approx(float(rise > 0.006), abs=0.05)


def test_what_may_be_another_return_rules_nothing_out():
    every, tilts = np.ones(12, dtype=np.bool_), attitude.tilts(swaying(4), None)
    found = horizon.weigh_tilts(SURE, horizon.nothing_heard(12), 0.95 * every, every, every, tilts)
    assert np.isfinite(found.log_like).all()
    assert np.isfinite(found.gain)
