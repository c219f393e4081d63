"""Detection threshold, or noise, told too high: what is reported below it shows that it is lower."""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import SensorModel
from rislam_rt.slam.model_constants import CONSTANTS


def sensor_of_reports(told: SensorModel, reported: tuple[Floats, ...]) -> SensorModel:
    """Sensor model with a detection threshold below which the SNRs of components `reported` (K cycles, (M,) each) are
    as few as any other rare event; that of the sensor `told` where they are.

    A receiver that estimates several paths at once reports a few below its threshold: one of all, or the share `rare`
    where that is more, says nothing of it.
    """
    snr = np.concatenate(reported)
    few = 1 + int(CONSTANTS.rare * len(snr))
    faint = snr[(snr > 0.0) & (snr < told.threshold)]
    if len(faint) <= few:
        return told
    return replace(told, threshold=float(np.partition(faint, few)[few]))
