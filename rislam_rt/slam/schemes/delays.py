"""What a delay-only scheme takes from a measurement: lengths of the components that static points may have made."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.model import Body, Measurement, RadioConfig
from rislam_rt.slam.filter import glance_of, is_los


def point_ranges(
    measurement: Measurement, body: Body, radio: RadioConfig, specular_ratio: float | None, smallest_std: float
) -> tuple[Floats, Floats, Integers]:
    """Ranges (R,) [m], standard deviations (R,) [m] and rows (R,) of the components that are not set aside.

    Set aside are the direct path, whose length the body's drawing tells, and whatever is as strong as only a wall
    return is: the image behind a wall moves with an agent that carries the transmitter, so that it is no static point.

    Parameters
    ----------
    specular_ratio
        Amplitude over that of free space of the same length, above which a component is a wall return; None keeps all.
    smallest_std
        Smallest standard deviation that is believed [m].
    """
    glance = glance_of(measurement, radio)
    free: Booleans = ~is_los(glance, body)
    if specular_ratio is not None:
        free &= glance.ratio <= specular_ratio
    rows = np.flatnonzero(free)
    return glance.seen[rows, 0], np.maximum(glance.std[rows, 0], smallest_std), rows
