"""Mirror chains: images and their derivatives against differences."""

import numpy as np

from rislam_rt.geometry.planes import mirror_chain, plane_tangents

STEP = 1e-5


def test_chain_of_mirrors_of_a_moving_point():
    rng = np.random.default_rng(0)
    normal = rng.normal(size=(3, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    point, offset = rng.normal(size=3), rng.normal(size=3)
    chain = mirror_chain(point, normal, offset)
    for axis in range(3):
        shift = STEP * np.eye(3)[axis]
        difference = (
            mirror_chain(point + shift, normal, offset).image - mirror_chain(point - shift, normal, offset).image
        ) / (2 * STEP)
        np.testing.assert_allclose(chain.linear[:, axis], difference, atol=1e-9)
    np.testing.assert_allclose(chain.linear @ chain.linear.T, np.eye(3), atol=1e-12)


def test_slopes_by_each_plane_equal_differences():
    """Two tilts and the offset of every wall: its normal turned along a tangent, its offset kept."""
    rng = np.random.default_rng(5)
    normal = rng.normal(size=(3, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    point, offset = rng.normal(size=3), rng.normal(size=3)
    chain = mirror_chain(point, normal, offset)
    for wall in range(3):
        first, second = plane_tangents(normal[wall])
        for column, tangent in enumerate((first, second)):

            def image(angle, wall=wall, tangent=tangent):
                turned = normal.copy()
                turned[wall] = np.cos(angle) * normal[wall] + np.sin(angle) * tangent
                return mirror_chain(point, turned, offset).image

            difference = (image(STEP) - image(-STEP)) / (2.0 * STEP)
            np.testing.assert_allclose(chain.planes[wall, :, column], difference, atol=1e-8)
        away = STEP * np.eye(3)[wall]
        ends = [mirror_chain(point, normal, offset + sign * away).image for sign in (1.0, -1.0)]
        np.testing.assert_allclose(chain.planes[wall, :, 2], (ends[0] - ends[1]) / (2.0 * STEP), atol=1e-8)
