"""The sweep engine: any importable function over any settings, one file a cell, resumed where it stopped."""

from rislam_rt.sweeps.axes import Axis, Cell, Sweep, build_cells, parse_axis
from rislam_rt.sweeps.cost import Cost, estimate_cost
from rislam_rt.sweeps.run import Effort, Report, Told, run_sweep
from rislam_rt.sweeps.store import Row

__all__ = [
    "Axis",
    "Cell",
    "Cost",
    "Effort",
    "Report",
    "Row",
    "Sweep",
    "Told",
    "build_cells",
    "estimate_cost",
    "parse_axis",
    "run_sweep",
]
