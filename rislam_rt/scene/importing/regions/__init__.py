"""Flat and round regions of an imported mesh, grouped into walls and objects, and simplified to as few faces as will
do."""
