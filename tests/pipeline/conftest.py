"""A short run in the paper's room that several tests look at: image sources, few cycles, few particles."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.pipeline import load_spec, run_slam
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
PIPELINE = ROOT / "pipelines" / "trace_then_slam.toml"
SHORT = ("channel=image_source", "cycles=8", "design.iterations=5", "receiver.estimator=bound")


@pytest.fixture(scope="session")
def room():
    return load_scene(ROOT / "scenes" / "paper_room")


@pytest.fixture(scope="session")
def run_short(room):
    """Run the short pipeline with some settings changed."""

    def _run(*overrides, seed=7, scene=None, **options):
        spec = load_spec(PIPELINE, [*SHORT, *overrides])
        return run_slam(scene or room, spec, rng=np.random.default_rng(seed), **options)

    return _run


@pytest.fixture(scope="session")
def short_spec():
    return load_spec(PIPELINE, SHORT)


@pytest.fixture(scope="session")
def short_result(room, short_spec):
    return run_slam(room, short_spec, rng=np.random.default_rng(short_spec.seed))


@pytest.fixture(scope="session")
def beside_panel(room, run_short):
    """2.5 s past the panel at 0 dB under designed and under random codes: the map begins empty."""
    scene = replace(room, agent=room.agent[250:275])
    settings = ("cycles=25", "depth=1", "radio.reference_snr_db=0", "design.method=coordinate")
    return run_short(*settings, 'schemes=["optimized", "random"]', scene=scene)
