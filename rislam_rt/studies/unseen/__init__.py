"""Study in unseen random rooms: runs estimators in many of them, scores them, and records their inputs for others."""

from rislam_rt.pipeline.recordings.inputs import Inputs
from rislam_rt.pipeline.recordings.replay import Answers, Recorder, answers_from_arrays, replay
from rislam_rt.studies.score_card.recorded_run import record_run
from rislam_rt.studies.score_card.recording_file import Recording, read_recording, write_recording
from rislam_rt.studies.score_card.score import score_run
from rislam_rt.studies.score_card.truth import Truth, build_truth
from rislam_rt.studies.unseen.spec import UnseenSpec
from rislam_rt.studies.unseen.sweep import build_unseen, count_tests

__all__ = [
    "Answers", "Inputs", "Recorder", "Recording", "Truth", "UnseenSpec", "answers_from_arrays", "build_truth",
    "build_unseen", "count_tests", "read_recording", "record_run", "replay", "score_run", "write_recording",
]  # fmt: skip
