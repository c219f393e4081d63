"""The estimator of the agent's pose and the map: the same functions for every filter that `slam.filter` names."""

from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel, SlamEstimate
from rislam_rt.slam import window
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.nested import particle_filter as nested
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.step_info import StepInfo


def init(
    start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: SlamConfig,
    *, rng: np.random.Generator,
) -> Any:  # fmt: skip
    """State of the SLAM estimator before the first cycle: the start prior of the agent, and an empty map."""
    if config.filter == "window":
        return window.init(start, body, ris, sensor, config, rng=rng)
    return nested.init(start, body, ris, sensor, config, rng=rng)


def step(
    state: Any, measurement: Measurement, code: RisCode | None, dt: float, heading: float, config: SlamConfig,
    *, rng: np.random.Generator,
) -> tuple[Any, StepInfo]:  # fmt: skip
    """Advance the SLAM estimator by a measurement: `dt` [s] since the last, `heading` [rad], `code` held applied."""
    advance = window.step if isinstance(state, window.WindowState) else nested.step
    return advance(state, measurement, code, dt, heading, config, rng=rng)


def predict(state: Any, dt: float, config: SlamConfig) -> SlamEstimate:
    """Estimate by the SLAM estimator of pose and map predicted `dt` [s] ahead without noise, where the next cycle finds
    the agent."""
    return window.predict(_front(state), dt, config)


def revisit(state: Any, start: StartPrior, config: SlamConfig, *, rng: np.random.Generator) -> Any:
    """State of the SLAM estimator that begins another run, or another agent's, on an earlier run's map and identities.

    The map keeps the covariance that it had; its frame is the earlier run's, and so must be the start's.
    """
    again = window.revisit if isinstance(state, window.WindowState) else nested.revisit
    return again(state, start, config, rng=rng)


def smoothed(state: Any) -> Floats | None:
    """Smoothed positions (K, 3) [m] by the SLAM estimator in all cycles; None of a filter without smoothing."""
    return window.smoothed(state) if isinstance(state, window.WindowState) else None


def estimate(state: Any, config: SlamConfig) -> SlamEstimate:
    """Estimate that a SLAM filter's state holds: mean, covariance, equally likely samples of the pose, and the map."""
    return window.estimate(_front(state), config)


def _front(state: Any) -> window.WindowState:
    """Window state from which the SLAM estimator reads pose and map: the window filter's own, or the nested filter's
    Gaussian view."""
    return state if isinstance(state, window.WindowState) else state.front
