"""Flat and round regions of an imported mesh, grouped into walls and objects, and simplified."""
