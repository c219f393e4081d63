"""Engines and small scenes of the nested filter's tests."""

import numpy as np
import pytest

from rislam_rt.slam.nested.particles.engine_choice import pick_engine
from rislam_rt.slam.nested.particles.landmark_cloud import CloudEngine


@pytest.fixture(params=["numpy", "drjit"])
def engine(request: pytest.FixtureRequest) -> CloudEngine:
    """Both engines in turn."""
    return pick_engine(request.param)


@pytest.fixture
def rng() -> np.random.Generator:
    """A fixed seed."""
    return np.random.default_rng(7)
