"""Hypotheses of what caused a track: every kind of path with their fits, whether it can be, and its evidence."""
