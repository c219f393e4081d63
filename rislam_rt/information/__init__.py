"""Floor 4: Fisher information of delays, gains and angles, position bounds, and bounds over a trajectory."""

from rislam_rt.information.accuracy import amplitude_std, cosine_information, measurement_std
from rislam_rt.information.delay_gain import delay_gain_information, eliminate_gains, map_to_position, steering
from rislam_rt.information.heard_paths import heard_paths
from rislam_rt.information.landmark_model import (
    LandmarkModel,
    LinearMeasurements,
    WallSpread,
    build_landmark_model,
    fewer_rows,
)
from rislam_rt.information.position_bound import (
    GradientMode,
    Outcome,
    position_bound,
    position_information,
    range_information,
    vertex_gradient,
)
from rislam_rt.information.posterior_crlb import PosteriorBound, posterior_bound
from rislam_rt.information.priors import MotionPrior, assumed_std, prior_from_covariance

__all__ = [
    "GradientMode", "LandmarkModel", "LinearMeasurements", "MotionPrior", "Outcome", "PosteriorBound", "WallSpread",
    "amplitude_std", "assumed_std", "build_landmark_model", "cosine_information", "delay_gain_information",
    "eliminate_gains", "fewer_rows", "heard_paths", "map_to_position", "measurement_std", "position_bound",
    "position_information", "posterior_bound", "prior_from_covariance", "range_information", "steering",
    "vertex_gradient",
]  # fmt: skip
