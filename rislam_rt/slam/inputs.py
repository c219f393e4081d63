"""What a filter's step may be handed: checked, because a NaN would go through the whole belief without a word."""

import math

from rislam_rt.errors import ConfigError
from rislam_rt.model import DataSheet, RisCode, RisSpec, RisSpecs

MAX_STEP = 1e6
"""[s] Twelve days; the squares of longer steps leave nothing of what was known."""


def lone_panel(ris: DataSheet | None) -> RisSpec | None:
    """The data sheet, for a filter that knows one panel.

    Raises
    ------
    ConfigError
        There are several panels.
    """
    if isinstance(ris, RisSpecs):
        raise ConfigError(f"slam: {len(ris.panels)} panels in the room, and this filter knows one; take another room")
    return ris


def check_step(dt: float, heading: float, code: RisCode | None = None, ris: DataSheet | None = None) -> None:
    """Check time step [s], heading [rad] and code before a cycle.

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
