"""Pages of what is told wrong and of faulty front ends, from cells made up here."""

import json

import pytest
from test_report_swept import RECORD, rows

from rislam_rt.report.swept import write_swept
from rislam_rt.studies.swept import HardwareSpec, RobustnessSpec
from rislam_rt.sweeps.store import Row
from rislam_rt.sweeps.sweep import Cell

COMPASS = {"name": "compass", "key": "told.compass_bias_deg", "levels": [1.0, 2.0], "ordinary": 1.0, "cure": "steel"}
CLOCK = {"name": "clock", "key": "told.clock_offset_ns", "levels": [0.1, 1.0], "ordinary": 1.0, "cure": "zero"}
NOISE = {"name": "noise", "key": "told.noise_db", "levels": [3.0], "ordinary": 3.0}
WORTH = {"reference": 1.0, "compass_1.0": 1.5, "compass_2.0": 9.0, "clock_0.1": 1.0, "clock_1.0": 3.0, "noise_3.0": 0.9}


def test_the_worst_are_those_at_the_level_of_ordinary_equipment(tmp_path):
    """Nine times the error at a level that nobody has counts less than three times at one that all have."""
    spec = RobustnessSpec(kind="robustness", name="robustness", repetitions=6, mismatches=[COMPASS, CLOCK, NOISE])
    assert [variant.name for variant in spec.all_variants] == list(WORTH)
    found = rows([{"variant": n} for n in WORTH], lambda p, f: 0.1 * WORTH[p["variant"]], schemes={"optimized": 1.0})
    page = write_swept(found, spec, RECORD, tmp_path).read_text()
    content = json.loads((tmp_path / "robustness.json").read_text())
    assert content["worst"] == ["clock", "compass"]  # the third does no harm
    change = {entry["variant"]: entry["change"] for entry in content["entries"]}
    assert change["clock_1.0"] == pytest.approx(2.0)
    assert change["reference"] is None
    assert page.index("| zero |") < page.index("| steel |")
    assert (tmp_path / "figures" / "robustness.png").stat().st_size > 1000


def test_a_fault_may_go_as_far_as_the_panel_still_matters(tmp_path):
    """Made-up cells: ghosts come above the first level as built, and above the second one calibrated."""
    fault = {
        "name": "array",
        "key": "hardware.phase_std_deg",
        "levels": [1.0, 3.0, 9.0],
        "ordinary": 3.0,
        "unit": "deg",
    }
    run = {"receiver": {"estimator": "waveform"}}
    spec = HardwareSpec(kind="hardware", name="hardware", repetitions=2, faults=[fault], run=run)
    ghosts = {"1.0": (1.0, 0.5, 1.0, 0.5), "3.0": (14.0, 0.6, 2.0, 0.5), "9.0": (40.0, 8.0, 9.0, 2.9)}
    false = {"reference": (1.0, 1.0)}
    for level, counts in ghosts.items():
        false |= {f"array_{level}": counts[:2], f"array_{level}_calibrated": counts[2:]}
    assert [variant.name for variant in spec.all_variants] == list(false)
    cells, same = [], {"panel": 1.0, "landmarks": 9.0, "components": 20.0, "error_over_std": 1.0, "left": None}
    for name, (untold, told) in false.items():
        result = {"schemes": {}, "receiver": {"false": untold, **same}, "told": {"false": told, **same}}
        for number in range(2):
            cell = Cell(f"{len(cells):032d}", {"variant": name}, number, {}, number, {})
            cells.append(Row(cell, "done", "", result))
    page = write_swept(cells, spec, RECORD, tmp_path).read_text()
    content = json.loads((tmp_path / "hardware.json").read_text())
    assert content["limits"] == {
        "array": {"built": "1.0", "told": "3.0", "calibrated": "3.0", "calibrated_told": "9.0"}
    }
    assert "| 1.0 deg | 3.0 deg | 3.0 deg | 9.0 deg |" in page
