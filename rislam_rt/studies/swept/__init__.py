"""Swept studies: SLAM runs over settings and seeds on the sweep engine, their specifications, cells and statistics."""

from rislam_rt.studies.swept.cell import cell_spec
from rislam_rt.studies.swept.collect import Group, group_rows, paired_difference, paired_gain, spread
from rislam_rt.studies.swept.spec import (
    SWEPT,
    AblationsSpec,
    Fig4bSpec,
    Fig4cSpec,
    HardwareSpec,
    RobustnessSpec,
    RoomsSpec,
    SweptSpec,
)
from rislam_rt.studies.swept.sweep import build_sweep, check_swept

__all__ = [
    "SWEPT", "AblationsSpec", "Fig4bSpec", "Fig4cSpec", "Group", "HardwareSpec", "RobustnessSpec", "RoomsSpec",
    "SweptSpec", "build_sweep", "cell_spec", "check_swept", "group_rows", "paired_difference", "paired_gain", "spread",
]  # fmt: skip
