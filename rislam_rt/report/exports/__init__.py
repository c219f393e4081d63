"""A run or a room in formats of other programs: GIF, Rerun, DeepMIMO."""
