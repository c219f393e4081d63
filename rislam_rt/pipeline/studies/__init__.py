"""Pipelines other than the main job: a file's `kind` says which; each has its specification and its run here."""

from rislam_rt.pipeline.studies.kinds import load_any
from rislam_rt.pipeline.studies.spec import CompareSpec, Fig4aSpec, StudySpec

__all__ = ["CompareSpec", "Fig4aSpec", "StudySpec", "load_any"]
