"""BP-SLAM (Leitinger et al., arXiv 1801.04463): range only, potential features, loopy data association.

`run_static` is the published form, on plain arrays. `init, predict, step, estimate` are the moving form, with the
interface of the package's own filter.
"""

from rislam_rt.slam.schemes.bp_slam.association import Association, associate
from rislam_rt.slam.schemes.bp_slam.config import BpSlamConfig
from rislam_rt.slam.schemes.bp_slam.moving import BpSlamState, estimate, init, predict, step
from rislam_rt.slam.schemes.bp_slam.static import FeatureTable, StaticResult, run_static

__all__ = [
    "Association",
    "BpSlamConfig",
    "BpSlamState",
    "FeatureTable",
    "StaticResult",
    "associate",
    "estimate",
    "init",
    "predict",
    "run_static",
    "step",
]
