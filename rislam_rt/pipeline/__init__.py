"""The simulation pipeline: the four-step SLAM cycle, runs of all schemes on a trajectory, pipeline files, run folders.

Names are imported when first used, so that a sweep's worker processes load only what they need.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rislam_rt.pipeline.run import run_slam
    from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
    from rislam_rt.pipeline.specification.radio import build_radio
    from rislam_rt.pipeline.specification.read_pipeline import load_spec

__all__ = ["PipelineSpec", "build_radio", "load_spec", "run_slam"]

_HOME = {
    "build_radio": "specification.radio", "load_spec": "specification.read_pipeline", "run_slam": "run",
    "PipelineSpec": "specification.pipeline_spec",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"rislam_rt.pipeline.{_HOME[name]}"), name)
    raise AttributeError(f"module 'rislam_rt.pipeline' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
