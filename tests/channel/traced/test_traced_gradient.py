"""Gradients through the tracer against the closed form, minus the sum of the unit vectors from either end."""

import numpy as np
import pytest

from rislam_rt.channel.traced import TracedChannel
from rislam_rt.channel.traced.gradient import length_gradients
from rislam_rt.errors import TraceError
from rislam_rt.model import PathKind, RadioConfig


@pytest.mark.parametrize("room", ["paper", "parted"])
def test_gradients_of_random_paths_of_all_classes(rooms, room):
    scene = getattr(rooms, room)()
    rng = np.random.default_rng(4)
    trajectory = rooms.at(rng.uniform([0.4, 0.4, 1.0], [2.6, 3.4, 2.6], size=(10, 3)))
    channel = TracedChannel(scene, RadioConfig(), 2)
    paths = channel.paths(trajectory)
    cycle, path = np.nonzero(paths.valid)
    kinds = paths.kind[path]
    chosen = np.concatenate([rng.permutation(np.flatnonzero(kinds == kind))[:20] for kind in PathKind])
    cycle, path = cycle[chosen], path[chosen]
    assert len(chosen) >= 85
    assert set(paths.kind[path]) == set(PathKind)
    gradient = length_gradients(channel, trajectory, paths, cycle, path)
    closed_form = -(paths.departure[cycle, path] + paths.arrival[cycle, path])
    np.testing.assert_allclose(gradient, closed_form, atol=1e-4)
    assert np.abs(closed_form).max() > 1.5  # a wall return's length changes by twice the step towards the wall


def test_finite_differences_agree(rooms):
    """The same derivative a third way, from refined lengths a millimetre to either side."""
    channel = TracedChannel(rooms.paper(), RadioConfig(), 1)
    position = np.array([2.2, 3.1, 1.3])
    step = 1e-3
    steps = np.concatenate([np.zeros((1, 3)), step * np.eye(3), -step * np.eye(3)])
    trajectory = rooms.at(position + steps)
    paths = channel.paths(trajectory)
    path = np.flatnonzero(paths.valid.all(axis=0))
    length = 299792458.0 * paths.tau[:, path]
    difference = (length[1:4] - length[4:7]).T / (2.0 * step)
    gradient = length_gradients(channel, trajectory, paths, np.zeros_like(path), path)
    np.testing.assert_allclose(gradient, difference, atol=1e-5)  # step^2 / (24 d^2) is below 1e-6, float32 below 1e-6


def test_no_gradient_without_a_path(rooms):
    channel = TracedChannel(rooms.parted(), RadioConfig(), 1)
    trajectory = rooms.at([[0.5, 0.5, 1.0], [5.5, 0.5, 1.0]])
    paths = channel.paths(trajectory)
    cycle, path = np.nonzero(~paths.valid)
    with pytest.raises(TraceError, match="there is no path"):
        length_gradients(channel, trajectory, paths, cycle[:1], path[:1])
