"""Estimators of pose and map from measurements, behind one set of functions: the package's SLAM filters, other
published schemes, and a user's own."""

from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from rislam_rt import slam
from rislam_rt.arrays import Integers
from rislam_rt.information.landmark_model import Unknown
from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel, SlamEstimate
from rislam_rt.pipeline.estimate_checks import check_estimate
from rislam_rt.pipeline.own_methods import fresh_own, own_method_errors
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.specification.pipeline_spec import Settings
from rislam_rt.slam import StartPrior
from rislam_rt.slam.schemes import bp_slam, bp_slam_aoa, channel_slam


class Estimator(NamedTuple):
    """Functions of one SLAM estimator, and what its posterior bound must know of it."""

    init: Callable[..., Any]
    """Returns the state at the start."""
    predict: Callable[..., Any]
    """Returns the belief predicted to the next cycle, for the code design."""
    step: Callable[..., Any]
    """Returns state and diagnostics after a cycle's measurement."""
    estimate: Callable[..., Any]
    """Returns pose and map of a state."""
    config: Callable[[Settings], Any]
    """Picks the estimator's settings from those of the run."""
    angles: bool = True
    """Whether it uses angles of arrival, or delays alone: the same goes for its posterior bound."""
    walls: Unknown = "planes"
    """Unknowns of mirror images in its posterior bound: `planes`, those of walls; `images`, each image a point."""
    use_vt: Callable[[Settings], bool] = lambda settings: settings.slam.use_vt
    """Whether wall returns (VT paths) are among the measurements of its map."""
    smoothed: Callable[..., Any] = lambda state: None
    """Returns smoothed positions (K, 3) [m] of all cycles; None of an estimator that does not smooth."""


class OwnDiagnostics(NamedTuple):
    """Diagnostics that stand for those of a user's own or an external estimator in one cycle."""

    landmark: Integers
    """(M,) number of the landmark that each component was associated with, -1 for none."""
    outcome: str = "ok"
    """`diverged` where the estimator holds itself for lost."""


def own_estimator(name: str) -> Estimator:
    """Estimator made of the user's own class of that name (`docs/own_methods.md`), of an object of its own each time.

    What it returns is checked: the functions raise `ConfigError` for whatever it raises, and for poses and maps that
    cannot be. It uses wall returns if it says so by `use_vt = True`.
    """
    own = fresh_own(name)

    @own_method_errors(name)
    def init(start: StartPrior, body: Body, panel: DataSheet | None, sensor: SensorModel, config: Any,
             *, rng: np.random.Generator) -> Any:  # fmt: skip
        return own.init(start, body, panel, sensor, rng=rng)

    @own_method_errors(name)
    def estimate(state: Any, config: Any = None) -> SlamEstimate:
        return check_estimate(own.estimate(state), f"'{name}': estimate")

    @own_method_errors(name)
    def predict(state: Any, ahead: float, config: Any) -> SlamEstimate:
        if not hasattr(own, "predict"):
            return estimate(state)
        return check_estimate(own.predict(state, ahead), f"'{name}': predict")

    @own_method_errors(name)
    def step(
        state: Any, measurement: Measurement, code: RisCode | None, dt: float, heading: float, config: Any,
        *, rng: np.random.Generator,
    ) -> tuple[Any, OwnDiagnostics]:  # fmt: skip
        state = own.step(state, measurement, code, dt, heading, rng=rng)
        return state, OwnDiagnostics(np.full(len(measurement), -1))

    return Estimator(
        init, predict, step, estimate, lambda settings: None,
        use_vt=lambda settings: bool(getattr(own, "use_vt", False)),
    )  # fmt: skip


class Estimators(dict[str, Estimator]):
    """SLAM estimators by name; a name that is not built in is loaded as a user's own (`module:attribute`)."""

    def __missing__(self, name: str) -> Estimator:
        return own_estimator(name)


def _built_in(home: Any, name: str, **traits: Any) -> Estimator:
    """Estimator of that name whose functions are those of the module `home`."""
    return Estimator(home.init, home.predict, home.step, home.estimate, attrgetter(name), **traits)


ESTIMATORS = Estimators(
    slam=_built_in(slam, "slam", smoothed=slam.smoothed),
    bp_slam=_built_in(bp_slam, "bp_slam", angles=False, walls="images", use_vt=attrgetter("bp_slam.planes")),
    bp_slam_aoa=_built_in(bp_slam_aoa, "bp_slam_aoa", use_vt=attrgetter("bp_slam_aoa.use_vt")),
    channel_slam=_built_in(
        channel_slam, "channel_slam", angles=False, walls="images", use_vt=attrgetter("channel_slam.planes")
    ),
)
"""Built-in SLAM estimators by name; a user's own are loaded when they are asked for."""


def use_directions(schemes: Iterable[str]) -> bool:
    """Whether the estimator of any of these schemes uses angles of arrival; one of the user's own counts as such."""
    found = (ESTIMATORS.get(SCHEMES[name].estimator) for name in schemes)
    return any(estimator is None or estimator.angles for estimator in found)
