"""Gradients of path lengths by automatic differentiation through the tracer."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.traced.candidate_indices import CandidateIndices
from rislam_rt.channel.traced.channel import TracedChannel
from rislam_rt.channel.traced.sequences import NO_WALL, turned_round
from rislam_rt.errors import TraceError
from rislam_rt.model import Paths, Trajectory


class MovingLegs(NamedTuple):
    """N legs of an agent that moves without turning."""

    sequences: Integers
    """(N, D) walls from device to far end."""
    device: Floats
    """(N, 3) [m], moves with the agent."""
    far: Floats
    """(N, 3) [m]."""
    far_moves: Booleans
    """(N,) whether the far end moves with the agent too."""

    def only(self, keep: Integers) -> "MovingLegs":
        """The legs chosen."""
        return MovingLegs(self.sequences[keep], self.device[keep], self.far[keep], self.far_moves[keep])


def length_gradients(
    channel: TracedChannel, trajectory: Trajectory, paths: Paths, cycle: Integers, path: Integers
) -> Floats:
    """Derivative (N, 3) of the lengths of paths (cycle[i], path[i]) by the agent's position, heading held.

    Dr.Jit differentiates what the tracer does: the images, the rays back through the scene, the segments' sum. The
    closed form is minus the sum of the unit vectors from either end along the path, `-(departure + arrival)`.

    Raises
    ------
    TraceError
        A path asked for is not there.
    """
    if not paths.valid[cycle, path].all():
        raise TraceError("path lengths: a gradient was asked for where there is no path; ask where `valid` holds")
    tx, rx = _tx_legs(channel, trajectory, paths, cycle, path), _rx_legs(channel, trajectory, paths, cycle, path)
    landmark = paths.landmark[path]
    spared = np.where(np.isin(landmark, list(channel.tracer_scene.occluders)), landmark, -1)
    gradient = np.zeros((len(path), 3))
    for shade in np.unique(spared):
        every, joined = np.flatnonzero(spared == shade), np.flatnonzero((spared == shade) & (landmark >= 0))
        gradient[every] += _differentiate(channel, tx.only(every), int(shade))
        gradient[joined] += _differentiate(channel, rx.only(joined), int(shade))
    return gradient


def _tx_legs(
    channel: TracedChannel, trajectory: Trajectory, paths: Paths, cycle: Integers, path: Integers
) -> MovingLegs:
    """The legs from the Tx: to the landmark, or to the Rx."""
    landmark = paths.landmark[path]
    direct = landmark < 0
    far = trajectory.rx[cycle]
    far[~direct] = channel.scene.landmark_positions[landmark[~direct]]
    return MovingLegs(paths.tx_walls[path], trajectory.tx[cycle], far, direct)


def _rx_legs(
    channel: TracedChannel, trajectory: Trajectory, paths: Paths, cycle: Integers, path: Integers
) -> MovingLegs:
    """The legs from the Rx to the landmark, meaningless where there is none."""
    far = np.zeros((len(path), 3))
    joined = paths.landmark[path] >= 0
    far[joined] = channel.scene.landmark_positions[paths.landmark[path[joined]]]
    walls = turned_round(paths.rx_walls[path])
    return MovingLegs(walls, trajectory.rx[cycle], far, np.zeros(len(path), dtype=np.bool_))


def _differentiate(channel: TracedChannel, legs: MovingLegs, spared: int) -> Floats:
    """Derivative (N, 3) of the legs' lengths by the agent's position."""
    import drjit as dr
    import mitsuba as mi

    from rislam_rt.channel.traced.tracer_scene import as_points
    from rislam_rt.channel.traced.visibility import attached_vertices

    count = len(legs.device)
    if count == 0:
        return np.zeros((0, 3))
    shift = dr.zeros(mi.Point3f, count)
    dr.enable_grad(shift)
    origin = channel.tracer_scene.origin
    device = as_points(legs.device - origin) + shift
    far = as_points(legs.far - origin) + dr.select(mi.Bool(legs.far_moves), shift, mi.Point3f(0.0))
    index = np.arange(count)
    points = attached_vertices(
        channel.tracer_scene, legs.sequences, far, device, CandidateIndices(index, index, index), spared
    )
    bounces = (legs.sequences != NO_WALL).sum(axis=1)
    length, last = mi.Float(0.0), far
    for number, point in enumerate(points):
        real = mi.Bool(number < bounces)
        length += dr.select(real, dr.norm(point - last), 0.0)
        last = dr.select(real, point, last)
    dr.backward(length + dr.norm(device - last))
    return np.array(dr.grad(shift), dtype=np.float64).T
