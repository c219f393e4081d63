"""Rate factor: what path lengths that no feature explains tell of the agent's way, as a quadratic on the window's
poses."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats


class RateFactor(NamedTuple):
    """Quadratic cost on the positions of the window's K poses by T tracks, each with unknowns of its own that are
    eliminated, and its share of the first step alone."""

    single: Floats
    """(K, 3, 3) [1/m^2] Hessian of the cost by each position alone, were the tracks' own unknowns known..."""
    common: Floats
    """(K, 3, 2 T) [1/m] ...less the outer product of this with itself, as they are not."""
    gradient: Floats
    """(K, 3) [1/m] gradient of the cost at the middle."""
    middle: Floats
    """(K, 3) [m] positions at which it was linearised."""
    step_hessian: Floats
    """(3, 3) [1/m^2] Hessian by the first step's displacement, for when the first pose leaves the window..."""
    step_gradient: Floats
    """(3,) [1/m] ...and the gradient at the middle."""

    def normal(self, position: Floats, along: Floats) -> tuple[Floats, Floats]:
        """Hessian (K + 1, 3, K + 1, 3) and gradient (K + 1, 3) by the numbers that a motion basis `along`
        (3, K, K + 1) multiplies, at positions (K, 3)."""
        off, back = position - self.middle, np.swapaxes(along, 1, 2)
        slope = self.gradient + (self.single @ off[..., None])[..., 0]
        slope = slope - self.common @ np.einsum("kat,ka->t", self.common, off)
        wide = back @ np.swapaxes(self.common, 0, 1)
        each = back[:, None] @ (np.transpose(self.single, (1, 2, 0))[..., None] * along[None])
        axes, many, _ = wide.shape
        flat = wide.reshape(axes * many, -1)
        hessian = np.transpose(each, (2, 0, 3, 1)) - np.transpose(
            (flat @ flat.T).reshape(axes, many, axes, many), (1, 0, 3, 2)
        )
        return hessian, (back @ slope.T[..., None])[..., 0].T

    def first_step(self, dt: float, velocity: Floats, accel: Floats) -> tuple[Floats, Floats]:
        """Hessian (6, 6) and gradient (6,) of the first step's cost by the velocity after it and its acceleration.

        The step takes `dt` [s], from a velocity (3,) [m/s] with an acceleration (3,) [m/s^2].
        """
        off = dt * velocity + 0.5 * dt**2 * accel - (self.middle[1] - self.middle[0])
        design = np.concatenate([dt * np.eye(3), -0.5 * dt**2 * np.eye(3)], axis=1)
        slope = self.step_gradient + self.step_hessian @ off
        return design.T @ self.step_hessian @ design, design.T @ slope
