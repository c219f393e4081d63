"""Comparison schemes: BP-SLAM and Channel-SLAM."""
