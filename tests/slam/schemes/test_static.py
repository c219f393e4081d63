"""BP-SLAM on static anchors: a short walk stays within its bounds, and bad input is named."""

from typing import Any

import numpy as np
import pytest

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.slam.schemes.bp_slam_static import BpSlamStaticConfig, StaticResult, run_static

ANCHORS = np.array([[1.5, 6.0], [8.5, 0.8]])
IMAGES = (np.array([[-1.5, 6.0], [18.5, 6.0]]), np.array([[11.5, 0.8], [8.5, -0.8]]))
START_STD = np.array([0.1, 0.1, 0.01, 0.01])
STEPS = 60


def walk() -> Floats:
    turn = 2.0 * np.pi * np.arange(STEPS) / 900.0
    return np.stack([5.0 + 2.8 * np.cos(turn), 3.4 + 1.6 * np.sin(2.0 * turn)], axis=1)


def run(seed: int, coupled: bool, steps: int = STEPS) -> StaticResult:
    rng, truth = np.random.default_rng(seed), walk()[:steps]
    config = BpSlamStaticConfig(num_particles=256, coupled=coupled)
    ranges = []
    for point in truth:
        row = []
        for anchor, images in zip(ANCHORS, IMAGES, strict=True):
            length = np.linalg.norm(np.concatenate([anchor[None], images]) - point, axis=1)
            length = (length + 0.1 * rng.standard_normal(len(length)))[rng.random(len(length)) < 0.95]
            row.append(rng.permutation(np.concatenate([length, 30.0 * rng.random(rng.poisson(1.0))])))
        ranges.append(row)
    start = np.concatenate([truth[0], truth[1] - truth[0]]) + START_STD * rng.standard_normal(4)
    return run_static(ANCHORS, ranges, start, START_STD, config, rng=rng)


@pytest.mark.parametrize("coupled", [True, False])
def test_a_short_walk_stays_within_bounds(coupled: bool) -> None:
    """Two known anchors alone give `0.1 m / |sin|` of an error in each step, with |sin| at least 0.45 on this walk.

    Both axes together that is 0.1 sqrt(2) / 0.45 = 0.31 m; a filter that also remembers must do better in the rms. The
    start's own error, 0.14 m, is the most that it may have to begin with.
    """
    result = run(3, coupled)
    error = np.linalg.norm(result.position - walk(), axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.31
    assert np.isfinite(result.covariance).all()
    last = result.features.at(STEPS - 1)
    assert set(last.ident[last.ident < 2]) == {0, 1}
    assert np.all((last.existence > 0.5) & (last.existence <= 1.0))


def test_the_same_seed_gives_the_same_run() -> None:
    """Bit for bit."""
    first, second = run(4, True, 10), run(4, True, 10)
    assert np.array_equal(first.position, second.position)


@pytest.mark.parametrize(
    ("anchors", "ranges", "start", "words"),
    [
        ([[0.0, 0.0, 0.0, 0.0]], [[[1.0]]], np.zeros(4), "anchors"),
        ([[0.0, 0.0]], [[[1.0]]], np.zeros(3), "start"),
        ([[0.0, 0.0]], [], np.zeros(4), "no steps"),
        ([[0.0, 0.0]], [[[1.0], [2.0]]], np.zeros(4), r"ranges\[0\]"),
        ([[0.0, 0.0]], [[[np.nan]]], np.zeros(4), "not finite"),
    ],
)
def test_bad_input_is_named(
    anchors: list[list[float]], ranges: list[list[list[float]]], start: Floats, words: str
) -> None:
    """One line that says which argument."""
    with pytest.raises(ConfigError, match=words):
        run_static(anchors, ranges, start, np.ones(len(start)), rng=np.random.default_rng(1))


@pytest.mark.parametrize("field", ["num_particles", "sigma_a", "detection_probability", "feature_std"])
def test_bad_settings_are_named(field: str) -> None:
    """With the name of the field."""
    wrong: dict[str, Any] = {field: -1}
    with pytest.raises(ConfigError, match=f"bp_slam_static.{field}"):
        BpSlamStaticConfig(**wrong)
