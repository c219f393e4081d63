"""Cosines near the horizon, which the receiver brings back into the unit disc."""

import numpy as np
import pytest

from rislam_rt.measurement.components import clip_to_unit_disc
from rislam_rt.slam.window.landmarks.horizon_bias import correct_horizon_bias

STD = 0.02


def brought_back(radius, angle=0.7, std=STD):
    """What is added to the residual, and the slopes, of a ray of that radius whose cosines move with themselves."""
    out = np.array([np.cos(angle), np.sin(angle)])
    seen, left, slopes = np.array([[3.0, *(radius * out)]]), np.zeros((1, 3)), np.eye(3)[None]
    correct_horizon_bias(seen, np.broadcast_to(std, (1, 3)), left, slopes)
    return out, left[0], slopes[0]


def test_the_receiver_reports_level_rays_where_they_are_expected_on_average():
    noise = STD * np.random.default_rng(5).standard_normal((200_000, 2))
    for radius in (1.0, 1.0 - STD, 1.0 - 3.0 * STD):
        out, left, _ = brought_back(radius)
        shift = clip_to_unit_disc(radius * out + noise).mean(axis=0) - radius * out
        # noise along the rim bends towards the middle, which is of second order in the deviation
        np.testing.assert_allclose(-shift, left[1:], atol=0.5 * STD**2 + 4.0 * STD / np.sqrt(len(noise)))
        assert left[0] == 0.0
    assert abs(np.linalg.norm(brought_back(1.0)[1]) - 0.399 * STD) < 1e-3 * STD


@pytest.mark.parametrize("angle", [0.0, 0.7, 1.57])
def test_axes_of_different_apertures_count_by_their_share_of_the_way_out(angle):
    std = np.array([0.3, STD, 0.2 * STD])  # of the length, which has no part in it, and of the cosines
    noise = std[1:] * np.random.default_rng(6).standard_normal((200_000, 2))
    out, left, _ = brought_back(1.0, angle, std)
    shift = clip_to_unit_disc(out + noise).mean(axis=0) - out
    np.testing.assert_allclose(-shift, left[1:], atol=STD**2 + 4.0 * STD / np.sqrt(len(noise)))


def test_what_is_foreseen_beyond_the_rim_is_foreseen_on_it():
    """As a mixture of two rays may be; its length stays."""
    (_, beyond, slopes), (_, level, same) = (brought_back(radius) for radius in (1.01, 1.0))
    np.testing.assert_allclose(beyond, level)
    np.testing.assert_allclose(slopes, same)


def test_slopes_are_those_of_the_expected_report():
    step = 1e-5
    for radius in (1.0 - 0.5 * STD, 1.0 - 2.0 * STD):
        out, _, slopes = brought_back(radius)
        more, less = (r * out - brought_back(r)[1][1:] for r in (radius + step, radius - step))
        np.testing.assert_allclose(slopes[1:, 1:] @ out, (more - less) / (2.0 * step), atol=1e-4)
        across = np.array([-out[1], out[0]])
        np.testing.assert_allclose(slopes[1:, 1:] @ across, across, atol=1e-12)
        np.testing.assert_array_equal(slopes[0], [1.0, 0.0, 0.0])


def test_high_rays_and_blind_axes_stay_as_they_are():
    for radius, std in ((0.9, STD), (0.0, STD), (0.99, 0.5)):
        _, left, slopes = brought_back(radius, std=std)
        np.testing.assert_array_equal(left, np.zeros(3))
        np.testing.assert_array_equal(slopes, np.eye(3))
