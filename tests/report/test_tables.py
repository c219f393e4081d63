"""Rows of a run's table: every wall that is heard has one, the others share one."""

from rislam_rt.report.terminal_tables import summary_rows

FOUND = {"rmse_m": 0.01, "angle_deg": 0.1, "bound_m": 0.005}
MISSED = {"rmse_m": None, "angle_deg": None, "bound_m": 0.02}
SILENT = {"rmse_m": None, "angle_deg": None, "bound_m": None}


def _scheme(**walls):
    return {
        "rmse_m": 0.02, "bound_m": 0.01, "landmarks": {}, "walls": walls, "map": {"gospa_m": 0.1},
        "association": {"accuracy": 0.9}, "over_budget": [], "diverged": False, "outcomes": {"ok": 10},
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
