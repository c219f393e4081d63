"""Who turns measurements into a pose and a map: the project's filter, and the rivals, behind one set of functions."""

from collections.abc import Callable
from typing import Any, NamedTuple

from rislam_rt import slam
from rislam_rt.information.landmarks import Unknown
from rislam_rt.pipeline.spec import Settings
from rislam_rt.slam.schemes import bp_slam, channel_slam


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


ESTIMATORS: dict[str, Estimator] = {
    "slam": Estimator(slam.init, slam.predict, slam.step, slam.estimate, lambda settings: settings.slam),
    "bp_slam": Estimator(
        bp_slam.init, bp_slam.predict, bp_slam.step, bp_slam.estimate, lambda settings: settings.bp_slam,
        angles=False, walls="images",
    ),
    "channel_slam": Estimator(
        channel_slam.init, channel_slam.predict, channel_slam.step, channel_slam.estimate,
        lambda settings: settings.channel_slam, angles=False, walls="images",
    ),
}  # fmt: skip
"""All estimators by name."""
