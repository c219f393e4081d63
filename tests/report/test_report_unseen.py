"""The pages of unseen rooms, from cells made by hand whose medians and shares are known."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rislam_rt.evaluate import Interval, share_interval
from rislam_rt.input_messages import share_text
from rislam_rt.report.markdown import percent
from rislam_rt.report.terminal_tables import print_cards
from rislam_rt.report.unseen import score_cards, write_unseen
from rislam_rt.report.unseen.page import COLUMNS, ROWS, about_lines
from rislam_rt.report.unseen.score_cards import by_series, card, class_cards, cycle_times, read_runs
from rislam_rt.studies.unseen import UnseenSpec
from rislam_rt.studies.unseen.sweep import SNR
from rislam_rt.sweeps import Row
from rislam_rt.sweeps.sweep import Cell

RECORD = {"settings": {"cycles": 200, "depth": 2}, "code": "abc"}


def scores(error: float, lost: bool, **more: Any) -> dict[str, Any]:
    names = (
        "rmse_m", "bound_m", "ratio", "relative_rmse_m", "relative_bound_m", "relative_ratio", "late_rmse_m",
        "late_bound_m", "late_ratio", "late_relative_rmse_m", "late_relative_bound_m", "late_relative_ratio",
        "dead_reckoning_m", "nees", "horizontal_nees", "expected_ratio", "expected_nees", "wall_deg", "wall_m",
        "wall_delay_s", "point_m", "point_delay_s", "panel_delay_s", "gospa_m",
    )  # fmt: skip
    counts = {"walls_heard": 5, "walls_found": 4, "walls_good": 3, "points_heard": 2, "points_found": 1}
    counts |= {"births": 6, "births_judged": 4, "births_right": 3, "ghost_walls": 1, "ghost_points": 0}
    found = {"panel_heard": True, "panel_found": not lost, "lost": lost, "silent": lost, "lost_at_s": None}
    return {"ran": "optimized", **dict.fromkeys(names, error), **counts, **found, **more}


def row(room: int, variant: str, result: dict[str, Any] | None, snr: float = 13.0) -> Row:
    point = {"room": room, "variant": variant, SNR: snr}
    cell = Cell(f"{room}-{variant}-{snr:g}", point, 0, {}, 1, {})
    if result is None:
        return Row(cell, "died", "killed", {})
    traits = {"seed": room, "shape": "l" if room % 2 else "convex", "ceiling": "flat", "motion": "corner"}
    traits |= {"size": 4.0 + room, "reflection": 0.5, "pieces": 0, "panel": "wall", "below": 0, "hidden": 1}
    return Row(cell, "done", "", {"traits": {**traits, "speed": 0.1}, "schemes": {"optimized": result}})


def rows() -> list[Row]:
    errors = {0: 0.01, 1: 0.02, 2: 0.03, 3: 0.9, 4: 0.05}
    good = [row(room, variant, scores(e, e > 0.5)) for room, e in errors.items() for variant in ("a", "b")]
    return [*good, row(5, "a", None), row(5, "b", {"failed": "no such thing"})]


def test_medians_percentiles_and_shares() -> None:
    series = by_series(read_runs(rows()))
    assert list(series) == ["a", "b"]
    entry = card(series["a"])
    assert (entry["runs"], entry["failed"]) == (5, 1)
    assert entry["relative_rmse_m"] == pytest.approx(0.03)
    assert entry["relative_rmse_m_p95"] == pytest.approx(np.quantile([0.01, 0.02, 0.03, 0.05, 0.9], 0.95))
    assert entry["relative_rmse_m_low"] <= 0.03 <= entry["relative_rmse_m_high"]
    assert entry["lost"] == pytest.approx(0.2)
    assert (entry["walls_found"], entry["walls_good"]) == (pytest.approx(0.8), pytest.approx(0.6))
    assert entry["births_right"] == pytest.approx(0.75)
    assert entry["panel_found"] == pytest.approx(0.8)
    # NEES of 0.9 alone is within 0.7 to 2
    assert (entry["consistent_count"], entry["consistent_of"]) == (1, 5)


def test_a_few_do_not_read_as_none_nor_all_but_a_few_as_all() -> None:
    spelled = {0.0: "0%", 0.005: "0.5%", 1 / 12000: "0.01%", 1e-6: "below 0.01%", 0.37: "37%", 0.996: "99.6%",
               199.5 / 200: "99.8%", 1 - 1e-6: "above 99.99%", 1.0: "100%", 1e-17: "0%"}  # fmt: skip
    assert {share: share_text(share) for share in spelled} == spelled
    entry = {"lost": 0.005, "lost_low": 0.0009, "lost_high": 0.0278, "lost_of": 200}
    assert ROWS["lost"](entry) == "0.5% (0.1% to 3%) of 200"
    assert COLUMNS["lost"](entry) == "0.5%"
    assert percent(0.004) == "0.4 %"


def test_every_run_is_in_one_class_of_each_division() -> None:
    runs = by_series(read_runs(rows()))["a"]
    cards = class_cards(runs)
    for division in {entry["division"] for entry in cards}:
        assert sum(entry["runs"] for entry in cards if entry["division"] == division) == 5
    sizes = [entry["class"] for entry in cards if entry["division"] == "size"]
    assert sizes == ["below 6 m", "6 to 15 m"]
    assert {entry["class"] for entry in cards if entry["division"] == "plan"} == {"convex", "L"}


def test_wilson_interval_against_its_formula_at_the_ends_and_in_the_middle() -> None:
    # Brown, Cai and DasGupta (2001): at 0 of n the upper end is z^2 / (n + z^2)
    z2 = 1.959963984540054**2
    assert share_interval(0, 10).upper == pytest.approx(z2 / (10 + z2))
    assert share_interval(10, 10).lower == pytest.approx(10 / (10 + z2))
    assert (share_interval(0, 10).lower, share_interval(10, 10).upper) == (0.0, 1.0)
    low, high = share_interval(3, 10)[1:]
    for p in (low, high):  # ends are where the score test is just not rejected
        assert (0.3 - p) ** 2 == pytest.approx(z2 * p * (1.0 - p) / 10)


def test_files_of_a_study(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """With the range for the interval, which takes a hundred draws of a thousand: the test above looks at it."""
    monkeypatch.setattr(score_cards, "bootstrap", lambda data, **_: Interval(*np.quantile(data, [0.5, 0.0, 1.0])))
    spec = UnseenSpec.model_validate({"kind": "unseen", "name": "x", "rooms": 7})
    timings = [{"ident": "0-a-13", "timing": {"optimized": {"cycle_s": 0.002}}}]
    page = write_unseen([*rows(), Row(rows()[0].cell, "missing", "", {})], spec, RECORD, tmp_path, tests=3,
                        timings=timings)  # fmt: skip
    assert page is not None
    text = page.read_text()
    for words in ("were run **3 times**", "Not complete: 11 of 13 cells", "room 5, a: died: killed", "no such thing"):
        assert words in text
    assert "| RMSE / bound | 0.03 (" in text
    assert "| CPU time of the estimator a cycle [ms] | 2.0 | - |" in text
    assert (tmp_path / "figures" / "x.png").stat().st_size > 1000
    assert len((tmp_path / "x.csv").read_text().splitlines()) == 11
    content = json.loads((tmp_path / "x.json").read_text())
    assert content["tests"] == 3
    assert content["cards"]["b"]["failed"] == 1
    told = [
        " ".join(about_lines(spec.model_copy(update={"ways": ways}), RECORD, 0, 1, 1))
        for ways in ("anyhow", "along_walls", "carried")
    ]
    assert ["along the walls" in text for text in told] == [False, True, True]
    assert ["carried by a walker" in text for text in told] == [False, False, True]
    print_cards(rows(), timings)
    assert "relative RMSE [mm]" in capsys.readouterr().out


def test_series_are_named_by_what_differs() -> None:
    found = [row(0, "a", scores(0.1, False), snr) for snr in (13.0, 0.0)]
    assert list(by_series(read_runs(found))) == ["13 dB", "0 dB"]
    assert list(by_series(read_runs(found[:1]))) == ["optimized"]


def test_of_cells_timed_twice_the_last_one_counts() -> None:
    runs = by_series(read_runs(rows()))
    timings = [{"ident": "0-a-13", "timing": {"optimized": {"cycle_s": value}}} for value in (0.009, 0.004)]
    assert cycle_times(runs, timings) == {"a": pytest.approx(4.0), "b": None}


def test_nothing_is_written_before_a_run_is_there(tmp_path: Path) -> None:
    spec = UnseenSpec.model_validate({"kind": "unseen", "name": "x"})
    assert write_unseen([row(5, "a", None)], spec, RECORD, tmp_path, tests=0, timings=[]) is None
    assert not list(tmp_path.iterdir())
