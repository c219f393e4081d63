"""The files of `rislam-rt slam`: what is in them, and that the page says it."""

import csv
import io
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rislam_rt
from rislam_rt.model import MapEstimate
from rislam_rt.pipeline.recordings.answer_files import COLUMNS, answer_files
from rislam_rt.pipeline.recordings.replay import Answers
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec
from rislam_rt.studies.unseen import Inputs

CYCLES = 20
PAGE = Path(__file__).parents[3] / "docs" / "own_measurements.md"


@pytest.fixture(scope="module")
def answers(recorded: tuple[Inputs, np.ndarray], spec: PipelineSpec) -> Answers:
    return rislam_rt.localise(recorded[0], spec, rng=np.random.default_rng(0))


def test_the_page_names_every_column_and_key() -> None:
    said = PAGE.read_text(encoding="utf-8").partition("## What comes out")[2]
    table, keys = said.split("`map.json` is the map")
    first = [name for row in re.findall(r"^\| (`.*?) \|", table, re.MULTILINE) for name in re.findall("`(.*?)`", row)]
    assert first == list(COLUMNS)
    assert re.findall(r"^\| `(\w+)` \|", keys, re.MULTILINE) == list(MapEstimate.__dataclass_fields__)


def test_what_is_not_finite_is_null(recorded: tuple[Inputs, np.ndarray], answers: Answers) -> None:
    last = answers.estimates[-1]
    files = answer_files(recorded[0], answers)
    known = json.loads(files["map.json"])
    assert len(last.map.wall_offset) > 0
    np.testing.assert_array_equal(known["wall_offset"], last.map.wall_offset)
    np.testing.assert_array_equal(known["covariance"], last.map.covariance)
    assert known["ident"] == last.map.ident.tolist()
    assert "panel" not in known
    known, odd = last.map.wall_std, np.full(last.map.wall_std.shape, np.inf)
    object.__setattr__(last.map, "wall_std", odd)
    told = json.loads(answer_files(recorded[0], answers)["map.json"])["wall_std"]
    object.__setattr__(last.map, "wall_std", known)  # others look at it too
    assert told == [[None, None]] * len(odd)


def test_a_row_a_cycle(recorded: tuple[Inputs, np.ndarray], answers: Answers) -> None:
    rows = list(csv.DictReader(io.StringIO(answer_files(recorded[0], answers)["estimate.csv"].decode())))
    assert [float(row["heading_rad"]) for row in rows] == [float(f"{one.heading:.9g}") for one in answers.estimates]
    assert [float(row["cov_xy_m2"]) for row in rows] == [
        float(f"{one.covariance[0, 1]:.9g}") for one in answers.estimates
    ]
    assert {row["std_heading_rad"] for row in rows} == {""}  # of a compass
    assert [int(row["components"]) for row in rows] == [len(one) for one in recorded[0].measurements]


def test_the_heading_s_deviation_begins_with_the_start_s(
    recorded: tuple[Inputs, np.ndarray], spec: PipelineSpec
) -> None:
    free = spec.model_copy(update={"slam": spec.slam.model_copy(update={"heading": "estimated"})})
    start = replace(recorded[0].start, heading_std=0.03, velocity_std=0.1)
    inputs = recorded[0]._replace(start=start, heading=np.full(CYCLES, np.nan))
    answers = rislam_rt.localise(inputs, free, rng=np.random.default_rng(0))
    rows = list(csv.DictReader(io.StringIO(answer_files(inputs, answers)["estimate.csv"].decode())))
    found = [float(row["std_heading_rad"]) for row in rows]
    assert found == [float(f"{one.heading_std:.9g}") for one in answers.estimates]
    assert found[0] == pytest.approx(0.03, rel=1e-3)
