"""Rate factor: what path lengths that no feature explains tell of the agent's way, as a quadratic on the window's
poses."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.window.smoother.motion_basis import rotation


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

    def slope(self, position: Floats) -> Floats:
        """Gradient (K, 3) of the rates' cost by the positions, at positions (K, 3)."""
        off = position - self.middle
        flat = self.common.reshape(off.size, -1)
        own = (flat @ (off.ravel() @ flat)).reshape(off.shape)
        return self.gradient + (self.single @ off[..., None])[..., 0] - own

    def first_step(self, dt: float, angle: float, velocity: Floats, accel: Floats) -> tuple[Floats, Floats]:
        """Hessian (6, 6) and gradient (6,) of the first step's cost by the velocity after it and its acceleration.

        The step takes `dt` [s], from a velocity (3,) [m/s] that turns by `angle` [rad], with an acceleration (3,)
        [m/s^2].
        """
        before, turn = np.eye(3), rotation(angle)
        off = 0.5 * dt * (before + turn) @ velocity + 0.5 * dt**2 * accel - (self.middle[1] - self.middle[0])
        design = np.concatenate([0.5 * dt * (before + turn.T), -0.5 * dt**2 * turn.T], axis=1)
        slope = self.step_gradient + self.step_hessian @ off
        return design.T @ self.step_hessian @ design, design.T @ slope
