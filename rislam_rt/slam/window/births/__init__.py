"""Births and removals of map features: which hypothesis of what caused a track is born, and which features residuals or
other walls take back."""
