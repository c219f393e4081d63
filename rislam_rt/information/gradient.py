"""How the length of a path changes with the agent, which carries both ends, and with the landmark.

Inner segments end on fixed walls and landmarks; by Fermat's principle a bounce point on its wall does not change the
length to first order. So only the first and the last segment count, whatever lies between.
"""

from typing import Literal

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.geometry.angles import rotation_z, unit

GradientMode = Literal["exact", "paper", "appendix"]


def path_gradient(tx: Floats, rx: Floats, first: Floats, last: Floats) -> Floats:
    """Gradient (..., 3) of a path's length with respect to the agent's position; no unit.

    Parameters
    ----------
    tx, rx
        (..., 3) ends of the path [m]; both move with the agent.
    first, last
        (..., 3) first and last interaction point, or any point beyond it on the same straight line as seen from the
        end (the landmark's image). For the line of sight give `rx` and `tx`: the result is 0.

    Replaces nu, kappa of eq. `derived`, which sum over all segments: both ends move, inner segments are fixed.
    """
    return unit(tx - first) + unit(rx - last)


def vertex_gradient(
    tx: Floats, rx: Floats, vertices: Floats, num_vertices: Integers, *, mode: GradientMode = "exact"
) -> Floats:
    """Gradient (..., P, 3) of paths with all their interaction points.

    Parameters
    ----------
    tx, rx
        (..., 3) [m].
    vertices
        (..., P, V, 3) [m] in the order of travel.
    num_vertices
        (P,) how many of them count; 0 is the line of sight.
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


def cosine_gradient(rx: Floats, apparent: Floats, heading: Floats) -> Floats:
    """Gradient (..., 2, 3) [1/m] of the direction cosines along body x and y with respect to the Rx position.

    `apparent` (..., 3): where the ray seems to come from, the landmark or its image behind the walls of the Rx leg.
    The gradient with respect to `apparent` is the negative.
    """
    ray = apparent - rx
    distance = np.linalg.norm(ray, axis=-1)
    axes = np.moveaxis(rotation_z(heading)[..., :, :2], -1, -2)
    direction = ray / distance[..., None]
    along = axes @ direction[..., None]
    return -(axes - along * direction[..., None, :]) / distance[..., None, None]
