"""Checks of what a filter is given: its settings, and the inputs of each step, where a NaN would spoil the belief."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from rislam_rt.errors import ConfigError
from rislam_rt.model import DataSheet, Measurement, RisCode, RisSpecs


def check_named(section: str, config: Any, choices: Mapping[str, Iterable[str]]) -> None:
    """Check that a filter's settings are each one of their choices."""
    for name, allowed in choices.items():
        if getattr(config, name) not in allowed:
            raise ConfigError(f"{section}.{name}: '{getattr(config, name)}' received; give one of {', '.join(allowed)}")


def check_counts(section: str, config: Any, names: Iterable[str], least: int = 1) -> None:
    """Check that a filter's settings are whole numbers of at least `least`."""
    for name in names:
        if getattr(config, name) < least:
            raise ConfigError(f"{section}.{name}: {getattr(config, name)} received; give at least {least}")


def check_inside(section: str, config: Any, names: Iterable[str], below: float, wanted: str) -> None:
    """Check that a filter's settings are above zero and below a limit; None, where one may be left out, passes."""
    for name in names:
        value = getattr(config, name)
        if value is not None and not (np.isfinite(value) and 0.0 < value < below):
            raise ConfigError(f"{section}.{name}: {value} received; give {wanted}")


def check_not_negative(section: str, config: Any, names: Iterable[str]) -> None:
    """Check that a filter's settings are finite numbers of zero or more."""
    for name in names:
        if not 0.0 <= getattr(config, name) < np.inf:
            raise ConfigError(f"{section}.{name}: {getattr(config, name)} received; give a number that is not negative")


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
