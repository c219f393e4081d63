"""The score card of one run: the rows of the page of unseen rooms, and what is not known is not a number."""

from rislam_rt.report.unseen import page, run_card
from rislam_rt.studies.score_card.score import OVER_TIME

SCORES = {
    "rmse_m": 0.0077, "ratio": 0.54, "relative_rmse_m": 0.0085, "relative_ratio": 12.8, "relative_bound_m": 0.00066,
    "dead_reckoning_m": 5.0, "nees": None, "horizontal_nees": 0.17, "lost": True, "lost_at_s": 1.25, "silent": False,
    "births": 60, "births_judged": 29, "births_right": 27, "walls_heard": 11, "walls_found": 6, "walls_good": 5,
    "wall_deg": 0.07, "wall_m": 0.002, "wall_delay_s": 1.55, "points_heard": 5, "points_found": 4, "point_m": 0.02,
    "point_delay_s": 2.4, "panel_heard": True, "panel_found": True, "panel_delay_s": 9.2, "ghost_walls": 2,
    "ghost_points": 1, "gospa_m": 0.7, "cycle_ms": 31.4,
}  # fmt: skip


def test_a_runs_card_has_the_words_of_the_page() -> None:
    there = {label.partition(":")[0].replace(" a run", "").replace(" of those heard", "") for label in page.ROWS}
    of_many = {"runs (failed)", "NEES within 0.7 to 2", "its mean over the runs"}
    assert {label.replace(" of those heard", "") for label in run_card.ROWS} == there - of_many


def test_cells() -> None:
    alone = {**SCORES, **dict.fromkeys(OVER_TIME), "cycle_ms": None, "panel_heard": False, "lost": False}
    rows = run_card.card_rows({"random": SCORES, "last map": alone})
    assert rows["relative RMSE [mm]"] == ["8.50", "8.50"]
    assert rows["relative RMSE after 10 s [mm]"] == rows["NEES per degree of freedom"] == ["-", "-"]
    assert rows["lost"] == ["from 1.2 s on", "no"]
    assert rows["walls found of those heard"] == ["6 of 11", "6 of 11"]
    assert rows["landmarks (with panel) found of those heard"] == ["4 of 5", "4 of 5"]
    assert rows["births of the right kind"] == ["27 of 29", "not known"]
    assert rows["births"] == ["60", "not known"]
    assert rows["delay of walls [s]"] == ["1.55", "not known"]
    assert rows["panel found"] == ["yes", "not heard"]
    assert rows["delay of the panel [s]"] == ["9.20", "not known"]
    assert rows["CPU time of the estimator a cycle [ms]"] == ["31.4", "-"]
    lost = run_card.card_rows({"random": {**SCORES, "panel_found": False, "panel_delay_s": None}})
    assert (lost["panel found"], lost["delay of the panel [s]"]) == (["no"], ["-"])


def test_a_run_without_a_panel_has_no_row_of_it() -> None:
    none = {**SCORES, "panel_heard": None, "panel_found": None, "panel_delay_s": None}
    assert not [label for label in run_card.card_rows({"off": none}) if label in run_card.OF_PANEL]
    rows = run_card.card_rows({"random": SCORES, "off": none})
    assert [rows[label] for label in run_card.OF_PANEL] == [["yes", "-"], ["9.20", "-"]]
