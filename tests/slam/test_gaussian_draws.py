"""Draws without a random number: the sequence is scipy's, the moments those of a standard normal."""

import numpy as np
import pytest
from scipy.stats.qmc import Halton

from rislam_rt.slam.sampling import PRIMES, even_draws, radical_inverse


def test_the_sequence_is_scipys_to_the_bit():
    found = np.stack([radical_inverse(200, base) for base in PRIMES], axis=1)
    np.testing.assert_array_equal(found, Halton(len(PRIMES), scramble=False).random(201)[1:])


@pytest.mark.parametrize(("count", "dims"), [(9, 1), (16, 3), (500, 6)])
def test_mean_and_covariance_of_draws(count, dims):
    draws = even_draws(count, dims)
    np.testing.assert_allclose(draws.mean(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(draws.T @ draws / count, np.eye(dims), atol=1e-12)
