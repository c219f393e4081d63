"""The heavy passes: both engines agree, resampling is unbiased and keeps moments, nothing becomes NaN."""

import numpy as np
import pytest

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.slam.nested.particles.engine_choice import pick_engine
from rislam_rt.slam.nested.particles.landmark_cloud import (
    HOPELESS,
    Cloud,
    CloudEngine,
    Kernel,
    kernel_width,
    restoring_map,
)
from rislam_rt.slam.nested.particles.numpy_engine import NumpyEngine
from rislam_rt.slam.nested.particles.sightline import Sighting, linear_sightline, pack, trace_sightline
from rislam_rt.slam.predicted_returns import NONE, TX, Poses, Returns, observe

N, M = 12, 240
LEGS = np.array([[0, NONE, NONE], [0, 1, NONE], [0, 1, 2], [0, 2, 1], [TX, NONE, NONE], [TX, 1, NONE], [TX, 2, 1]])
"""Point 0; walls 1 and 2."""
PAIRS = [(0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (2, 3), (3, 1), (4, 5), (4, 6)]
FEATURES = np.array([[2.0, 1.0, 1.0], [0.5, 11.3, 0.5], [11.5, 0.7, 0.5]])
ANCHOR = np.array([[0.0, 0.0, 0.0], [0.5, 0.7, 0.5], [0.5, 0.7, 0.5]])


def poses_near(position: Floats) -> Poses:
    """Agents with a baseline of 0.1 m, all with one heading."""
    arm = rotation_z(0.3) @ np.array([0.05, 0.02, 0.0])
    return Poses(position - arm, position + arm, np.full(len(position), 0.3))


def cloud_of(engine: CloudEngine, rng: np.random.Generator, count: int = N, size: int = M) -> Cloud:
    """A block of points that all agent particles share, with unequal weights."""
    points, log_weight = 0.1 * rng.standard_normal((1, size, 3)), rng.standard_normal((1, size))
    zero = np.zeros(count, dtype=np.int64)
    return engine.build(points, log_weight, zero, zero)


def sighting_of(owner: int, pair: tuple[int, int], rng: np.random.Generator) -> Sighting:
    returns = Returns(LEGS, np.array([pair[0]]), np.array([pair[1]]))
    poses = poses_near(np.array([0.5, 0.7, 0.5]) + 0.05 * rng.standard_normal((N, 3)))
    features = FEATURES + 0.02 * rng.standard_normal((N, 3, 3))
    line = trace_sightline(returns, 0, owner, features, ANCHOR, poses)
    seen = observe(returns, FEATURES, ANCHOR, poses_near(np.array([[0.5, 0.7, 0.5]]))).seen[0, 0]
    spread = rng.standard_normal((3, 3))
    return Sighting(line, seen, 1e-3 * (spread @ spread.T + np.eye(3)))


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("owner", [0, 1, 2])
def test_every_return_is_weighed_as_the_front_end_predicts_it(
    owner: int, pair: tuple[int, int], rng: np.random.Generator
) -> None:
    """Against `observe`, particle by particle: another formula (images, not mirrored devices), in double precision.

    Lengths of 20 m in single precision are off by 2e-6 m, whitened by 0.03 m; residuals of up to 30 standard
    deviations make of that 2e-6 / 0.03 * 30 = 2e-3 in the log likelihood.
    """
    engine = NumpyEngine()
    returns = Returns(LEGS, np.array([pair[0]]), np.array([pair[1]]))
    cloud = cloud_of(engine, rng)
    position = np.array([0.5, 0.7, 0.5]) + 0.05 * rng.standard_normal((N, 3))
    features = FEATURES + 0.02 * rng.standard_normal((N, 3, 3))
    poses = poses_near(position)
    line = trace_sightline(returns, 0, owner, features, ANCHOR, poses)
    seen = observe(returns, FEATURES, ANCHOR, poses_near(position[:1])).seen[0, 0]
    sighting = Sighting(line, seen, np.diag([0.03, 0.02, 0.04]) ** 2)
    after, sums = engine.weigh(cloud, (sighting.line.kind,), pack([sighting], N))
    points, before = engine.read(cloud)
    every = np.repeat(features[:, None], M, axis=1)
    every[:, :, owner] += points
    wide = Poses(poses.tx[:, None], poses.rx[:, None], poses.heading[:, None])
    gap = (seen - observe(returns, every, ANCHOR, wide).seen[..., 0, :]) / np.array([0.03, 0.02, 0.04])
    peak = -np.log(0.03 * 0.02 * 0.04) - 1.5 * np.log(2.0 * np.pi)
    wanted = before + peak - 0.5 * np.sum(gap**2, axis=-1)
    np.testing.assert_allclose(sums.log_total, np.logaddexp.reduce(wanted, axis=1), atol=5e-3)
    near = wanted > wanted.max(axis=1, keepdims=True) - 20.0
    found = engine.read(after)[1] + sums.log_total[:, None]
    np.testing.assert_allclose(found[near], wanted[near], atol=5e-3)


@pytest.mark.parametrize("pairs", [PAIRS[:1], PAIRS[:4], PAIRS[4:8]])
def test_engines_agree_to_single_precision(pairs: list[tuple[int, int]], rng: np.random.Generator) -> None:
    sightings = [sighting_of(1, pair, rng) for pair in pairs]
    kinds, constants = tuple(sighting.line.kind for sighting in sightings), pack(sightings, N)
    found = []
    for name in ("numpy", "drjit"):
        engine = pick_engine(name)
        cloud = cloud_of(engine, np.random.default_rng(3))
        for _ in range(2):
            cloud, sums = engine.weigh(cloud, kinds, constants)
        found.append(sums)
    one, other = found
    # whitened residuals of up to 100, single precision 6e-8 relative and some ten operations: 100^2 * 6e-7
    np.testing.assert_allclose(one.log_total, other.log_total, atol=1e-2, rtol=1e-5)
    np.testing.assert_allclose(one.mean, other.mean, atol=1e-4)
    np.testing.assert_allclose(one.covariance, other.covariance, atol=1e-5)
    np.testing.assert_allclose(one.ess, other.ess, rtol=1e-2)


def test_weights_of_shared_rows_become_each_agents_own(engine: CloudEngine, rng: np.random.Generator) -> None:
    cloud = cloud_of(engine, rng)
    agents = 0.05 * rng.standard_normal((N, 3))
    sighting = Sighting(linear_sightline(np.zeros((N, 3)), agents), np.zeros(3), 0.01 * np.eye(3))
    cloud, _ = engine.weigh(cloud, (sighting.line.kind,), pack([sighting], N))
    inherit = np.array([3, 3, 0])
    child = cloud._replace(block=cloud.block[inherit], row=cloud.row[inherit], log_total=cloud.log_total[inherit])
    points, log_weight = engine.read(cloud)
    for same in (child, engine.compact(child)):
        np.testing.assert_array_equal(engine.read(same)[0], points[inherit])
        np.testing.assert_array_equal(engine.read(same)[1], log_weight[inherit])


@pytest.mark.parametrize("size", [M, 2 * M, M // 2])
def test_resampling_keeps_mean_and_covariance(engine: CloudEngine, size: int, rng: np.random.Generator) -> None:
    """Exactly, that is to single precision of offsets of 0.1 m: 1e-8 m, times some hundred terms."""
    cloud, sums = engine.weigh(cloud_of(engine, rng), (), np.zeros((0, N)))
    fresh = engine.resample(cloud, sums.covariance, size, Kernel(rng.random(N), 7, 32, kernel_width(size, 3)))
    points, log_weight = engine.read(fresh)
    np.testing.assert_allclose(log_weight, -np.log(size), rtol=1e-6)
    np.testing.assert_allclose(points.mean(axis=1), 0.0, atol=1e-6)
    covariance = np.einsum("nmi,nmj->nij", points, points) / size
    np.testing.assert_allclose(covariance, sums.covariance, atol=1e-6)


def test_resampling_draws_in_proportion_to_the_weights(engine: CloudEngine, rng: np.random.Generator) -> None:
    """Without a kernel children are their parents but for an affine map, so that parents can be counted.

    Systematic resampling draws a particle of weight w either floor(M w) or ceil(M w) times; over C agent particles with
    combs of their own the mean count has a standard deviation of at most 0.5 / sqrt(C).
    """
    agents, size = 150, 32
    points = rng.standard_normal((1, size, 3))
    log_weight = rng.standard_normal((1, size))
    zero = np.zeros(agents, dtype=np.int64)
    cloud = engine.build(points, log_weight, zero, zero)
    cloud, sums = engine.weigh(cloud, (), np.zeros((0, agents)))
    fresh = engine.resample(cloud, sums.covariance, size, Kernel(rng.random(agents), 7, 8, 0.0))
    children = engine.read(fresh)[0]
    counts = np.zeros((agents, size))
    weight = np.exp(log_weight[0] - np.logaddexp.reduce(log_weight[0]))
    for agent in range(agents):
        parents = _parents(children[agent], points[0], weight)
        counts[agent] = np.bincount(parents, minlength=size)
    assert np.all(counts >= np.floor(size * weight - 1e-3))
    assert np.all(counts <= np.ceil(size * weight + 1e-3))
    np.testing.assert_allclose(counts.mean(axis=0), size * weight, atol=5 * 0.5 / np.sqrt(agents))


def _parents(children: Floats, points: Floats, weight: Floats) -> Floats:
    """Which point each child comes from: undo the affine map, which the children's own order reveals by least squares.

    The map is the one that takes drawn points to the restored ones; it is found by alternating between assignment and
    fit, beginning at the identity about the weighted mean.
    """
    at = children + weight @ points
    for _ in range(20):
        parents = np.argmin(np.sum((at[:, None] - points[None]) ** 2, axis=-1), axis=1)
        design = np.column_stack([children, np.ones(len(children))])
        fit = np.linalg.lstsq(design, points[parents], rcond=None)[0]
        at = design @ fit
    return parents


def test_impossible_measurements_leave_numbers(engine: CloudEngine, rng: np.random.Generator) -> None:
    cloud = cloud_of(engine, rng)
    far = Sighting(linear_sightline(np.zeros((N, 3)), np.full((N, 3), 1e25)), np.zeros(3), 1e-6 * np.eye(3))
    for _ in range(3):
        cloud, sums = engine.weigh(cloud, (far.line.kind,), pack([far], N))
        assert np.all(sums.log_total <= 0.1 * HOPELESS)
        assert all(np.isfinite(part).all() for part in sums)
    fresh = engine.resample(cloud, sums.covariance, M, Kernel(np.full(N, 0.5), 7, 32, 0.3))
    assert np.isfinite(engine.read(fresh)[0]).all()


def test_landmark_on_top_of_the_device_leaves_numbers(engine: CloudEngine) -> None:
    zero = np.zeros(2, dtype=np.int64)
    cloud = engine.build(np.zeros((1, 8, 3)), np.zeros((1, 8)), zero, zero)
    here = np.zeros((2, 3))
    poses = Poses(here, here, np.zeros(2))
    returns = Returns(LEGS[:1], np.array([0]), np.array([0]))
    line = trace_sightline(returns, 0, 0, here[:, None], ANCHOR[:1], poses)
    sighting = Sighting(line, np.array([1.0, 0.5, 0.5]), np.eye(3))
    _, sums = engine.weigh(cloud, (sighting.line.kind,), pack([sighting], 2))
    assert all(np.isfinite(part).all() for part in sums)


def test_restoring_map_restores(rng: np.random.Generator) -> None:
    root = rng.standard_normal((5, 3, 3))
    found = root @ np.swapaxes(root, 1, 2) + 0.1 * np.eye(3)
    wanted = found[::-1]
    turn = restoring_map(wanted, found)
    np.testing.assert_allclose(turn @ found @ np.swapaxes(turn, 1, 2), wanted, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(restoring_map(found, found), np.broadcast_to(np.eye(3), found.shape), atol=1e-6)
