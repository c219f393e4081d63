"""Path certificate: two channels of one room compared path by path, and every difference proved from the geometry."""

from rislam_rt.channel.compare.channels import compare_channels
from rislam_rt.channel.compare.match import compare_paths
from rislam_rt.channel.compare.poses import random_poses
from rislam_rt.channel.compare.report import OneSided, PathReport
from rislam_rt.channel.compare.table import validation_table

__all__ = ["OneSided", "PathReport", "compare_channels", "compare_paths", "random_poses", "validation_table"]
