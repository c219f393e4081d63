"""Inflation of variances by what the bound leaves out: a peak's bias, faint neighbours, mirrored directions.

A bound knows the paths that were found and takes their amplitudes for true. The errors are larger, and a filter that
believes the bound alone is sure of what is wrong.
"""

import numpy as np
import scipy

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.model import RadioConfig

PEAK_EXCESS = 2.5
"""Mean of the SNR measured at a peak less the true one: one for the noise's energy, a half for each of the three
parameters over which the peak is the highest."""
REACH = 6.0
"""Resolution cells of delay on either side over which neighbours are counted."""
SAME = 0.7
"""Distance [cells] in the other two parameters within which a neighbour counts: one further off does not pull."""
LEVEL = 0.5
"""Probability that a path arrives level, as over any upright wall where Tx and Rx are as high as each other."""
UNSEEN = 0.4
"""SNR of the undetected neighbours in a cell, over the threshold, for each detected neighbour in a cell: set to the
wall returns of the paper's room, tried on everything else (`benchmarks/receiver/room.py`)."""


def peak_bias(snr: Floats) -> Floats:
    """Factor (...,) by which variances are too small as the SNR (...,) was measured at a peak (all antennas)."""
    return snr / np.maximum(snr - PEAK_EXCESS, 0.25 * snr)


def crowding(parameters: Floats, threshold: float, radio: RadioConfig) -> Floats:
    """Factors (P, 3) by which variances of paths (P, 3), in (B tau, u, v), are too small by undetected neighbours.

    Neighbours along one axis, `density` a cell and of SNR q each, do to the estimate on that axis what `q density` of
    N0 would add: the square of the autocorrelation's slope, integrated over all offsets, is the bound's own second
    derivative. What is not seen has an SNR below the threshold, and is the denser the more is seen.
    """
    cells = np.array([1.0, radio.array.rows * radio.array.spacing, radio.array.cols * radio.array.spacing])
    reach = np.array([REACH, *(2.0 * cells[1:])])  # all of the sky, which is two cosines wide
    span = np.array([2.0, 1.0, 1.0]) * reach
    apart = np.abs(parameters[:, None] - parameters) * cells
    factor = np.ones_like(parameters)
    for axis in range(3):
        beside = np.linalg.norm(np.delete(apart, axis, axis=-1), axis=-1) < SAME
        seen = np.sum(beside & (apart[..., axis] < reach[axis]), axis=1) - 1
        factor[:, axis] += UNSEEN * threshold * seen / span[axis]
    return factor


def unmirrored(cosines: Floats, gain: Complexes, radio: RadioConfig) -> tuple[Floats, Complexes]:
    """Direction cosines (N, 2) whose variance is inflated, those outside the unit disc moved into it by an array's
    period (grating lobe), and the complex gains (N,) of their paths there."""
    outside = np.linalg.norm(cosines, axis=-1, keepdims=True) > 1.0
    periods = np.where(outside, np.round(cosines * radio.array.spacing), 0.0)
    turned = np.where(periods % 2.0 == 1.0, radio.array.mirrored_signs, 1.0).prod(axis=-1)
    return cosines - periods / radio.array.spacing, gain * turned


def mirror_variance(cosines: Floats, deviation: Floats, radio: RadioConfig) -> Floats:
    """Variances (N, 2) of direction cosines from the ambiguity with grating lobes, a period of the array away.

    The samples are the same for both. Their odds are those of arriving level (`LEVEL`), at the rim of the unit disc, or
    anywhere else in the sky, given the estimate and its deviation.
    """
    period, deviation = 1.0 / radio.array.spacing, np.maximum(deviation, 1e-12)
    image = cosines - period * np.where(cosines < 0.0, -1.0, 1.0)
    rim = np.sqrt(np.maximum(1.0 - cosines[:, ::-1] ** 2, 1e-12))
    own, other = (
        LEVEL * np.exp(-0.5 * ((np.abs(x) - rim) / deviation) ** 2) / (np.sqrt(2.0 * np.pi) * deviation)
        + (1.0 - LEVEL) / rim * scipy.special.ndtr((rim - np.abs(x)) / deviation)
        for x in (cosines, image)
    )
    aperture = np.array([radio.array.rows, radio.array.cols]) > 1
    return aperture * period**2 * other / np.maximum(own + other, 1e-12)
