"""The protocol of every estimator of pose and map: four functions, the same inputs and outputs for all of them.

The default filter (`slam`) and each folder of `slam.schemes` are such a set, as modules.
"""

from typing import Any, Protocol

import numpy as np

from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel, SlamEstimate
from rislam_rt.slam.start_prior import StartPrior


class SlamEstimator(Protocol):
    """State and settings are the estimator's own."""

    def init(
        self, start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: Any,
        *, rng: np.random.Generator,
    ) -> Any:  # fmt: skip
        """The state before the first cycle: the start prior, and nothing known of the room."""
        ...

    def step(
        self, state: Any, measurement: Measurement, code: RisCode | None, dt: float, heading: float, config: Any,
        *, rng: np.random.Generator,
    ) -> tuple[Any, Any]:  # fmt: skip
        """State after a cycle, and its `StepInfo`: `dt` [s] since the last, `heading` [rad], the code held applied."""
        ...

    def predict(self, state: Any, dt: float, config: Any) -> SlamEstimate:
        """The belief carried over `dt` [s] without noise: what the design of the next code goes by."""
        ...

    def estimate(self, state: Any, config: Any) -> SlamEstimate:
        """What every estimator gives: mean and covariance of the pose, equally likely samples of it, and the map."""
        ...
