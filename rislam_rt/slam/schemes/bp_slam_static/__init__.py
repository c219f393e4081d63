"""BP-SLAM as published (Leitinger et al., arXiv 1801.04463): ranges to anchors in known places, on plain arrays."""

from rislam_rt.slam.schemes.bp_slam_static.config import BpSlamStaticConfig
from rislam_rt.slam.schemes.bp_slam_static.run import FeatureTable, StaticResult, run_static

__all__ = ["BpSlamStaticConfig", "FeatureTable", "StaticResult", "run_static"]
