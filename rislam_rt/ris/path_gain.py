"""Predicted path gains over mirror images, point scatterers and panels, from positions and strengths alone."""

import numpy as np

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.model import RadioConfig, RisCode, RisSpec
from rislam_rt.ris.response import element_distances, element_pattern, leg_scale


def image_amplitude(length: Floats, radio: RadioConfig) -> Floats:
    """Amplitude |alpha| of a wall return over perfect walls, eq. `a1`: free space along `length` (...,) [m]."""
    return radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain) / (4.0 * np.pi * length)


def point_amplitude(strength: Floats, tx_length: Floats, rx_length: Floats, radio: RadioConfig) -> Floats:
    """Amplitude |alpha| of a path over a point scatterer, eq. `a2`; `strength` is the cross-section's root [m]."""
    scale = radio.wavelength * np.sqrt(4.0 * np.pi * radio.tx_gain * radio.rx_gain) / (4.0 * np.pi) ** 2
    return scale * strength / (tx_length * rx_length)


def panel_path_gain(
    spec: RisSpec, code: RisCode, center: Floats, tx: Floats, rx: Floats, ratio: Floats, radio: RadioConfig
) -> Complexes:
    """Complex gain (...,) of a path over a panel at `center` (..., 3) between (mirrored) ends (..., 3), under a code.

    `ratio` (...,) is the amplitude ratio of the wall reflections.

    Both legs and the code turn an element's signal together; in single precision an element errs by 1e-7 of a turn. Its
    pattern is a power of the cosine, and so that of both legs is the pattern of the product of their cosines.
    """
    ends = np.stack([tx, rx])
    distance, onward = element_distances(spec, center, ends)
    turns = (distance + onward) / radio.wavelength + code.xi / (2.0 * np.pi)
    angle = (2.0 * np.pi * (np.rint(turns) - turns)).astype(np.float32)
    nearness = np.reciprocal((distance * onward).astype(np.float32))
    facing = np.prod(np.maximum((ends - center) @ spec.normal, 0.0), axis=0).astype(np.float32)
    amplitude = nearness * np.sqrt(element_pattern(spec, nearness * facing[..., None, None]))
    every = (*amplitude.shape[:-2], -1)
    real, imaginary = (np.vecdot(amplitude.reshape(every), part(angle).reshape(every)) for part in (np.cos, np.sin))
    scale = leg_scale(spec, radio.wavelength) ** 2 * np.sqrt(radio.tx_gain * radio.rx_gain)
    return np.asarray(ratio * scale * (real + 1j * imaginary))
