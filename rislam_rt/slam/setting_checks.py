"""Checks of settings that the configurations of all filters make."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from rislam_rt.errors import ConfigError


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
