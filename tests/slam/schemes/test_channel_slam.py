"""Channel-SLAM: where Gaussians lie, how a range moves them, and how ranges are labelled."""

from typing import Any

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.slam.schemes.bp_slam.ranges import Bistatic
from rislam_rt.slam.schemes.channel_slam import ChannelSlamConfig
from rislam_rt.slam.schemes.channel_slam.tracker import advance, assign, follow, no_tracks
from rislam_rt.slam.schemes.channel_slam.transmitters import (
    Transmitters,
    born,
    even_directions,
    join,
    moments,
    points_of,
    prune,
    update,
)

MODEL = Bistatic(np.array([-0.05, 0.0, 0.0]), np.array([0.05, 0.0, 0.0]), True)


def sphere(count: int = 32) -> tuple[np.ndarray, Transmitters]:
    position = np.random.default_rng(1).normal(0.0, 0.02, (5, 3))
    return position, born(3, position, 4.0, 0.01, MODEL, count)


def test_a_new_transmitter_is_everywhere_at_its_range() -> None:
    """Every mean at the range, up to rounding, for every agent; equal shares; directions balanced and above."""
    position, known = sphere()
    assert np.allclose(MODEL.ranges(position[:, None], points_of(known).position), 4.0, rtol=1e-9)
    assert np.allclose(np.exp(known.log_share).sum(axis=1), 1.0, rtol=1e-12)
    full = even_directions(1000, False)
    assert np.allclose(np.linalg.norm(full, axis=1), 1.0, rtol=1e-12)
    # A uniform sphere has mean 0 and second moments 1/3; a spiral of n points errs by the order of 1/n.
    assert np.all(np.abs(full.mean(axis=0)) < 3e-3)
    assert np.allclose(full.T @ full / 1000, np.eye(3) / 3.0, rtol=0.0, atol=3e-3)
    assert np.all(even_directions(50, True)[:, 2] > 0.0)


def test_derivatives_of_points() -> None:
    """Central differences over 1e-6; the error of the third order is far below the tolerance."""
    _, known = sphere(8)
    known = known._replace(mean=known.mean + np.array([0.1, 0.2, -0.3]))
    step, found = 1e-6, points_of(known).jacobian
    for axis in range(3):
        move = step * np.eye(3)[axis]
        ahead, back = (points_of(known._replace(mean=known.mean + sign * move)).position for sign in (1, -1))
        assert np.allclose((ahead - back) / (2.0 * step), found[:, :, axis], rtol=0.0, atol=1e-8)


def test_one_gaussian_is_a_kalman_filter() -> None:
    """A range from where the transmitter was born tells its distance alone: Kalman's answer in one dimension."""
    position = np.zeros((1, 3))
    monostatic = Bistatic(np.zeros(3), np.zeros(3), True)
    known = born(0, position, 4.0, 0.2, monostatic, 1)
    after = update(known, position, np.ones(1), np.array([4.3]), np.array([0.1]), monostatic, 1e-9)
    # The range is twice the distance: prior 2 +- 0.1 from a range of 4, measured 4.3 +- 0.1.
    variance = 1.0 / (1.0 / 0.1**2 + 4.0 / 0.1**2)
    assert after.transmitters.mean[0, 0, 0] == pytest.approx(2.0 + variance * 2.0 / 0.1**2 * 0.3, rel=1e-12)
    assert after.transmitters.covariance[0, 0, 0, 0] == pytest.approx(variance, rel=1e-12)
    total = 4.0 * 0.1**2 + 0.1**2
    wanted = -0.5 * (0.3**2 / total + np.log(2.0 * np.pi * total))
    assert after.log_likelihood[0] == pytest.approx(wanted, abs=1e-6)
    assert after.square[0] == pytest.approx(0.3**2 / total, rel=1e-9)


def test_likelihood_of_a_sum_of_gaussians() -> None:
    """Two transmitters: the product over transmitters of the sum over their Gaussians, up to rounding."""
    position, first = sphere(4)
    second = born(7, position, 5.0, 0.01, MODEL, 6)
    weight = np.full(5, 0.2)
    both = update(join([first, second]), position, weight, np.array([4.01, 5.02]), np.full(2, 0.02), MODEL, 0.01)
    alone = [
        update(one, position, weight, np.array([length]), np.array([0.02]), MODEL, 0.01)
        for one, length in ((first, 4.01), (second, 5.02))
    ]
    assert np.allclose(both.log_likelihood, alone[0].log_likelihood + alone[1].log_likelihood, rtol=1e-12)
    assert np.allclose(both.square, np.concatenate([alone[0].square, alone[1].square]), rtol=1e-12)
    shares = np.exp(both.transmitters.log_share)
    assert np.allclose(shares[:, :4].sum(axis=1), 1.0, rtol=1e-12)
    assert np.allclose(shares[:, 4:].sum(axis=1), 1.0, rtol=1e-12)


