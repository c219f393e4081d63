"""Channel-SLAM (Gentner et al., IEEE TWC 2016) by delays alone, for an agent that carries both ends.

`init, predict, step, estimate` have the interface of the package's own filter.
"""

from rislam_rt.slam.schemes.channel_slam.config import ChannelSlamConfig
from rislam_rt.slam.schemes.channel_slam.filter import ChannelSlamState, estimate, init, predict, step

__all__ = ["ChannelSlamConfig", "ChannelSlamState", "estimate", "init", "predict", "step"]
