"""A filter over a window that is re-linearised: planes, points and the panel in one map."""

from rislam_rt.slam.window.filter import WindowState, init, smoothed, step
from rislam_rt.slam.window.mapping import estimate, predict, revisit

__all__ = ["WindowState", "estimate", "init", "predict", "revisit", "smoothed", "step"]
