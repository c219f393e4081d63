"""Checks of what a filter is given in each step, where a NaN would spoil the belief."""

import math

from rislam_rt.errors import ConfigError
from rislam_rt.model import DataSheet, Measurement, RisCode, RisSpecs

MAX_STEP = 1e6
"""Longest time step [s]: twelve days; the squares of longer ones leave nothing of what was known."""


def check_sides(measurement: Measurement, ris: DataSheet | None) -> None:
    """Check that a measurement which sets the panels' components apart says over which of several panels each ran.

    Raises
    ------
    ConfigError
        It does not say so.
    """
    if measurement.from_panel is not None and measurement.panel is None and isinstance(ris, RisSpecs):
        raise ConfigError(
            f"measurement.panel: missing, with from_panel and {len(ris.panels)} panels; give both or none"
        )


def check_step(dt: float, heading: float, code: RisCode | None = None, ris: DataSheet | None = None) -> None:
    """Check a step's inputs before a cycle: time step [s], heading [rad] and code.

    Raises
    ------
    ConfigError
        The time step is negative, too long or no number; the heading is no finite number; the code is not of the panel.
    """
    if not 0.0 <= dt <= MAX_STEP:
        raise ConfigError(f"dt: {dt} received; give 0 to {MAX_STEP:g} seconds")
    if not math.isfinite(heading):
        raise ConfigError(f"heading: {heading} received; give radians")
    if code is None or ris is None:  # who knows of no panel has no use for its code
        return
    if code.index.shape != (ris.rows, ris.cols) or code.levels != ris.levels:
        raise ConfigError(
            f"code: shape {code.index.shape} of {code.levels} levels received; "
            f"the panel has ({ris.rows}, {ris.cols}) of {ris.levels}, give one code of it"
        )
