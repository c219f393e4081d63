"""Rival SLAM schemes for comparison, a folder each with settings of its own; what they share is in `shared`."""

from rislam_rt.slam.schemes import bp_slam, bp_slam_aoa, channel_slam
from rislam_rt.slam.schemes.protocol import SlamEstimator

RIVALS: dict[str, SlamEstimator] = {"bp_slam": bp_slam, "bp_slam_aoa": bp_slam_aoa, "channel_slam": channel_slam}
"""All rival SLAM schemes that a run can lead, by name."""
