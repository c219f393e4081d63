"""Rival SLAM schemes for comparison, a folder each with settings of its own; what they share is in `shared`."""
