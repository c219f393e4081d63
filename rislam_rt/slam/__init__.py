"""Floor 5: localisation and mapping. The belief never reads truth: nothing here sees a channel or a scene."""

from rislam_rt.slam.config import SlamConfig, StartPrior
from rislam_rt.slam.estimator import estimate, init, predict, revisit, smoothed, step
from rislam_rt.slam.filter import FilterState, Outcome, StepInfo

__all__ = [
    "FilterState",
    "Outcome",
    "SlamConfig",
    "StartPrior",
    "StepInfo",
    "estimate",
    "init",
    "predict",
    "revisit",
    "smoothed",
    "step",
]
