"""True identity of estimated components: which path each most likely is, for scoring only, never shown to the agent."""

import numpy as np
import scipy

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.measurement.received_paths import Received
from rislam_rt.model import RadioConfig

TOLERANCE = 0.3
"""Misfit of a delay or cosine [resolution cells] that counts as one unit."""
LOUDNESS = 6.0
"""Misfit of the amplitude [dB] that counts as one unit."""
GATE = 9.0
"""Largest sum of squared misfits at which a component is taken for a path."""
FAINTEST = 1.0
"""SNR over all antennas (linear) below which no path is taken for the cause of a component."""


def identify(tau: Floats, cosines: Floats, gain: Complexes, received: Received, radio: RadioConfig) -> Integers:
    """Column (N,) of the true path that each estimated component most likely is, -1 for none.

    The assignment with the least sum of squared misfits in delay, cosines and amplitude. The scale is the resolution
    cell, not the bound: next to a stronger path a component errs by more than its bound, and is still that path. So it
    is if it came out on the wrong side of the sky, where the array cannot tell (`u` from `u - 1 / spacing`).
    """
    heard = np.flatnonzero(radio.integrated_snr(received.gain) > FAINTEST)
    beams = [1.0 / (n * radio.array.spacing) if n > 1 else np.inf for n in (radio.array.rows, radio.array.cols)]
    delay = (tau[:, None] - received.tau[heard]) * radio.bandwidth / TOLERANCE
    period = 1.0 / radio.array.spacing
    offset = cosines[:, None] - received.direction[heard, :2]
    angle = (offset - period * np.round(offset / period)) / np.array(beams) / TOLERANCE
    ratio = np.abs(gain)[:, None] / np.abs(received.gain[heard])
    loudness = 20.0 * np.log10(np.maximum(ratio, 1e-300)) / LOUDNESS
    misfit = delay**2 + np.sum(angle**2, axis=-1) + loudness**2
    # A stand-in column for each component, at the gate, makes "none of them" the answer where nothing fits.
    cost = np.concatenate([np.minimum(misfit, 10.0 * GATE), np.full((len(tau), len(tau)), GATE)], axis=1)
    rows, cols = scipy.optimize.linear_sum_assignment(cost)
    path = np.full(len(tau), -1)
    taken = cols < len(heard)
    path[rows[taken]] = received.path[heard[cols[taken]]]
    return path
