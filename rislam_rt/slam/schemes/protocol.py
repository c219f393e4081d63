"""Protocol of every SLAM estimator of pose and map: four functions, the same inputs and outputs for all of them.

The default filter (`slam`) and each folder of `slam.schemes` are such a set, as modules.
"""

from typing import Any, Protocol

import numpy as np

from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel, SlamEstimate
from rislam_rt.slam.start_prior import StartPrior


class SlamEstimator(Protocol):
    """Protocol of a SLAM estimator: `init`, `step`, `predict`, `estimate`; state and settings are its own."""

    def init(
        self, start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: Any,
        *, rng: np.random.Generator,
    ) -> Any:  # fmt: skip
        """Protocol of an estimator: state before the first cycle, the start prior of the agent, and an empty map."""
        ...

    def step(
        self, state: Any, measurement: Measurement, code: RisCode | None, dt: float, heading: float, config: Any,
        *, rng: np.random.Generator,
    ) -> tuple[Any, Any]:  # fmt: skip
        """Protocol of an estimator: state after a measurement, and its `StepInfo`; `dt` [s] since the last, `heading`
        [rad], code as believed."""
        ...

    def predict(self, state: Any, dt: float, config: Any) -> SlamEstimate:
        """Protocol of an estimator: pose and map predicted `dt` [s] ahead without noise, for which the next code is
        designed."""
        ...

    def estimate(self, state: Any, config: Any) -> SlamEstimate:
        """Protocol of an estimator: what the state holds, that is mean, covariance, equally likely samples of the pose,
        and the map."""
        ...
