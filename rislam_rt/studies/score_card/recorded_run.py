"""Recordings of a completed run in any room: inputs, truth and scores of each scheme, as the unseen rooms have them."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rislam_rt.model import SchemeResult, SlamResult
from rislam_rt.model.result import NOTHING, STEPS
from rislam_rt.pipeline import PipelineSpec
from rislam_rt.pipeline.long.run import read_given, read_whole
from rislam_rt.pipeline.recordings.inputs import Inputs
from rislam_rt.pipeline.recordings.replay import Answers, answers_from_arrays, replay
from rislam_rt.progress import Tell, tell_nobody
from rislam_rt.studies.score_card.recording_file import Recording
from rislam_rt.studies.score_card.score import score_run
from rislam_rt.studies.score_card.truth import build_truth

APART = 1e-6
"""[m] Distance between a run's estimates and those of its replay from which on the replay is another estimator's."""


class RecordedScheme(NamedTuple):
    """Recording of one scheme of a completed run, with what its replay gave."""

    recording: Recording
    apart: float | None
    """[m] Largest distance between the run's estimates of position and those of the replay; None without a replay."""
    cycle_s: float | None
    """[s] Mean CPU time of the estimator for a cycle of the replay; None without."""

    @property
    def has_strayed(self) -> bool:
        """Whether a recorded run strayed from its run: its replay gave other estimates, and delays and births are not
        known."""
        return self.apart is not None and not self.apart <= APART


def record_run(folder: str | Path, *, replayed: bool = True, progress: Tell = tell_nobody) -> dict[str, Recording]:
    """Recordings of all schemes of a completed run by name, with the scores of their estimators: in any room, what the
    study of unseen rooms records of its own.

    Each goes into `replay` and `score_run`, and with `write_recording` into a file.

    Parameters
    ----------
    folder
        Run folder of `rislam-rt run`.
    replayed
        Whether the measurements are replayed through the estimators, which takes as long as localising did in the run.
        A run folder holds the map of the last cycle: delays and births are known from a replay alone, and are None
        without one, or if this version's estimator gives other estimates than the run has.
    progress
        Called after each cycle of a replay with the scheme, the cycles done and their number.

    Raises
    ------
    ConfigError
        The folder is not a completed run, or a scheme of one's own is not to be found.
    ResultError
        One of its files is missing, damaged or changed.
    """
    result = read_whole(Path(folder))
    found = recorded_schemes(result, Path(folder), replayed=replayed, progress=progress)
    return {one.recording.scheme: one.recording for one in found}


def recorded_schemes(
    result: SlamResult, folder: Path, *, replayed: bool = True, progress: Tell = tell_nobody
) -> Iterator[RecordedScheme]:
    """Record the schemes of a completed run one after the other; `result` is what `read_whole` gave for its folder."""
    spec = PipelineSpec.model_validate(dict(result.config))
    traits = {"room": result.scene.name, "run": folder.resolve().name, "seed": result.seed}
    for name, scheme in result.schemes.items():
        inputs, rng = read_given(folder, name)
        truth = build_truth(result.scene, result.paths, scheme, spec)
        answers, apart, cycle_s = answers_of(scheme, inputs), None, None
        if replayed:
            again = replay(inputs, result.config, name, rng=rng, progress=progress)
            places = np.array([[one.position for one in each.estimates] for each in (answers, again)])
            apart = float(np.linalg.norm(places[0] - places[1], axis=1).max())
            cycle_s = again.seconds
            answers = again if apart <= APART else answers
        scores = {"ran": name, **score_run(truth, inputs, answers)}
        recording = Recording(inputs, truth, name, dict(result.config), traits, scores)
        yield RecordedScheme(recording, apart, cycle_s)


def answers_of(scheme: SchemeResult, inputs: Inputs) -> Answers:
    """Estimates that a scheme of a recorded run holds: positions, their covariance, association and the last map."""
    taken = [row[row != NOTHING] for row in scheme.component_landmark]
    lost = np.array([outcome == "diverged" for outcome in scheme.outcome])
    return answers_from_arrays(inputs, scheme.position, scheme.covariance[:, :3, :3], [scheme.map], lost, taken)


def replay_seconds(result: SlamResult) -> float:
    """Time [s] that localising took in a recorded run, all schemes together: about that of replaying them."""
    step = STEPS.index("localise")
    return float(sum(scheme.seconds[:, step].sum() for scheme in result.schemes.values()))
