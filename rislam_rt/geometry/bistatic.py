"""Bistatic paths: how length and direction cosines change with the agent, which carries both ends.

Inner segments end on fixed walls and landmarks; by Fermat's principle a bounce point on its wall does not change the
length to first order. So only the first and the last segment count, whatever lies between.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z, unit


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
