"""BP-SLAM (Leitinger et al., arXiv 1801.04463): range only, potential features, loopy data association."""

from rislam_rt.slam.schemes.bp_slam.association import Association, associate
from rislam_rt.slam.schemes.bp_slam.config import BpSlamConfig
from rislam_rt.slam.schemes.bp_slam.static import FeatureTable, StaticResult, run_static

__all__ = ["Association", "BpSlamConfig", "FeatureTable", "StaticResult", "associate", "run_static"]
