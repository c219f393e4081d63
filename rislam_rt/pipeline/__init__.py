"""Floor 6: the four-step cycle, the run over a trajectory, its specification, and the store of results."""

from rislam_rt.pipeline.read import load_spec
from rislam_rt.pipeline.run import run_slam
from rislam_rt.pipeline.spec import PipelineSpec

__all__ = ["PipelineSpec", "load_spec", "run_slam"]
