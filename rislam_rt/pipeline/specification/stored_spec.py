"""Specification of a stored run, read back from its settings where the methods that they name need not be there."""

from collections.abc import Mapping
from typing import Any

from rislam_rt.pipeline.schemes import STORED
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec


def stored_spec(config: Mapping[str, Any]) -> PipelineSpec:
    """Specification of a completed run from its stored settings, without loading methods of the user's own.

    Raises
    ------
    ValidationError
        Another version wrote them, with settings that this one does not take.
    """
    return PipelineSpec.model_validate(dict(config), context=STORED)
