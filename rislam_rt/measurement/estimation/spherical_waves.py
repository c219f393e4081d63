"""Spherical-wave signals of paths without the plane-wave and narrow-band approximations, for wide bands and near walls.

At 1 GHz around 10 GHz the phase across four elements changes by a few tenths of a radian from one end of the band to
the other, and a wall a metre away bends the wave front by as much: `inner_products` then leave a hundredth of a
wall's energy behind, which is 40 dB above a panel's. Here every element has its own delay. The wave front's radius is
taken as the whole path, true of leakage and wall returns, the only ones strong enough to matter.
"""

import numpy as np

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.measurement.estimation.sounding import Sounding, tone_response

SHORTEST_RADIUS = 0.5
"""Smallest radius of a wave front [wavelengths]; smaller ones are taken for this."""


def wave_signals(sounding: Sounding, parameters: Floats) -> Complexes:
    """Spherical-wave signals (L M, P) of paths (P, 3), antenna by antenna, of unit amplitude at the array's centre."""
    excess = _excess(sounding, parameters)
    delay = parameters[:, 0] + sounding.squint * excess
    tones = tone_response(sounding.frequency, delay.ravel()).reshape(len(sounding.frequency), *excess.shape)
    waves = np.exp(-2j * np.pi * excess) * tones
    return waves.transpose(1, 0, 2).reshape(sounding.num_samples, len(parameters))


def correlate_waves(sounding: Sounding, waves: Complexes, samples: Complexes) -> tuple[Complexes, Complexes]:
    """Correlate spherical-wave signals and their derivatives with samples (L, M): `a^H y` (P,) and `d^H y` (3, P)."""
    product = waves.conj() * samples.reshape(-1, 1)
    x, y = (part.ravel() for part in np.meshgrid(sounding.row, sounding.col, indexing="ij"))
    stretch = 1.0 + sounding.squint * sounding.frequency
    weights = np.stack([np.ones((len(x), 1)) * sounding.frequency, -x[:, None] * stretch, -y[:, None] * stretch])
    slopes = 2j * np.pi * weights.reshape(3, -1) @ product
    return product.sum(axis=0), slopes


def _excess(sounding: Sounding, parameters: Floats) -> Floats:
    """Excess length (L, P) [wavelengths] of each path to each element over that to the array's centre."""
    x, y = (part.reshape(-1, 1) for part in np.meshgrid(sounding.row, sounding.col, indexing="ij"))
    radius = np.maximum(parameters[:, 0] / sounding.squint, SHORTEST_RADIUS)
    along = x * parameters[:, 1] + y * parameters[:, 2]
    square = x**2 + y**2 - 2.0 * radius * along
    return square / (np.sqrt(np.maximum(radius**2 + square, 0.0)) + radius)
