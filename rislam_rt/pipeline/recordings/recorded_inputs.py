"""Recorded inputs: what the estimator of a run was given, and what it drew from."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rislam_rt.model import SchemeResult
from rislam_rt.pipeline.assumed_model import AssumedModel
from rislam_rt.pipeline.cycle import Cycle
from rislam_rt.pipeline.recordings.inputs import Inputs, inputs_to_dataset, seed_marks

if TYPE_CHECKING:
    import xarray as xr


class RecordedInputs(NamedTuple):
    """What an estimator was given over some cycles, and what it drew from."""

    inputs: Inputs
    seed: np.random.SeedSequence


def given_of(told: AssumedModel, first: int, cycles: Sequence[Cycle], seed: np.random.SeedSequence) -> RecordedInputs:
    """Record of what the estimator was given from cycle `first` on."""
    span = slice(first, first + len(cycles))
    time, heading = told.time[span] - told.time[0], told.heading[span]
    measurements = tuple(cycle.measurement for cycle in cycles)
    codes = tuple(cycle.believed for cycle in cycles)
    return RecordedInputs(Inputs(told.start, told.body, told.panel, time, heading, measurements, codes), seed)


def given_to_dataset(result: SchemeResult) -> "xr.Dataset":
    """What a scheme's estimator was given, as `rislam-rt slam` reads it: nothing in it is of the truth."""
    inputs, seed = result.given
    return inputs_to_dataset(inputs, scheme=result.scheme, **seed_marks(seed))
