"""A sample of the hard cases: no exception, no warning, nothing that is not finite, covariances that are some."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

SAMPLE, QUICK = 40, 10
SELDOM = (0, 2, 6, 8, 9)
"""Quick ones that are slow proofs all the same: with nothing wrong, which another test looks at as well, and the four
that take longest."""


def _load() -> ModuleType:
    """The benchmark that draws them; it is no part of a package."""
    file = Path(__file__).parents[2] / "benchmarks" / "filter" / "hard_cases.py"
    spec = importlib.util.spec_from_file_location("hard_cases", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(file.parent))
    sys.modules["hard_cases"] = module
    spec.loader.exec_module(module)
    return module


hard = _load()


@pytest.mark.parametrize(
    "number",
    [pytest.param(n, marks=pytest.mark.slow if n >= QUICK or n in SELDOM else ()) for n in range(SAMPLE)],
)
def test_filter_survives(number: int) -> None:
    """Twelve cycles at most: landmarks are born where the settings drawn ask for little history."""
    # a stride without a common factor goes through all kinds alike
    kind = hard.KINDS[(5 * number) % len(hard.KINDS)]
    verdict = hard.run_case(hard.draw_case(kind, number, "window", most=12))
    assert not verdict.faults, verdict.faults[:3]
    assert len(verdict.outcomes) >= 10


def test_what_a_single_delay_leaves_blind_stays_solvable() -> None:
    """One delay for all: normal equations that rounding makes singular, and images as uncertain as a room is wide."""
    assert not hard.run_case(hard.draw_case("one delay", 4100023, "window")).faults


def test_a_start_wrong_by_a_metre_shifts_the_map_and_nothing_else() -> None:
    """Absolute position is unobservable: the filter cannot notice, must not diverge, and stays off by what it was.

    Relative to its start it errs by what an honest start leaves, less than half of 0.01 m/s over 2.5 s unlearnt.
    """
    case = hard.draw_case("start wrong by 1 m", 3, "window")._replace(config=hard.SlamConfig())
    verdict = hard.run_case(case)
    assert not verdict.lost
    assert "diverged" not in verdict.outcomes
    assert np.linalg.norm(case.start.position - case.truth[0]) > 0.9
    assert verdict.drift < 0.01


def test_faults_would_be_noticed() -> None:
    """The look at estimate and diagnostics sees a NaN, a negative variance, and an asymmetric covariance."""
    bad = np.diag([1.0, -1e-6])
    assert hard._not_covariance(bad[None])
    assert hard._not_covariance(np.array([[[1.0, 0.1], [0.0, 1.0]]]))
    assert hard._not_covariance(np.full((1, 2, 2), np.nan))
    assert not hard._not_covariance(np.diag([1.0, 0.0])[None])


def _led(kind: str, seed: int, most: int = 12, **settings: Any) -> Any:
    """What the window filter makes of a case at its default settings, or others."""
    case = hard.draw_case(kind, seed, "window", most=most)
    return hard.run_case(case._replace(config=hard.SlamConfig(filter="window", **settings)))


@pytest.mark.parametrize(
    ("kind", "seed", "heading"),
    [
        pytest.param("speed wrong by 0.3 m/s", 2, "known", marks=pytest.mark.slow),
        ("speed wrong by 0.3 m/s", 2, "estimated"),
        ("compass wrong by 0.5 rad", 4, "known"),
    ],
)
def test_a_start_told_wrong_is_said_and_mended(kind: str, seed: int, heading: str) -> None:
    """With and without a compass: the first tracks tell the velocity in the axes of the body."""
    verdict = _led(kind, seed, heading=heading)
    assert verdict.said
    assert not verdict.lost
    assert verdict.outcomes[-1] == "ok"
    assert verdict.drift < 0.03  # a second at the wrong speed is 0.3 m


@pytest.mark.parametrize("seed", [5, 6])
def test_a_jump_is_said_and_landed_from(seed: int) -> None:
    """Of seed 5, 7 cm two cycles after the first birth, the next cycle's map alone puts the agent right."""
    verdict = _led("jump of the agent", seed, 30)
    assert verdict.said or seed == 5
    assert not verdict.lost
    assert verdict.drift < 0.05
    assert verdict.std < 0.1


@pytest.mark.parametrize("heading", [pytest.param("known", marks=pytest.mark.slow), "estimated"])
def test_a_picture_that_moves_while_no_time_passes_is_said(heading: str) -> None:
    """No estimate can follow: what does not take any time is no motion. Said in the fourth cycle."""
    case = hard.draw_case("no time passes", 4, "window", most=12)
    config = hard.SlamConfig(filter="window", heading=heading)
    assert hard.run_case(case._replace(config=config, cycles=case.cycles[:6])).said


@pytest.mark.parametrize(("seed", "heading"), [(4, "estimated"), pytest.param(5, "known", marks=pytest.mark.slow)])
def test_nothing_wrong_is_not_called_lost(seed: int, heading: str) -> None:
    verdict = _led("nothing wrong", seed, heading=heading)
    assert not verdict.said
    assert not verdict.faults


def test_a_picture_turned_about_ends_the_map_and_begins_another() -> None:
    """Directions mirrored once walls are known: the map explains nothing; what is kept is the pose, within a metre."""
    case = hard.draw_case("nothing wrong", 7, "window", most=20)
    config, half = hard.SlamConfig(filter="window", use_vt=True), 8
    mirror = hard.SPOILERS["mirrored"]
    cycles = [
        cycle._replace(measurement=mirror(cycle.measurement, np.random.default_rng(0))) if row >= half else cycle
        for row, cycle in enumerate(case.cycles)
    ]
    verdict = hard.run_case(case._replace(config=config, cycles=cycles))
    assert not verdict.faults
    assert verdict.outcomes[half] == "diverged"
    assert "diverged" not in verdict.outcomes[:half]
    assert verdict.outcomes[-1] == "ok"
    assert not verdict.lost
    assert verdict.std > 1.0
