"""Accuracy of every estimator in random rooms, against dead reckoning and against its own posterior bound.

Limits are about twice what was measured with the receiver that takes samples (seeds, rooms and settings are fixed, so
that a run gives the same numbers until the code changes): room for another rounding, not for a filter that learns
nothing, whose error is that of dead reckoning. They hold for the quick receiver as well, which the tests take.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

from rislam_rt.model import Measurement
from rislam_rt.pipeline.cycle import Receptions
from rislam_rt.pipeline.estimators import ESTIMATORS, Estimator
from rislam_rt.pipeline.run import RunSetup, run_scheme
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.scene.random_rooms import RandomRoom
from rislam_rt.studies.unseen import Recorder, build_truth, score_run
from rislam_rt.studies.unseen.cell import find_setup, scheme_here, trace_key

CYCLES = 60
"""Of every estimator, so that all that run in a room share what is heard in it, by the receiver that is quick."""


class Case(NamedTuple):
    """An estimator in a room."""

    name: str
    scheme: str
    settings: dict[str, Any]
    room: int
    share: float
    """Most of the dead reckoning's relative error, RMS over the run."""
    ratio: float
    """Most relative bounds. With wall returns the bound is 0.1 to 0.3 mm from the first cycle on; the filter, which
    takes 12 cycles to hold a wall, is far from it."""
    nees: float
    """Largest NEES per degree of freedom, mean over the run; the start's own draw makes much of it."""


LANDMARKS = {"use_vt": False}
NESTED = {"filter": "nested", "use_vt": False}
CASES = [
    Case("default", "random", {}, 103, 0.05, 50.0, 0.7),
    Case("default", "random", {}, 233, 0.05, 17.0, 0.35),
    Case("default", "random", {}, 266, 0.05, 20.0, 0.4),
    Case("landmarks", "random", LANDMARKS, 103, 0.1, 10.0, 1.0),
    Case("landmarks", "random", LANDMARKS, 266, 0.2, 7.0, 0.6),
    Case("landmarks", "random", LANDMARKS, 233, 0.12, 3.5, 0.45),
    Case("nested", "random", NESTED, 233, 0.12, 4.5, 0.65),
    Case("bp_slam", "bp_slam", {}, 233, 0.5, 1.5, 1.5),
    Case("bp_slam", "bp_slam", {}, 266, 0.8, 6.0, 2.5),
    Case("channel_slam", "channel_slam", {}, 233, 0.5, 1.5, 1.7),
    Case("channel_slam", "channel_slam", {}, 266, 0.8, 6.0, 1.9),
    Case("bp_slam_aoa", "bp_slam_aoa", {"use_vt": True}, 103, 0.015, 20.0, 1.0),
    Case("bp_slam_aoa", "bp_slam_aoa", {"use_vt": True}, 233, 0.006, 3.0, 0.55),
    Case("bp_slam_aoa", "bp_slam_aoa", {"use_vt": True}, 266, 0.015, 9.0, 0.75),
]

SELDOM = {
    ("default", 103), ("default", 266), ("landmarks", 103), ("landmarks", 266), ("bp_slam_aoa", 103),
    ("bp_slam_aoa", 266), ("bp_slam", 266), ("channel_slam", 266),
}  # fmt: skip
"""Runs of estimators that also run in room 233, which all of them share."""


def often(cases: list[Case]) -> list[Any]:
    """Cases of which `SELDOM` are slow."""
    return [pytest.param(c, marks=pytest.mark.slow) if (c.name, c.room) in SELDOM else c for c in cases]


@pytest.mark.parametrize("case", often(CASES), ids=lambda case: f"{case.name}-{case.room}")
def test_it_is_better_than_dead_reckoning_and_near_its_bound(case: Case) -> None:
    scores = run(case, None)
    assert scores["relative_rmse_m"] < case.share * scores["dead_reckoning_m"]
    assert scores["relative_ratio"] < case.ratio
    assert not scores["lost"]


