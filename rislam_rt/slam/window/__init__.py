"""Window filter: sliding-window SLAM over the last K poses and a map of walls, points and RIS panels, re-linearised by
Gauss-Newton."""

from rislam_rt.slam.window.estimates import estimate, predict, revisit
from rislam_rt.slam.window.filter import init, smoothed, step
from rislam_rt.slam.window.state import WindowState

__all__ = ["WindowState", "estimate", "init", "predict", "revisit", "smoothed", "step"]
