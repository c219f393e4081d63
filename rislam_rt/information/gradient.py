"""Gradients of path lengths by the agent's position: exact, and in the two ways in which the paper has them."""

from typing import Literal

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.geometry.angles import unit

GradientMode = Literal["exact", "paper", "appendix"]
"""Forms of a path length's gradient by the agent's position (see `vertex_gradient`)."""


def vertex_gradient(
    tx: Floats, rx: Floats, vertices: Floats, num_vertices: Integers, *, mode: GradientMode = "exact"
) -> Floats:
    """Gradients (..., P, 3) of path lengths by the agent's position, from the paths' interaction points.

    Parameters
    ----------
    tx, rx
        (..., 3) [m].
    vertices
        (..., P, V, 3) [m] in the order of travel.
    num_vertices
        (P,) number of vertices of each path; 0 is the line of sight.
    mode
        `exact`; `paper`: sum of all segments' unit vectors in the sense of travel (nu, kappa of eq. `derived`);
        `appendix`: the last segment alone (H of Appendix B).
    """
    tx, rx = (np.broadcast_to(end[..., None, :], (*vertices.shape[:-2], 3)) for end in (tx, rx))
    points = np.concatenate([tx[..., None, :], vertices, rx[..., None, :]], axis=-2)
    count = np.asarray(num_vertices)
    # the Rx closes the path right after its last vertex
    step = np.arange(points.shape[-2])
    points = np.where((step > count[:, None])[..., None], rx[..., None, :], points)
    segment = unit(np.diff(points, axis=-2))
    if mode == "paper":
        return segment.sum(axis=-2)
    last = np.take_along_axis(segment, np.broadcast_to(count[:, None, None], (*vertices.shape[:-2], 1, 3)), axis=-2)
    if mode == "appendix":
        return last[..., 0, :]
    return last[..., 0, :] - segment[..., 0, :]