@pytest.mark.parametrize("case", often(CASES), ids=lambda case: f"{case.name}-{case.room}")
def test_it_errs_no_more_than_it_says(case: Case) -> None:
    """Deviations half as large would make the NEES four times as large."""
    assert run(case, None)["nees"] < case.nees


@pytest.mark.parametrize(
    "case",
    [CASES[1], *(pytest.param(CASES[n], marks=pytest.mark.slow) for n in (6, 7, 9)), CASES[-2]],
    ids=lambda case: f"{case.name}-{case.room}",
)
def test_an_estimator_that_learns_nothing_fails(case: Case) -> None:
    scores = run(case, deaf(ESTIMATORS[SCHEMES[case.scheme].estimator]))
    assert scores["relative_rmse_m"] == pytest.approx(scores["dead_reckoning_m"], rel=1e-6)
    assert scores["relative_rmse_m"] > case.share * scores["dead_reckoning_m"]
    assert scores["births"] == 0


@pytest.mark.parametrize("case", often(CASES[:6]), ids=lambda case: f"{case.name}-{case.room}")
def test_most_births_are_of_the_right_kind(case: Case) -> None:
    scores = run(case, None)
    assert scores["births_judged"] >= 3
    assert scores["births_right"] >= 0.75 * scores["births_judged"]


@pytest.mark.parametrize("case", often(CASES[1:3]), ids=lambda case: f"{case.name}-{case.room}")
def test_the_map_holds_most_of_what_is_heard_and_no_crowd(case: Case) -> None:
    """Walls and points at their places after 4 s: 9 of 14, in the other room 8 of 11 and one that is not there."""
    names = ("walls_found", "points_found", "walls_heard", "points_heard", "ghost_walls", "ghost_points")
    scores = run(case, None)
    found, heard, ghosts = (scores[names[n]] + scores[names[n + 1]] for n in (0, 2, 4))
    assert found > 0.5 * heard
    assert ghosts < 0.25 * found


def run(case: Case, estimator: Estimator | None) -> dict[str, Any]:
    """The score card; runs that two tests ask for are run once."""
    return _kept(CASES.index(case)) if estimator is None else _run(case, estimator)


@cache
def _kept(number: int) -> dict[str, Any]:
    return _run(CASES[number], None)


def _run(case: Case, estimator: Estimator | None) -> dict[str, Any]:
    content = {
        "name": "accuracy", "channel": "image_source", "depth": 1, "schemes": [case.scheme],
        "cycles": CYCLES, "receiver": {"estimator": "bound"},
        "motion": {"sigma_a_m_s2": 0.01}, "start": {"velocity_std_m_s": 0.03}, "slam": case.settings,
        "nested": {"engine": "numpy", "num_agents": 100, "num_points": 200},
    }  # fmt: skip
    spec = PipelineSpec.model_validate(content)
    room, setup = _prepared(case.room, trace_key(spec))
    name = scheme_here(case.scheme, room)
    recorder = Recorder(estimator or ESTIMATORS[SCHEMES[name].estimator])
    result = run_scheme(name, setup, spec, lambda *_: None, recorder.estimator)
    return score_run(build_truth(setup.scene, setup.paths, result, spec), recorder.inputs, recorder.answers)


@cache
def _prepared(room: int, key: str) -> tuple[RandomRoom, RunSetup]:
    """A room that all cases in it share, with what was heard in it: receiver and noise are the same for all of them."""
    drawn, setup = find_setup(room, key)
    return drawn, setup._replace(receptions=Receptions())


def deaf(estimator: Estimator) -> Estimator:
    """The same estimator, from which all measurements are kept."""

    def step(state: Any, measurement: Measurement, *rest: Any, rng: np.random.Generator) -> Any:
        none = np.zeros(0)
        nothing = Measurement(none, np.zeros((0, 2)), none, none, np.zeros((0, 2)), none)
        state, info = estimator.step(state, nothing, *rest, rng=rng)
        return state, info._replace(landmark=np.full(len(measurement), -1))

    return estimator._replace(step=step)
