"""The sweep engine: evaluates a function over axes of settings and seeds, with a file for each cell, resumable."""

from rislam_rt.sweeps.axes import Axis, parse_axis
from rislam_rt.sweeps.cost import SweepCost
from rislam_rt.sweeps.run import SweepOptions, SweepProgress, SweepReport, run_sweep
from rislam_rt.sweeps.store import Row
from rislam_rt.sweeps.sweep import Sweep, build_cells

__all__ = [
    "Axis",
    "Row",
    "Sweep",
    "SweepCost",
    "SweepOptions",
    "SweepProgress",
    "SweepReport",
    "build_cells",
    "parse_axis",
    "run_sweep",
]
