"""The sweep engine: evaluates a function over axes of settings and seeds, with a file for each cell, resumable."""

from rislam_rt.sweeps.run import SweepCost, SweepOptions, SweepProgress, SweepReport, run_sweep
from rislam_rt.sweeps.store import Row
from rislam_rt.sweeps.sweep import Axis, Sweep, build_cells, parse_axis

__all__ = [
    "Axis", "Row", "Sweep", "SweepCost", "SweepOptions", "SweepProgress", "SweepReport", "build_cells", "parse_axis",
    "run_sweep",
]  # fmt: skip
