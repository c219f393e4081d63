"""Floor 5: localisation and mapping. The belief never reads truth: nothing here sees a channel or a scene."""

from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.estimator import estimate, init, predict, revisit, smoothed, step
from rislam_rt.slam.nested_config import NestedConfig
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.step_info import StepInfo, StepOutcome

__all__ = [
    "NestedConfig",
    "SlamConfig",
    "StartPrior",
    "StepInfo",
    "StepOutcome",
    "estimate",
    "init",
    "predict",
    "revisit",
    "smoothed",
    "step",
]
