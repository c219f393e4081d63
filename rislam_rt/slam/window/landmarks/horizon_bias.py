"""Horizon bias of direction cosines: a receiver brings those that noise puts beyond the unit disc back to its rim.

Directions lie within the unit disc, and a receiver that finds a pair of cosines beyond it brings them back to the rim.
A ray of radius r (1 on the horizon), heard with noise of standard deviation s along it, is reported at `min(1, r + n)`:
at `r - s (f(a) - a Q(a))` on average, with `a = (1 - r) / s` and the normal density f and upper tail Q, and moves with
r by `1 - Q(a)`. Half of all level returns lie on the rim, and on average they seem to arrive from 0.4 deviations within
it. Taken for an angle, that makes upright walls lean, and what leans seems to tell the height.
"""

import numpy as np
import scipy

from rislam_rt.arrays import Floats

REACH = 4.0
"""Distance from the rim, in standard deviations, up to which the bias is computed: a limit of computation alone. Left
out farther in is at most `f(4) - 4 Q(4)`, 7.1e-6 of a deviation, and of the slope `Q(4)`, 3.2e-5 of itself."""


def correct_horizon_bias(seen: Floats, std: Floats, left: Floats, slopes: Floats) -> None:
    """Correct residuals `left` (A, 3) and slopes (A, 3, D) of predictions `seen` (A, 3), length and cosines, in place
    for a receiver that brings cosines of noise `std` (A, 3) back into the unit disc.

    Where noise is not small against the disc, as along an axis without aperture, they stay.
    """
    radius, most = np.hypot(seen[:, 1], seen[:, 2]), REACH * np.maximum(std[:, 1], std[:, 2])
    near = ((radius + most > 1.0) & (most < 1.0)).nonzero()[0]
    out = seen[near, 1:] / radius[near, None]
    wide = np.sqrt(np.vecdot(out**2, std[near, 1:] ** 2))
    deep = np.maximum(1.0 - radius[near], 0.0) / wide
    beyond = scipy.special.ndtr(-deep)
    lost = wide * (np.exp(-0.5 * deep**2) / np.sqrt(2.0 * np.pi) - deep * beyond)
    left[near, 1:] += lost[:, None] * out
    moves = slopes[near, 1:]
    along = out[:, :1] * moves[:, 0] + out[:, 1:] * moves[:, 1]
    slopes[near, 1:] = moves - (beyond[:, None] * out)[..., None] * along[:, None]
