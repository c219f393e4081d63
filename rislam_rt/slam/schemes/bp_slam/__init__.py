"""BP-SLAM (Leitinger et al., arXiv 1801.04463) by delays alone, for an agent that carries both ends.

Potential features, loopy data association. `init, predict, step, estimate` are those of every estimator.
"""

from rislam_rt.slam.schemes.bp_slam.config import BpSlamConfig
from rislam_rt.slam.schemes.bp_slam.filter import estimate, init, predict, step

__all__ = ["BpSlamConfig", "estimate", "init", "predict", "step"]
