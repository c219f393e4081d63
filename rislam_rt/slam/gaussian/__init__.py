"""The Rao-Blackwellised engine: few particles, each a Gaussian over pose, recent trail and map."""

from rislam_rt.slam.gaussian.birth import settle
from rislam_rt.slam.gaussian.particles import (
    Particles,
    begin,
    drop,
    effective_size,
    furnish,
    moments,
    propagate,
    thin,
    trail,
)
from rislam_rt.slam.gaussian.update import Update, update

__all__ = [
    "Particles",
    "Update",
    "begin",
    "drop",
    "effective_size",
    "furnish",
    "moments",
    "propagate",
    "settle",
    "thin",
    "trail",
    "update",
]
