"""Returns of the map: the model against mirror images built by hand, and its derivatives against differences."""

import numpy as np
import pytest

from rislam_rt.geometry.planes import mirror, plane_between
from rislam_rt.slam.predicted_returns import NONE, TX, Poses, Returns, compact, linearise, observe, reflect

LEGS = np.array(
    [[0, NONE, NONE], [0, 2, NONE], [1, 2, 3], [1, 3, 2], [TX, 2, NONE], [TX, NONE, NONE], [TX, 2, 3], [1, 3, NONE]]
)
RETURNS = Returns(LEGS, np.array([0, 1, 0, 2, 5, 5, 7]), np.array([0, 0, 1, 3, 4, 6, 7]))


@pytest.fixture
def world(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, Poses]:
    """Five draws of two points and two walls (images of anchors), seen from five poses."""
    features, anchor = 3.0 * rng.normal(size=(5, 4, 3)), rng.normal(size=(4, 3))
    return features, anchor, Poses(rng.normal(size=(5, 3)), rng.normal(size=(5, 3)), rng.normal(size=5))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240611)


def test_reflect_is_the_mirror_image_in_the_plane_between_anchor_and_wall(world) -> None:
    features, anchor, poses = world
    normal, offset = plane_between(anchor[2], features[:, 2])
    np.testing.assert_allclose(reflect(poses.tx, features[:, 2], anchor[2]), mirror(poses.tx, normal, offset))


def test_length_of_a_walled_leg_is_that_of_the_bounced_path(world) -> None:
    """Over Tx, wall 2, point 0, Rx the length is that from the mirrored Tx: images of either end are equivalent."""
    features, anchor, poses = world
    image = reflect(poses.tx, features[:, 2], anchor[2])
    want = np.linalg.norm(image - features[:, 0], axis=-1) + np.linalg.norm(poses.rx - features[:, 0], axis=-1)
    np.testing.assert_allclose(observe(RETURNS, features, anchor, poses).seen[:, 1, 0], want)


def test_double_bounce_mirrors_first_in_the_wall_next_to_the_point(world) -> None:
    features, anchor, poses = world
    image = reflect(reflect(features[:, 1], features[:, 3], anchor[3]), features[:, 2], anchor[2])
    want = np.linalg.norm(image - poses.rx, axis=-1)
    np.testing.assert_allclose(observe(RETURNS, features, anchor, poses).rx_length[:, 3], want)


def test_heading_turns_the_cosines(world) -> None:
    features, anchor, poses = world
    seen = observe(RETURNS, features, anchor, poses._replace(heading=np.zeros(5))).seen[..., 1:]
    turned = observe(RETURNS, features, anchor, poses._replace(heading=np.full(5, np.pi / 2.0))).seen[..., 1:]
    np.testing.assert_allclose(turned, np.stack([seen[..., 1], -seen[..., 0]], axis=-1), atol=1e-12)


def test_derivatives_equal_central_differences(world) -> None:
    features, anchor, poses = world
    jacobian = linearise(RETURNS, features, anchor, poses).by_feature
    width = 1e-6
    for feature in range(4):
        for axis in range(3):
            shift = np.zeros_like(features)
            shift[:, feature, axis] = width
            ahead = observe(RETURNS, features + shift, anchor, poses).seen
            behind = observe(RETURNS, features - shift, anchor, poses).seen
            # rounding 1e-15 / 1e-6 and curvature 1e-12: 1e-7 leaves room for the walls' second derivatives
            np.testing.assert_allclose(jacobian[..., feature, axis], (ahead - behind) / (2 * width), atol=1e-7)


def test_shifting_agent_and_map_together_changes_nothing(world) -> None:
    """Absolute position is unobservable, so the model must not see it."""
    features, anchor, poses = world
    shift = np.array([0.3, -0.2, 0.7])
    moved = observe(RETURNS, features + shift, anchor + shift, Poses(poses.tx + shift, poses.rx + shift, poses.heading))
    np.testing.assert_allclose(moved.seen, observe(RETURNS, features, anchor, poses).seen, atol=1e-12)


def test_pose_derivatives_equal_central_differences(world) -> None:
    features, anchor, poses = world
    linear = linearise(RETURNS, features, anchor, poses)
    np.testing.assert_allclose(linear.seen, observe(RETURNS, features, anchor, poses).seen, atol=1e-12)
    jacobian = linear.by_pose
    width = 1e-6
    for axis in range(3):
        shift = width * np.eye(3)[axis]
        ahead = observe(RETURNS, features, anchor, Poses(poses.tx + shift, poses.rx + shift, poses.heading)).seen
        behind = observe(RETURNS, features, anchor, Poses(poses.tx - shift, poses.rx - shift, poses.heading)).seen
        np.testing.assert_allclose(jacobian[..., axis], (ahead - behind) / (2 * width), atol=1e-7)


def test_compact_returns_look_the_same(world) -> None:
    features, anchor, poses = world
    rows = np.array([5, 1])
    few = compact(RETURNS, rows)
    assert len(few.legs) == 4
    want = observe(RETURNS, features, anchor, poses).seen[:, rows]
    np.testing.assert_array_equal(observe(few, features, anchor, poses).seen, want)
