"""Base class of all tables (sections) of a pipeline file, and types of numbers with ranges."""

from collections.abc import Iterable
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-]*$", max_length=64)]
"""Name of a pipeline: it is part of folders' names, so that it holds no separator and begins with no dot."""
Positive = Annotated[float, Field(gt=0.0, le=1e12, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, le=1e12, allow_inf_nan=False)]
Real = Annotated[float, Field(ge=-1e12, le=1e12, allow_inf_nan=False)]
Decibel = Annotated[float, Field(ge=-300.0, le=300.0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
Side = Annotated[int, Field(ge=1, le=256)]
"""Number of antennas along a side of the array, limited for time and memory."""
Wide = Annotated[float, Field(ge=0.0, le=1e5)]
"""Standard deviation of the start [m, m/s]: no scene is larger, and squares of more lose millimetres in float64."""
Carrier = Annotated[float, Field(ge=1e-3, le=3000.0)]
"""[GHz] Carrier frequency; radio waves end at 3000 GHz (ITU Radio Regulations, 1.5)."""
Probability = Annotated[float, Field(ge=0.0, le=1.0)]


class Choices:
    """Built-in names that a text setting may have, besides a user's own: shown in the list of settings."""

    def __init__(self, names: Iterable[str]) -> None:
        self.names = tuple(names)


class Section(BaseModel):
    """Base class of a table of a pipeline file: unknown keys and values of another type are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)
