"""Rows of a run's table: every wall that is heard or found has one, the others share one."""

import pytest

from rislam_rt.pipeline.scores.loss_causes import unnoticed_lines
from rislam_rt.pipeline.scores.true_loss import silent_loss_lines
from rislam_rt.report.terminal_tables import print_summary, summary_rows

FOUND = {"rmse_m": 0.01, "angle_deg": 0.1, "bound_m": 0.005, "audible_s": 7.0}
MISSED = {"rmse_m": None, "angle_deg": None, "bound_m": 0.02, "audible_s": 2.0}
SILENT = {"rmse_m": None, "angle_deg": None, "bound_m": 0.3, "audible_s": 1.0}


def _scheme(**walls):
    walls = {name: {"plane": number} | wall for number, (name, wall) in enumerate(walls.items())}
    return {
        "rmse_m": 0.02, "rmse_aligned_m": 0.004, "relative_rmse_m": 0.006, "largest_m": 0.03, "bound_m": 0.01,
        "landmarks": {}, "walls": walls, "map": {"gospa_m": 0.1}, "ghost_walls": 0,
        "association": {"precision": 0.9, "recall": 0.4}, "over_budget": [], "diverged": False, "outcomes": {"ok": 10},
        "lost": {"times": 0, "first_s": None, "causes": {}}, "relative_bound_m": 0.002, "nees_per_dof": 0.834,
        "true_loss": {"lost": False, "silent": False, "lost_at_s": None},
    }  # fmt: skip


def _wall_rows(**schemes):
    return [row for row in summary_rows({"schemes": schemes}) if "wall" in row[0]]


def test_walls_are_counted_and_those_that_nothing_tells_of_share_a_row():
    optimized = _scheme(near=FOUND, far=MISSED, behind=SILENT, above=SILENT)
    no_ris = _scheme(near=MISSED, far=SILENT, behind=SILENT, above=SILENT)
    assert _wall_rows(optimized=optimized, no_ris=no_ris | {"ghost_walls": 2}) == [
        ["walls found of those heard", "1 of 2", "0 of 1, 2 ghosts"],
        ["wall near", "1.0 cm, 0.1°", "not found"],
        ["wall far", "not found", "not heard"],
        ["2 other walls", "not heard for 2 s", "not heard for 2 s"],
    ]


def test_walls_in_one_plane_are_one_and_a_wall_that_was_found_is_shown():
    """A plane found for one of its walls is found; one found though seldom heard is listed, and not counted."""
    one = _scheme(floor=MISSED | {"plane": 1}, step=FOUND | {"plane": 1}, near=FOUND, late=FOUND | {"audible_s": 1.0})
    assert _wall_rows(a=one) == [
        ["walls found of those heard", "2 of 2"],
        ["wall floor (+1 in its plane)", "1.0 cm, 0.1°"],
        ["wall near", "1.0 cm, 0.1°"],
        ["wall late", "1.0 cm, 0.1°"],
    ]


def test_a_scheme_that_was_told_of_no_panel_did_not_miss_it():
    """`identified_last` is None there; a scatterer, which every scheme looks for, has no such entry."""
    entry = {"rmse_m": None, "identified_last": False}
    one = _scheme() | {"landmarks": {"panel": entry, "ball": {"rmse_m": None}}}
    other = _scheme() | {"landmarks": {"panel": entry | {"identified_last": None}, "ball": {"rmse_m": None}}}
    rows = {label: cells for label, *cells in summary_rows({"schemes": {"optimized": one, "no_ris": other}})}
    assert rows["landmark panel"] == ["not found", "-"]
    assert rows["landmark ball"] == ["not found", "not found"]
    assert rows["panel found"] == ["no", "-"]


@pytest.mark.parametrize("schemes", [1, 2])
def test_labels_stay_in_one_line_beside_long_cells(schemes, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    lost = _scheme() | {"true_loss": {"lost": True, "silent": True, "lost_at_s": 12.6}}
    summary = {
        "pipeline": "p",
        "scene": "s",
        "cycles": 10,
        "seed": 1,
        "schemes": {f"s{n}": lost for n in range(schemes)},
    }
    print_summary(summary)
    printed = capsys.readouterr().out
    assert all(f"│ {label} " in printed for label, *_ in summary_rows(summary))


def test_a_run_in_slices_lists_what_it_found():
    unasked = {"audible_s": None}
    walls = _wall_rows(a=_scheme(near=FOUND | unasked, far=MISSED | unasked))
    assert walls[:2] == [["walls found", "1"], ["wall near", "1.0 cm, 0.1°"]]
    assert walls[2] == ["1 other wall", "not found"]  # whether it was heard is not known


def test_the_shape_of_the_path_and_what_was_associated_have_rows_of_their_own():
    one_cycle = _scheme() | {"rmse_aligned_m": None, "relative_rmse_m": None}
    table = {label: cells for label, *cells in summary_rows({"schemes": {"a": _scheme(), "b": one_cycle}})}
    assert table["agent, path aligned"] == ["0.4 cm", "-"]
    assert table["agent, relative to its start"] == ["0.6 cm", "-"]
    assert table["agent, largest error"] == ["3.0 cm", "3.0 cm"]
    assert (table["posterior bound of the agent"], table["agent over it"]) == (2 * ["1.0 cm"], 2 * ["2.0"])
    assert table["bound relative to the start"] == 2 * ["2.00 mm"]
    assert table["agent over it, relative to its start"] == ["3.0", "-"]
    assert table["NEES per degree of freedom"] == ["0.83", "0.83"]
    assert table["association: precision, recall"] == ["90%, 40%", "90%, 40%"]
    assert table["slower than its budget"] == ["no step", "no step"]


def test_a_scheme_that_strayed_by_less_than_half_a_metre_is_lost_all_the_same():
    """By the truth, as `score` says it: whether silently, and with a warning of its own unless it diverged as well."""
    lost = {"lost": True, "silent": False, "lost_at_s": 7.7}
    schemes = {
        "silent": _scheme() | {"true_loss": lost | {"silent": True}, "largest_m": 0.25},
        "noticed": _scheme() | {"true_loss": lost},
        "far": _scheme() | {"true_loss": lost | {"silent": True}, "diverged": True},
        "lost twice": _scheme()
        | {
            "true_loss": lost | {"silent": True},
            "largest_m": 0.7,
            "diverged": True,
            "lost": {"times": 1, "first_s": 2.0, "causes": {"map": 1}},
        },
        "good": _scheme(),
        "in slices": _scheme() | {"true_loss": None, "bound_m": None, "relative_bound_m": None, "nees_per_dof": None},
    }
    table = {label: cells for label, *cells in summary_rows({"schemes": schemes})}
    silent = "from 7.7 s on, silently"
    said = [silent, "from 7.7 s on", silent, silent, "no", "-"]
    assert table["lost, relative to its start"] == said
    assert table["agent over it"][-1] == table["NEES per degree of freedom"][-1] == "-"
    line, twice = silent_loss_lines(schemes)
    assert twice.startswith("lost twice: silently lost")
    assert line.startswith("silent: silently lost from 7.7 s on: off by more than 0.1 m and 5 bounds for 1 s on end")
    assert line.endswith("its position by up to 0.25 m")


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
    (line,) = unnoticed_lines(schemes)
    assert line.startswith("silent: diverged without noticing: ")
    assert line.endswith("off by up to 3.55 m")
