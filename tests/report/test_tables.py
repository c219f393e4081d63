"""Rows of a run's table: every wall that is heard has one, the others share one."""

from rislam_rt.report.terminal_tables import summary_rows, unnoticed_lines

FOUND = {"rmse_m": 0.01, "angle_deg": 0.1, "bound_m": 0.005}
MISSED = {"rmse_m": None, "angle_deg": None, "bound_m": 0.02}
SILENT = {"rmse_m": None, "angle_deg": None, "bound_m": None}


def _scheme(**walls):
    return {
        "rmse_m": 0.02, "rmse_aligned_m": 0.004, "relative_rmse_m": 0.006, "largest_m": 0.03, "bound_m": 0.01,
        "landmarks": {}, "walls": walls, "map": {"gospa_m": 0.1},
        "association": {"precision": 0.9, "recall": 0.4}, "over_budget": [], "diverged": False, "outcomes": {"ok": 10},
        "lost": {"times": 0, "first_s": None, "causes": {}},
    }  # fmt: skip


def test_walls_that_no_path_meets_share_a_row():
    schemes = {
        "optimized": _scheme(near=FOUND, far=MISSED, behind=SILENT, above=SILENT),
        "no_ris": _scheme(near=MISSED, far=SILENT, behind=SILENT, above=SILENT),
    }
    rows = [row for row in summary_rows({"schemes": schemes}) if "wall" in row[0]]
    assert rows == [
        ["wall near", "1.0 cm, 0.1°", "not found"],
        ["wall far", "not found", "not found"],
        ["2 walls", "not heard", "not heard"],
    ]


def test_the_shape_of_the_path_and_what_was_associated_have_rows_of_their_own():
    one_cycle = _scheme() | {"rmse_aligned_m": None, "relative_rmse_m": None}
    table = {label: cells for label, *cells in summary_rows({"schemes": {"a": _scheme(), "b": one_cycle}})}
    assert table["agent, path aligned"] == ["0.4 cm", "-"]
    assert table["agent, relative to its start"] == ["0.6 cm", "-"]
    assert table["association: precision, recall"] == ["90%, 40%", "90%, 40%"]
    assert table["slower than its budget"] == ["no step", "no step"]


def test_a_scheme_that_diverged_without_noticing_is_told_apart_from_one_that_noticed():
    noticed = {"times": 1, "first_s": 2.0, "causes": {"map": 1}}
    schemes = {
        "silent": _scheme() | {"diverged": True, "largest_m": 3.55},
        "noticed": _scheme() | {"diverged": True, "lost": noticed, "outcomes": {"ok": 9, "diverged": 1}},
        "good": _scheme(),
    }
    table = {label: cells for label, *cells in summary_rows({"schemes": schemes})}
    assert table["diverged"] == ["yes, without noticing", "yes", "no"]
    assert table["held itself for lost"] == ["never", "in 1 of 10 cycles", "never"]
    (line,) = unnoticed_lines({"schemes": schemes})
    assert line.startswith("silent: diverged without noticing: ")
    assert line.endswith("off by up to 3.55 m")
