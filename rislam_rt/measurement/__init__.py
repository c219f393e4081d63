"""Floor 5: the receiver. What arrives, the noise, and multipath components with their standard deviations."""

from rislam_rt.measurement.bound import detection_probability
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.measure import measure
from rislam_rt.measurement.noise import (
    paper_snr_db,
    path_snr_db,
    reference_gain,
    with_paper_snr,
    with_reference_snr,
)
from rislam_rt.measurement.parts import path_std
from rislam_rt.measurement.received import twin

__all__ = [
    "ReceiverConfig",
    "detection_probability",
    "measure",
    "paper_snr_db",
    "path_snr_db",
    "path_std",
    "reference_gain",
    "twin",
    "with_paper_snr",
    "with_reference_snr",
]
