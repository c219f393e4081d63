"""Diffuse multipath: the dense tail of reflections that no path stands for, as coloured noise."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.model import RadioConfig


@dataclass(frozen=True, slots=True)
class DiffuseTail:
    """Power delay profile `S(tau) = (power / decay) exp(-(tau - onset) / decay)` from `onset` on, else 0."""

    power: float
    """Power gain of the whole tail, a ratio like |alpha|^2."""
    onset: float
    """[s]."""
    decay: float
    """[s]."""

    def __post_init__(self) -> None:
        if not (self.power >= 0.0 and self.decay > 0.0):
            given = f"diffuse.power, diffuse.decay: {self.power}, {self.decay} received"
            raise ConfigError(f"{given}; give at least 0 and a positive time")

    def density(self, tau: Floats) -> Floats:
        """S (...,) [1/s] at delays (...,) [s]."""
        late = np.asarray(tau, dtype=np.float64) - self.onset
        return np.where(late >= 0.0, self.power / self.decay * np.exp(-np.maximum(late, 0.0) / self.decay), 0.0)


def diffuse_snr(gain: Floats, tau: Floats, radio: RadioConfig, tail: DiffuseTail) -> Floats:
    """SNR (...,) over all antennas of paths with gains and delays (...,) in noise and diffuse multipath, linear.

    What falls into one resolution cell 1/B of the tail adds to the noise: `L E |alpha|^2 / (N0 + S(tau) E / B)`
    (Witrisal et al., IEEE SPM 2016), for a profile that is smooth over 1/B. Use it wherever an SNR is asked for.
    """
    floor = 1.0 + tail.density(tau) * radio.energy / (radio.bandwidth * radio.noise_psd)
    return radio.integrated_snr(gain) / floor
