"""The receiver's front end in a run: draws its hardware impairments and calibrates it before the first cycle."""

from dataclasses import replace

import numpy as np

from rislam_rt.measurement import FrontEnd, HardwareConfig, build_front_end, calibrate, capture, receive
from rislam_rt.measurement.received_paths import direct_gain
from rislam_rt.model import Body, Paths, Trajectory
from rislam_rt.pipeline.specification.pipeline_spec import Settings


def prepare_front_end(
    paths: Paths, motion: Trajectory, body: Body, settings: Settings, *, rng: np.random.Generator
) -> FrontEnd | None:
    """Draw the hardware impairments of the receiver's front end, and calibrate it if asked; None for an ideal one.

    All schemes of a run share it. It is calibrated by the direct path in captures of the first cycles, whose noise is
    not that of the run.

    Parameters
    ----------
    paths
        True paths along the motion, RIS panel at phase level 0.
    body
        Designed offsets of Tx and Rx, which say where the direct path comes from.
    """
    if settings.hardware == HardwareConfig():
        return None
    build, noise = rng.spawn(2)
    front_end = build_front_end(settings.hardware, settings.radio, settings.receiver, rng=build)
    if not settings.hardware.calibration_cycles:
        return front_end
    radio, receiver = settings.radio, replace(settings.receiver, alternation=False)
    recorded = []
    for cycle in range(min(settings.hardware.calibration_cycles, len(motion))):
        heard = receive(paths, cycle, float(motion.heading[cycle]), radio, receiver)
        one, *_ = capture(heard, radio, receiver, front_end, direct_gain(paths, cycle), rng=noise)
        recorded.append(one.samples)
    swinging = settings.hardware.agc_std_db > 0.0
    return front_end._replace(correction=calibrate(recorded, body, radio, receiver, swinging=swinging))
