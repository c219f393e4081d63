"""Estimators of pose and map from measurements: the project's filters and the rivals, behind one set of functions."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rislam_rt import slam
from rislam_rt.arrays import Integers
from rislam_rt.errors import ConfigError, expect
from rislam_rt.information.landmark_model import Unknown
from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel, SlamEstimate
from rislam_rt.pipeline.own_methods import load_own, own_method_errors
from rislam_rt.pipeline.specification.spec import Settings
from rislam_rt.slam import StartPrior
from rislam_rt.slam.schemes import bp_slam, bp_slam_aoa, channel_slam

ROUNDING = 1e-6
"""Negative eigenvalues of a covariance over its largest one, that rounding in single precision may leave."""
FARTHEST = 1e12
"""[m] Largest coordinate that a filter of one's own may give: as the largest number of a pipeline file; scores, which
square it, stay finite."""


class Estimator(NamedTuple):
    """`init -> state`, `predict` before the design, `step` with the measurements, `estimate` after it."""

    init: Callable[..., Any]
    predict: Callable[..., Any]
    step: Callable[..., Any]
    estimate: Callable[..., Any]
    config: Callable[[Settings], Any]
    """The estimator's own settings among those of the run."""
    angles: bool = True
    """Whether it uses angles of arrival, or delays alone: what its posterior bound may count."""
    walls: Unknown = "planes"
    """How its bound holds mirror images: `planes`, tied to walls; `images`, each a point of its own."""
    use_vt: Callable[[Settings], bool] = lambda settings: settings.slam.use_vt
    """Whether wall returns are among the measurements of its map."""
    smoothed: Callable[..., Any] = lambda state: None
    """Positions (K, 3) of all cycles with hindsight; None of an estimator that does not look back."""


class Outcomes(NamedTuple):
    """What is read of the diagnostics of an estimator of one's own: it has none."""

    landmark: Integers
    """(M,) -1: no component is known to be of a landmark."""
    outcome: str = "ok"


def own_estimator(name: str) -> Estimator:
    """An estimator of one's own (`docs/own_methods.md`) behind the functions of all others."""
    own = load_own(name)

    def checked(found: SlamEstimate, what: str) -> SlamEstimate:
        expect(f"'{name}': {what}", found, SlamEstimate)
        far = float(np.abs(found.position).max())
        if far > FARTHEST:
            raise ConfigError(f"'{name}': {what}: a position of {far:g} m returned; give one up to {FARTHEST:g} m")
        least, *_, most = np.linalg.eigvalsh(0.5 * (found.covariance + found.covariance.T))
        if least < -ROUNDING * max(most, 0.0):
            raise ConfigError(
                f"'{name}': {what}: a covariance with an eigenvalue of {least:g} returned; give none below 0"
            )
        return found

    def init(start: StartPrior, body: Body, panel: DataSheet | None, sensor: SensorModel, config: Any,
             *, rng: np.random.Generator) -> Any:  # fmt: skip
        with own_method_errors(name):
            return own.init(start, body, panel, sensor, rng=rng)

    def estimate(state: Any, config: Any = None) -> SlamEstimate:
        with own_method_errors(name):
            found: SlamEstimate = own.estimate(state)
        return checked(found, "estimate")

    def predict(state: Any, ahead: float, config: Any) -> SlamEstimate:
        if not hasattr(own, "predict"):
            return estimate(state)
        with own_method_errors(name):
            found: SlamEstimate = own.predict(state, ahead)
        return checked(found, "predict")

    def step(
        state: Any, measurement: Measurement, code: RisCode | None, dt: float, heading: float, config: Any,
        *, rng: np.random.Generator,
    ) -> tuple[Any, Outcomes]:  # fmt: skip
        with own_method_errors(name):
            state = own.step(state, measurement, code, dt, heading, rng=rng)
        return state, Outcomes(np.full(len(measurement), -1))

    return Estimator(init, predict, step, estimate, lambda settings: None, use_vt=lambda settings: False)


class Estimators(dict[str, Estimator]):
    """Estimators by name; one that is not built in is looked up among methods of one's own."""

    def __missing__(self, name: str) -> Estimator:
        return own_estimator(name)


ESTIMATORS = Estimators({
    "slam": Estimator(
        slam.init, slam.predict, slam.step, slam.estimate, lambda settings: settings.slam, smoothed=slam.smoothed
    ),
    "bp_slam": Estimator(
        bp_slam.init, bp_slam.predict, bp_slam.step, bp_slam.estimate, lambda settings: settings.bp_slam,
        angles=False, walls="images", use_vt=lambda settings: settings.bp_slam.planes,
    ),
    "bp_slam_aoa": Estimator(
        bp_slam_aoa.init, bp_slam_aoa.predict, bp_slam_aoa.step, bp_slam_aoa.estimate,
        lambda settings: settings.bp_slam_aoa, use_vt=lambda settings: settings.bp_slam_aoa.use_vt,
    ),
    "channel_slam": Estimator(
        channel_slam.init, channel_slam.predict, channel_slam.step, channel_slam.estimate,
        lambda settings: settings.channel_slam, angles=False, walls="images",
        use_vt=lambda settings: settings.channel_slam.planes,
    ),
})  # fmt: skip
"""All built-in estimators by name, and those of one's own when they are asked for."""
