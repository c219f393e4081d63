"""What every table of a pipeline file is made of: strict sections, and numbers with ranges."""

from collections.abc import Iterable
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-]*$", max_length=64)]
"""Of a pipeline: part of folders' names, so that it holds no separator and begins with no dot."""
Positive = Annotated[float, Field(gt=0.0, le=1e12, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, le=1e12, allow_inf_nan=False)]
Real = Annotated[float, Field(ge=-1e12, le=1e12, allow_inf_nan=False)]
Decibel = Annotated[float, Field(ge=-300.0, le=300.0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
Side = Annotated[int, Field(ge=1, le=256)]
"""Antennas along a side: every component takes time and memory for all of them."""
Wide = Annotated[float, Field(ge=0.0, le=1e5)]
"""A standard deviation: no scene is larger, and float64 tells no millimetres beside the square of more."""
Carrier = Annotated[float, Field(ge=1e-3, le=3000.0)]
"""[GHz] Radio waves end at 3000 GHz (ITU Radio Regulations, 1.5)."""
Probability = Annotated[float, Field(ge=0.0, le=1.0)]


class Choices:
    """What a text may be besides names of the user's own: for the list of settings."""

    def __init__(self, names: Iterable[str]) -> None:
        self.names = tuple(names)


class Section(BaseModel):
    """A table of the file: no conversions, no unknown keys."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)
