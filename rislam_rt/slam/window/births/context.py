"""What births and deaths read and change."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import RisCode
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.landmark_update import VisibilityObservations
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.measurement_log import Log, Residuals, renew
from rislam_rt.slam.window.smoother import window_gaussian
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.tracks import WindowTracks


class Context(NamedTuple):
    """The belief, the window's components, and the tracks among them."""

    window: Window
    landmarks: WindowTable
    log: Log
    tracks: WindowTracks
    heading: Floats
    scene: KnownEnvironment
    cycle: int
    visibility: VisibilityObservations
    codes: tuple[RisCode | None, ...]


def resolve(context: Context, steps: int) -> tuple[Window, Residuals]:
    """Gauss-Newton over the whole window."""
    window, every = context.window, np.arange(context.window.num_poses)
    for _ in range(steps):
        window, left = renew(window, context.log, context.landmarks, context.scene.body, context.heading, every)
        window = window_gaussian.weigh_holds(window_gaussian.solve(window))
    return window, left
