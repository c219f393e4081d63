"""Exports of runs and traced scenes in formats of other programs: GIF, Rerun, DeepMIMO."""
