"""Normalised squared errors (NEES and NIS): the Mahalanobis distance, and what is no covariance."""

import numpy as np

from rislam_rt.evaluate import normalised_squares


def test_squares_are_the_mahalanobis_distance():
    covariance = np.array([[4.0, 0.0], [0.0, 0.25]])
    np.testing.assert_allclose(normalised_squares(np.array([2.0, 1.0]), covariance), 1.0 + 4.0)
    stack = np.stack([covariance, np.array([[1.0, 1.0], [1.0, 1.0]])])
    np.testing.assert_array_equal(normalised_squares(np.array([[2.0, 1.0], [1.0, 1.0]]), stack), [5.0, np.inf])
