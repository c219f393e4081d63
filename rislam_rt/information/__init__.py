"""Floor 4: Fisher information of delays, gains and angles; what it says about positions; bounds over a trajectory."""

from rislam_rt.information.accuracy import MeasurementStd, amplitude_std, cosine_information, measurement_std
from rislam_rt.information.delay_gain import (
    EquivalentDelayInformation,
    delay_gain_information,
    delay_information,
    eliminate_gains,
    map_to_position,
    steering,
)
from rislam_rt.information.diffuse import DiffuseTail, diffuse_snr
from rislam_rt.information.dilution_maps import dilution, position_error_map
from rislam_rt.information.equivalent_fim import (
    EquivalentPosition,
    equivalent_information,
    uncertain_range_information,
)
from rislam_rt.information.gradient import (
    GradientMode,
    cosine_gradient,
    heading_gradient,
    landmark_gradient,
    path_gradient,
    vertex_gradient,
)
from rislam_rt.information.landmark_model import (
    LandmarkModel,
    LinearMeasurements,
    MirrorChain,
    WallSpread,
    build_landmark_model,
    mirror_chain,
    plane_tangents,
)
from rislam_rt.information.outcome import Outcome
from rislam_rt.information.position import PositionBound, position_bound, position_information, range_information
from rislam_rt.information.posterior_crlb import MotionPrior, PosteriorBound, posterior_bound
from rislam_rt.information.prior import prior_from_covariance, prior_from_particles
from rislam_rt.information.resolution import certainty_share, resolved_probability

__all__ = [
    "DiffuseTail",
    "EquivalentDelayInformation",
    "EquivalentPosition",
    "GradientMode",
    "LandmarkModel",
    "LinearMeasurements",
    "MeasurementStd",
    "MirrorChain",
    "MotionPrior",
    "Outcome",
    "PositionBound",
    "PosteriorBound",
    "WallSpread",
    "amplitude_std",
    "build_landmark_model",
    "certainty_share",
    "cosine_gradient",
    "cosine_information",
    "delay_gain_information",
    "delay_information",
    "diffuse_snr",
    "dilution",
    "eliminate_gains",
    "equivalent_information",
    "heading_gradient",
    "landmark_gradient",
    "map_to_position",
    "measurement_std",
    "mirror_chain",
    "path_gradient",
    "plane_tangents",
    "position_bound",
    "position_error_map",
    "position_information",
    "posterior_bound",
    "prior_from_covariance",
    "prior_from_particles",
    "range_information",
    "resolved_probability",
    "steering",
    "uncertain_range_information",
    "vertex_gradient",
]
