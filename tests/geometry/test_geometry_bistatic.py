"""Bistatic lengths and direction cosines: gradients against differences."""

import numpy as np

from rislam_rt.geometry.angles import rotation_z
from rislam_rt.geometry.bistatic import cosine_gradient, path_gradient

STEP = 1e-5


def test_path_gradient_equals_differences_where_both_ends_move():
    rng = np.random.default_rng(2)
    tx, rx, first, last = rng.normal(size=(4, 20, 3)) + np.array([0.0, 0.0, 4.0]) * np.arange(4)[:, None, None]

    def length(shift):
        return np.linalg.norm(tx + shift - first, axis=-1) + np.linalg.norm(rx + shift - last, axis=-1)

    for axis in range(3):
        shift = STEP * np.eye(3)[axis]
        difference = (length(shift) - length(-shift)) / (2 * STEP)
        np.testing.assert_allclose(path_gradient(tx, rx, first, last)[..., axis], difference, atol=1e-8)


def test_cosine_gradient_equals_differences():
    rng = np.random.default_rng(3)
    rx, apparent = rng.normal(size=(20, 3)), rng.normal(size=(20, 3)) + np.array([0.0, 0.0, 4.0])
    heading = rng.uniform(-3, 3, size=20)

    def cosines(position):
        ray = apparent - position
        body = np.einsum("kji,kj->ki", rotation_z(heading), ray / np.linalg.norm(ray, axis=-1, keepdims=True))
        return body[:, :2]

    analytic = cosine_gradient(rx, apparent, heading)
    for axis in range(3):
        shift = STEP * np.eye(3)[axis]
        difference = (cosines(rx + shift) - cosines(rx - shift)) / (2 * STEP)
        np.testing.assert_allclose(analytic[..., axis], difference, atol=1e-8)
