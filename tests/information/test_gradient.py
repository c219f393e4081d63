"""Gradients against finite differences of the image-source path length, for every path class."""

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.bistatic import path_gradient
from rislam_rt.information import vertex_gradient
from rislam_rt.model import PathKind, RadioConfig, Trajectory
from rislam_rt.scene import load_scene

STEP = 1e-5
POSES = np.array([[0.7, 1.9, 0.5], [2.3, 4.1, 0.8], [4.9, 0.6, 1.2], [5.3, 5.2, 0.3]])
HEADING = np.array([0.2, -1.3, 2.1, 2.9])


@pytest.fixture(scope="module")
def channel():
    return ImageSourceChannel(load_scene("scenes/paper_room"), RadioConfig(), depth=2)


def trajectory(channel, position=POSES, heading=HEADING):
    count = len(position)
    return Trajectory(np.arange(float(count)), position, np.zeros((count, 3)), heading, channel.scene.agent.body)


def lengths(channel, paths, **pose):
    """Path lengths (K, P) [m] at other poses, columns matched to `paths` by identity; NaN where one is missing."""
    found = channel.paths(trajectory(channel, **pose))
    column = {found.identity(p): p for p in range(found.num_paths)}
    where = [column.get(paths.identity(p), -1) for p in range(paths.num_paths)]
    length = np.where(found.valid, found.tau * SPEED_OF_LIGHT, np.nan)
    return np.where(np.array(where) >= 0, length[:, where], np.nan)


def every_class(channel):
    paths = channel.paths(trajectory(channel))
    assert set(paths.kind) == set(PathKind)
    assert any((paths.tx_walls[p, 0] >= 0) for p in range(paths.num_paths) if paths.kind[p] == PathKind.VS)
    return paths


def test_exact_gradient_equals_differences_for_every_class(channel):
    paths = every_class(channel)
    motion = trajectory(channel)
    gradient = vertex_gradient(motion.tx, motion.rx, paths.vertices, paths.num_vertices)
    compared = np.zeros(paths.num_paths, dtype=bool)
    for axis in range(3):
        shift = STEP * np.eye(3)[axis]
        upper, lower = (lengths(channel, paths, position=POSES + s * shift) for s in (1.0, -1.0))
        difference = (upper - lower) / (2 * STEP)
        known = paths.valid & np.isfinite(difference)
        # length 10 m with 1e-15: 1e-10 from rounding; curvature 1 / (0.05 m leg) and step 1e-5: 1e-8
        np.testing.assert_allclose(gradient[..., axis][known], difference[known], rtol=0, atol=1e-6)
        compared |= known.any(axis=0)
    assert compared.mean() > 0.98  # a path on the edge of existence may be missing on one side of the step


def test_ends_alone_give_the_same_gradient_and_line_of_sight_has_none(channel):
    paths = every_class(channel)
    motion = trajectory(channel)
    gradient = vertex_gradient(motion.tx, motion.rx, paths.vertices, paths.num_vertices)
    count = np.maximum(paths.num_vertices, 1)
    first = paths.vertices[:, :, 0]
    last = np.take_along_axis(paths.vertices, (count - 1)[None, :, None, None], axis=2)[:, :, 0]
    tx, rx = motion.tx[:, None], motion.rx[:, None]
    bounced = paths.valid & (paths.num_vertices > 0)
    np.testing.assert_allclose(path_gradient(tx, rx, first, last)[bounced], gradient[bounced], atol=1e-14)
    np.testing.assert_array_equal(gradient[:, paths.kind == PathKind.LOS], 0.0)
    np.testing.assert_array_equal(path_gradient(tx, rx, rx, tx), 0.0)


def test_paper_and_appendix_modes_are_the_sums_they_claim_to_be():
    tx, rx = np.array([[0.0, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0]])
    vertices = np.array([[[[0.0, 2.0, 0.0], [3.0, 2.0, 0.0]], [[0.0, 0.0, 4.0], [9.0, 9.0, 9.0]]]])
    count = np.array([2, 1])
    s2 = 1 / np.sqrt(2)
    paper = vertex_gradient(tx, rx, vertices, count, mode="paper")[0]
    np.testing.assert_allclose(paper[0], [1 - s2, 1 - s2, 0], atol=1e-15)  # up, right, back to the Rx
    np.testing.assert_allclose(paper[1], [1 / np.sqrt(17), 0, 1 - 4 / np.sqrt(17)], atol=1e-15)
    legs = vertex_gradient(tx, rx, vertices, count, mode="paper_legs")[0]
    np.testing.assert_allclose(legs[0], [1 - s2, -1 - s2, 0], atol=1e-15)  # the wall on the Rx leg
    np.testing.assert_allclose(legs[1], [1 / np.sqrt(17), 0, -1 - 4 / np.sqrt(17)], rtol=0, atol=1e-15)
    behind = vertex_gradient(tx, rx, vertices, count, mode="paper_legs", landmark=np.array([1, 0]))[0]
    np.testing.assert_allclose(behind[0], [-1 - s2, -1 - s2, 0], atol=1e-15)  # the wall on the Tx leg
    np.testing.assert_array_equal(behind[1], legs[1])
    appendix = vertex_gradient(tx, rx, vertices, count, mode="appendix")[0]
    np.testing.assert_allclose(appendix[0], [-s2, -s2, 0], atol=1e-15)
    exact = vertex_gradient(tx, rx, vertices, count)[0]
    np.testing.assert_allclose(exact[0], [-s2, -1 - s2, 0], atol=1e-15)


def test_paper_mode_vanishes_for_a_monostatic_landmark():
    point, agent = np.array([2.0, 1.0, 1.0]), np.array([[0.5, 0.5, 0.5]])
    vertices = point[None, None, None]
    one = np.array([1])
    np.testing.assert_allclose(vertex_gradient(agent, agent, vertices, one, mode="paper"), 0.0, atol=1e-15)
    exact = vertex_gradient(agent, agent, vertices, one)[0, 0]
    np.testing.assert_allclose(np.linalg.norm(exact), 2.0, atol=1e-15)


def test_legs_that_point_at_the_agent_have_the_exact_gradient_unless_a_wall_comes_between(channel):
    paths = every_class(channel)
    motion = trajectory(channel)
    walls = (paths.tx_walls >= 0).sum(axis=1)
    legs = vertex_gradient(motion.tx, motion.rx, paths.vertices, paths.num_vertices, mode="paper_legs", landmark=walls)
    exact = vertex_gradient(motion.tx, motion.rx, paths.vertices, paths.num_vertices)
    direct = np.isin(paths.kind, (PathKind.PS, PathKind.RIS))
    over_walls = np.isin(paths.kind, (PathKind.VS, PathKind.VRIS))
    np.testing.assert_allclose(legs[:, direct], exact[:, direct], rtol=0, atol=1e-14)
    assert np.abs(legs - exact)[paths.valid & over_walls].max(axis=-1).min() > 1e-3
