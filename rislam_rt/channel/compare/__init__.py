"""Path certificate: ray-traced and image-source channel of one room compared path by path, every missing path explained
from the geometry, every error judged by limits that follow from numerical precision."""

from rislam_rt.channel.compare.channel_comparison import Validation, compare_channels, random_poses, validate_rooms
from rislam_rt.channel.compare.comparison_report import OneSidedPath, PathReport
from rislam_rt.channel.compare.path_matching import compare_paths

__all__ = [
    "OneSidedPath", "PathReport", "Validation", "compare_channels", "compare_paths", "random_poses", "validate_rooms",
]  # fmt: skip
