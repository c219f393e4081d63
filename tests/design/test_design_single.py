"""The exact single-target optimum against brute force, and the order of what it is held against."""

import numpy as np
import pytest

from rislam_rt.design import continuous_phases, exact_code, nearest_code


def all_gains(response, levels):
    """Magnitudes of the gain under every code: (B, levels ** N), built up element by element."""
    total = np.zeros((len(response), 1))
    for n in range(response.shape[1]):
        turned = response[:, n, None] * np.exp(-2j * np.pi / levels * np.arange(levels))
        total = (total[:, :, None] + turned[:, None, :]).reshape(len(response), -1)
    return np.abs(total)


@pytest.mark.parametrize("levels", [2, 4])
@pytest.mark.parametrize("elements", [4, 6, 9])
def test_exact_equals_brute_force(elements, levels):
    rng = np.random.default_rng(elements * 10 + levels)
    channels = 200 if levels**elements < 10**5 else 50
    response = rng.normal(size=(channels, elements)) + 1j * rng.normal(size=(channels, elements))
    index, gain = exact_code(response, levels)
    for block in np.array_split(np.arange(channels), 20):  # 4^9 codes a channel: two or three channels at a time
        best = all_gains(response[block], levels).max(axis=1)
        np.testing.assert_allclose(gain[block], best, rtol=1e-12)
    reached = np.abs(np.sum(response * np.exp(-2j * np.pi / levels * index), axis=1))
    np.testing.assert_allclose(gain, reached, rtol=1e-12)


def test_exact_is_unaffected_by_a_common_turn_and_by_zero_elements():
    rng = np.random.default_rng(1)
    response = rng.normal(size=36) + 1j * rng.normal(size=36)
    _, gain = exact_code(response, 4)
    _, turned = exact_code(response * np.exp(0.3j), 4)
    _, padded = exact_code(np.concatenate([response, np.zeros(5)]), 4)
    assert turned == pytest.approx(float(gain), rel=1e-12)
    assert padded == pytest.approx(float(gain), rel=1e-12)
    assert exact_code(np.zeros(4), 4)[1] == 0.0


def test_order_of_the_references():
    rng = np.random.default_rng(2)
    response = rng.normal(size=(50, 64)) + 1j * rng.normal(size=(50, 64))
    for levels in (2, 3, 4, 8, 16):
        _, exact = exact_code(response, levels)
        step = 2 * np.pi / levels
        nearest = np.abs(np.sum(response * np.exp(-1j * step * nearest_code(response, levels)), axis=1))
        continuous = np.abs(np.sum(response * np.exp(-1j * continuous_phases(response)), axis=1))
        np.testing.assert_allclose(continuous, np.abs(response).sum(axis=1), rtol=1e-12)
        assert (nearest <= exact * (1 + 1e-12)).all()
        assert (exact <= continuous * (1 + 1e-12)).all()
        # rounding to the nearest of H levels costs at most cos(pi / H) and on average sinc(1 / H)
        assert (exact >= np.cos(np.pi / levels) * continuous).all()
        assert np.mean(exact / continuous) == pytest.approx(np.sinc(1 / levels), abs=0.08)
