"""The estimator of pose and map: the same four functions for every filter that `slam.filter` names."""

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
    """An estimator's state at the start: the start prior, and an empty map."""
    if config.filter == "window":
        return window.init(start, body, ris, sensor, config, rng=rng)
    return nested.init(start, body, ris, sensor, config, rng=rng)


def step(
    state: Any, measurement: Measurement, code: RisCode | None, dt: float, heading: float, config: SlamConfig,
    *, rng: np.random.Generator,
) -> tuple[Any, StepInfo]:  # fmt: skip
    """Advance by one cycle: `dt` [s] since the last, `heading` [rad], `code` as the agent believes it was applied."""
    advance = window.step if isinstance(state, window.WindowState) else nested.step
    return advance(state, measurement, code, dt, heading, config, rng=rng)


def predict(state: Any, dt: float, config: SlamConfig) -> SlamEstimate:
    """The belief carried over `dt` [s] without noise, to where the next cycle finds the agent."""
    return window.predict(_front(state), dt, config)


def revisit(state: Any, start: StartPrior, config: SlamConfig, *, rng: np.random.Generator) -> Any:
    """Another run, or another agent's, on the map of an earlier one: landmarks, walls and who they are stay known.

    The map keeps the covariance that it had; its frame is the earlier run's, and so must be the start's.
    """
    again = window.revisit if isinstance(state, window.WindowState) else nested.revisit
    return again(state, start, config, rng=rng)


def smoothed(state: Any) -> Floats | None:
    """Positions (K, 3) [m] of all cycles with the hindsight of the window; None of a filter that does not look back."""
    return window.smoothed(state) if isinstance(state, window.WindowState) else None


def estimate(state: Any, config: SlamConfig) -> SlamEstimate:
    """An estimator's mean and covariance of the pose, equally likely samples of it, and the map."""
    return window.estimate(_front(state), config)


def _front(state: Any) -> window.WindowState:
    """What pose and map are read from: the window filter's state, or the nested filter's Gaussian view."""
    return state if isinstance(state, window.WindowState) else state.front
