"""A run's measurements, as the filter was given them and as a table of one's own."""

import numpy as np
import pytest

import rislam_rt
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.shipped import find_pipeline
from rislam_rt.studies.unseen import Inputs, Recorder

CYCLES = 20
CHANGES = [f"cycles={CYCLES}", "channel=image_source", "depth=1", "schemes=['no_ris']", "slam.use_vt=true",
           "receiver.estimator=bound"]  # fmt: skip
Table = dict[str, list[float]]


@pytest.fixture(scope="session")
def spec() -> PipelineSpec:
    return load_spec(find_pipeline("trace_then_slam"), CHANGES)


@pytest.fixture(scope="session")
def recorded(spec: PipelineSpec) -> tuple[Inputs, np.ndarray]:
    """What the filter was given in a run, and where it held itself to be."""
    recorder, own = Recorder(ESTIMATORS["slam"]), ESTIMATORS["slam"]
    ESTIMATORS["slam"] = recorder.estimator
    try:
        result = rislam_rt.run_slam(rislam_rt.load_scene("paper_room"), spec, rng=np.random.default_rng(spec.seed))
    finally:
        ESTIMATORS["slam"] = own
    return recorder.inputs, result.schemes["no_ris"].position


@pytest.fixture
def table(recorded: tuple[Inputs, np.ndarray]) -> Table:
    inputs, _ = recorded
    names = "time_s heading_rad delay_s cos_x cos_y amplitude delay_std_s cos_x_std cos_y_std amplitude_std"
    rows = [
        (t, h, m.tau[k], *m.cosines[k], m.amplitude[k], m.tau_std[k], *m.cosines_std[k], m.amplitude_std[k])
        for t, h, m in zip(inputs.time, inputs.heading, inputs.measurements, strict=True)
        for k in range(len(m))
    ]
    return {
        name: [float(v) for v in column] for name, column in zip(names.split(), zip(*rows, strict=True), strict=True)
    }
