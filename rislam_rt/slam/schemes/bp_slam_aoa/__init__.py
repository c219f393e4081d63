"""BP-SLAM by delays, angles and amplitudes, for an agent that carries both ends.

`init, predict, step, estimate` are those of every estimator.
"""

from rislam_rt.slam.schemes.bp_slam_aoa.config import BpSlamAoaConfig
from rislam_rt.slam.schemes.bp_slam_aoa.filter import estimate, init, predict, step

__all__ = ["BpSlamAoaConfig", "estimate", "init", "predict", "step"]
