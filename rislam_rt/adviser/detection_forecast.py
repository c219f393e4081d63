"""Forecast of detection at one position: probability that the receiver reports each landmark, no noise drawn."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.measurement import Received, receive
from rislam_rt.measurement.bound_receiver import NEGLIGIBLE
from rislam_rt.measurement.components import NoiselessComponents, merge, select_paths, single
from rislam_rt.measurement.slot_motion import split_by_code
from rislam_rt.model import Paths, SensorModel
from rislam_rt.pipeline.specification.pipeline_spec import Settings


class DetectionForecast(NamedTuple):
    """Forecast of the detection of L landmarks at one position under one RIS code."""

    probability: Floats
    """(L,) probability that at least one component comes from the landmark."""
    snr: Floats
    """(L,) SNR of the landmark's strongest path that the array receives, linear, over all antennas; 0 without one."""
    covered: Integers
    """(L,) column of the path in whose component the landmark's strongest one is merged; -1 if it has its own."""


def forecast_detection(paths: Paths, cycle: int, heading: float, settings: Settings) -> DetectionForecast:
    """Forecast the detection of all landmarks in one cycle of a room's paths, by the receiver of these settings.

    The same steps as a run's receiver: the side that the array receives, the two captures of alternated codes, paths
    that cannot be resolved joined, detection by Marcum's function; errors and false components left out, motion within
    the slot too.
    """
    radio, sensor = settings.radio, settings.sensor
    received = receive(paths, cycle, heading, radio, settings.receiver)
    count = len(paths.landmarks)
    missed, strongest, covered = np.ones(count), np.zeros(count), np.full(count, -1)
    for capture in split_by_code(received, settings.receiver):
        snr, owner = radio.integrated_snr(capture.gain), paths.landmark[capture.path]
        loud = select_paths(capture, snr > NEGLIGIBLE * sensor.threshold)
        parts = merge(loud, sensor) if settings.receiver.merge else single(loud)
        inside = sensor.in_window(parts.tau)
        chance = sensor.detection_probability(radio.integrated_snr(parts.gain)) * inside
        of_part = paths.landmark[parts.path]
        np.multiply.at(missed, of_part[of_part >= 0], 1.0 - chance[of_part >= 0])
        for landmark in range(count):
            own = np.flatnonzero(owner == landmark)
            row = int(own[np.argmax(snr[own])]) if len(own) else -1
            if row >= 0 and snr[row] > strongest[landmark]:
                strongest[landmark] = snr[row]
                covered[landmark] = _cover(loud, int(capture.path[row]), parts, sensor)
    return DetectionForecast(1.0 - missed, strongest, covered)


def _cover(loud: Received, path: int, parts: NoiselessComponents, sensor: SensorModel) -> int:
    """Column of the strongest path in whose component a path is forecast to merge; -1 if it has its own or is too
    weak."""
    row = np.flatnonzero(loud.path == path)
    if path in parts.path or not len(row):
        return -1
    leaders = np.flatnonzero(np.isin(loud.path, parts.path))
    points = np.column_stack([loud.tau, loud.direction[:, :2]])
    near = leaders[sensor.may_merge(points[leaders] - points[row])]
    return int(loud.path[near[np.argmax(np.abs(loud.gain[near]))]]) if len(near) else -1
