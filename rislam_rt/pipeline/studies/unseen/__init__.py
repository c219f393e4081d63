"""Rooms that no estimator was built on: run one in many of them, score it, and leave its inputs for others."""

from rislam_rt.pipeline.studies.unseen.recording import Answers, Inputs, Recorder, replay
from rislam_rt.pipeline.studies.unseen.score import score_run
from rislam_rt.pipeline.studies.unseen.spec import TEST, UnseenSpec
from rislam_rt.pipeline.studies.unseen.sweep import build_unseen, code_digest, count_tests
from rislam_rt.pipeline.studies.unseen.truth import Truth, build_truth

__all__ = [
    "TEST",
    "Answers",
    "Inputs",
    "Recorder",
    "Truth",
    "UnseenSpec",
    "build_truth",
    "build_unseen",
    "code_digest",
    "count_tests",
    "replay",
    "score_run",
]
