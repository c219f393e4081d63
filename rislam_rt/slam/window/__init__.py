"""A filter over a window that is re-linearised: planes, points and the panel in one map."""

from rislam_rt.slam.window.filter import init, smoothed, step
from rislam_rt.slam.window.mapping import estimate, predict, revisit
from rislam_rt.slam.window.state import WindowState

__all__ = ["WindowState", "estimate", "init", "predict", "revisit", "smoothed", "step"]
