"""Short runs in the paper's room that the report's tests look at: image sources, six cycles, one bounce."""

from collections.abc import Callable

import numpy as np
import pytest

from rislam_rt.model import SlamResult
from rislam_rt.pipeline import load_spec, run_slam
from rislam_rt.scene import load_scene
from rislam_rt.shipped import find_pipeline

SHORT = ("channel=image_source", "cycles=6", "depth=1", 'schemes=["random", "no_ris"]')


@pytest.fixture(scope="session")
def run_short() -> Callable[..., SlamResult]:
    """Run the short pipeline with some settings changed."""

    def _run(*settings: str) -> SlamResult:
        spec = load_spec(find_pipeline("trace_then_slam"), [*SHORT, *settings])
        return run_slam(load_scene("paper_room"), spec, rng=np.random.default_rng(7))

    return _run


@pytest.fixture(scope="session")
def result(run_short: Callable[..., SlamResult]) -> SlamResult:
    """A run with the receiver that is quick."""
    return run_short("receiver.estimator=bound")