def test_turning_everything_about_the_vertical_changes_nothing() -> None:
    """Agents, Gaussians and ends turned alike: the same likelihoods. No knowledge of the course is made up."""
    position, known = sphere(8)
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    turned = known._replace(base=known.base @ turn.T, frame=known.frame @ turn.T)
    ends = Bistatic(turn @ MODEL.tx, turn @ MODEL.rx, True)
    moved, weight = position + np.array([0.3, 0.1, 0.0]), np.full(5, 0.2)
    plain = update(known, moved, weight, np.array([4.2]), np.array([0.02]), MODEL, 0.01)
    other = update(turned, moved @ turn.T, weight, np.array([4.2]), np.array([0.02]), ends, 0.01)
    assert np.allclose(other.log_likelihood, plain.log_likelihood, rtol=1e-9)


def test_pruning_keeps_the_best_and_normalises() -> None:
    """One Gaussian with a share of 1e-6 goes; of equal ones below the threshold, none are lost together."""
    _, known = sphere(3)
    share = np.log(np.broadcast_to([0.7, 0.3 - 1e-6, 1e-6], (5, 3)))
    kept = prune(known._replace(log_share=share), np.full(5, 0.2), 1e-3)
    assert kept.mean.shape[1] == 2
    assert np.allclose(np.exp(kept.log_share).sum(axis=1), 1.0, rtol=1e-12)
    assert prune(known, np.full(5, 0.2), 0.9).mean.shape[1] == 3


def test_moments_against_samples() -> None:
    """Mean and covariance of the mixture over agents and Gaussians, by drawing from it; to five standard errors."""
    _, known = sphere(2)
    known = known._replace(covariance=np.broadcast_to(np.diag([1e-2, 1e-4, 1e-4]), (5, 2, 3, 3)))
    mean, covariance = moments(known, np.full(5, 0.2))
    rng, draws = np.random.default_rng(6), 40_000
    row, column = rng.integers(0, 5, draws), rng.integers(0, 2, draws)
    deviation = rng.standard_normal((draws, 3)) * np.sqrt([1e-2, 1e-4, 1e-4])
    points = points_of(known)
    sample = points.position[row, column] + np.einsum("nk,nki->ni", deviation, points.jacobian[row, column])
    spread = np.sqrt(np.diag(covariance[0]))
    assert np.all(np.abs(sample.mean(axis=0) - mean[0]) < 5.0 * spread / np.sqrt(draws))
    error = np.abs(np.cov(sample, rowvar=False) - covariance[0]) / np.outer(spread, spread)
    assert np.all(error < 5.0 * np.sqrt(2.0 / draws))


def test_labels_follow_their_ranges() -> None:
    """Two ranges that come nearer each other, in changing order, with a miss: the labels stay."""
    tracks, first = no_tracks(), 0
    for cycle in range(30):
        tracks = advance(tracks, 0.1, 0.03)
        length = np.array([5.0 - 0.02 * cycle, 4.0 + 0.01 * cycle])
        order = np.array([1, 0]) if cycle % 3 else np.array([0, 1])
        order = order[:1] if cycle == 10 else order
        found = assign(tracks, length[order], np.full(len(order), 0.005), 9.0)
        tracks, label = follow(tracks, found, length[order], np.full(len(order), 0.005), 0.3, first)
        first = max(first, int(label.max()) + 1)
        assert np.array_equal(label, order)
    # Cycle 10 showed one range only, that of label 1.
    assert np.array_equal(tracks.hits, [29, 30])
    assert np.allclose(tracks.mean[:, 1], [-0.2, 0.1], rtol=0.0, atol=0.03)


def test_no_two_ranges_continue_one_track() -> None:
    """The nearer one does; the other starts a track of its own."""
    tracks, _ = follow(no_tracks(), np.array([-1]), np.array([3.0]), np.array([0.01]), 0.1, 0)
    found = assign(tracks, np.array([3.01, 3.001]), np.full(2, 0.01), 9.0)
    assert np.array_equal(found, [-1, 0])


@pytest.mark.parametrize("field", ["num_particles", "max_misses", "gate", "prune_weight", "height", "specular_ratio"])
def test_bad_settings_are_named(field: str) -> None:
    """With the name of the field."""
    wrong: dict[str, Any] = {field: "up" if field == "height" else -1}
    with pytest.raises(ConfigError, match=f"channel_slam.{field}"):
        ChannelSlamConfig(**wrong)
