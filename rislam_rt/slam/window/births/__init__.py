"""Births and removals of map features: hypotheses of what caused a track, their evidence, and features that residuals
contradict."""
