"""Births and deaths: hypotheses for a track, their evidence, and features that the evidence has turned against."""
