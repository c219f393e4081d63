"""Studies: pipeline files of other kinds than a SLAM run, such as channel comparisons, figures and parameter sweeps."""

from rislam_rt.studies.classifier.spec import ClassifierSpec
from rislam_rt.studies.pipeline_kinds import load_any
from rislam_rt.studies.spec import ClaimsSpec, CompareSpec, Fig4aSpec
from rislam_rt.studies.swept.spec import SweptSpec
from rislam_rt.studies.unseen.spec import UnseenSpec

__all__ = ["ClaimsSpec", "ClassifierSpec", "CompareSpec", "Fig4aSpec", "SweptSpec", "UnseenSpec", "load_any"]
