"""Pages of swept studies from cells made up here: numbers, intervals, counts of failures, pictures."""

import csv
import json

import numpy as np
import pytest

from rislam_rt.report.studies.claims import claims_page, write_claims
from rislam_rt.report.swept import write_swept
from rislam_rt.report.swept.entries import bound_beside, scheme_entry, what_limits
from rislam_rt.report.swept.rooms import budget, missed_aims
from rislam_rt.studies.claims import judge, read_results
from rislam_rt.studies.swept import AblationsSpec, Fig4bSpec, Fig4cSpec, RoomsSpec, group_rows
from rislam_rt.studies.swept.sweep import SNR
from rislam_rt.sweeps.store import Row
from rislam_rt.sweeps.sweep import Cell

RECORD = {
    "kind": "made up", "seed": 7, "scenes": {"paper_room": {"sha256": "0" * 64}}, "versions": {},
    "settings": {"channel": "image_source", "depth": 1, "cycles": 10},
}  # fmt: skip
SCHEMES = {"optimized": 1.0, "random": 1.6, "no_ris": 2.5, "bp_slam": 6.0, "channel_slam": 5.0}


WALL_SCORES = ("angle_deg", "offset_m", "std_deg", "bound_deg", "bound_m", "audible_s")


def scores(rmse, bound, *, diverged=False, panel=0.05):
    return {
        "rmse_m": rmse, "rmse_aligned_m": 0.25 * rmse, "bound_m": bound, "over_bound": rmse / bound,
        "diverged": diverged, "nees_per_dof": 1.1, "association": {"accuracy": 0.97}, "map": {"gospa_m": 0.3},
        "landmarks": {
            "sphere": {"final_m": 0.04, "rmse_m": 0.05, "cycles_held": 9, "bound_m": 0.03},
            "ris": {
                "final_m": panel, "rmse_m": panel, "cycles_held": 9, "cycles_identified": 8, "bound_m": 0.01,
                "audible_from_s": 0.1, "identified_from_s": 0.7,
            },
        },
        "walls": {
            name: dict(zip(WALL_SCORES, values, strict=True))
            for name, values in (
                ("floor", (1.0, 0.02, 0.6, 0.5, 0.01, 9.0)),
                ("ceiling", (None, None, None, 7.0, 3.0, 2.0)),
                ("table", (None, None, None, 9.0, 9.0, 1.9)),
            )
        },
        "ghost_walls": 2,
    }  # fmt: skip


def rows(points, worth, repetitions=6, schemes=SCHEMES):
    """Cells whose errors have a known size: `worth(point, scheme)` times a log-normal factor that schemes share."""
    found = []
    for point in points:
        for repetition in range(repetitions):
            luck = float(np.exp(0.3 * np.random.default_rng(repetition).standard_normal()))
            own = {
                name: scores(worth(point, factor) * luck, 0.8 * worth(point, factor))
                for name, factor in schemes.items()
            }
            cell = Cell(f"{len(found):032d}", point, repetition, {}, repetition, {})
            found.append(Row(cell, "done", "", {"schemes": own, "paper_snr_db": point.get(SNR, 0.0) + 15.0}))
    return found


def snr_rows(**options):
    points = [{"variant": "calm", SNR: snr} for snr in (-10.0, 0.0, 10.0, 20.0, 30.0)]
    # the worse a scheme, the more it gains from SNR: at 30 dB all are alike, as with a floor by the start
    return rows(points, lambda p, f: 0.012 + 0.05 * f * 10 ** (-p[SNR] / 20), **options)


def fig4b_spec(repetitions=6):
    cases = [{"name": "calm", "note": "a slow walk"}]
    return Fig4bSpec(kind="fig4b", name="fig4b", repetitions=repetitions, cases=cases)


@pytest.fixture(scope="module")
def fig4b(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fig4b")
    page = write_swept(snr_rows(), fig4b_spec(), RECORD, folder)
    return page.read_text(), json.loads((folder / "fig4b.json").read_text()), folder


def test_errors_are_root_mean_squares_over_the_seeds(fig4b):
    _, content, folder = fig4b
    group = group_rows(snr_rows())[1]
    column = group.column("random", "rmse_m")
    entry = next(e for e in content["entries"] if e["snr_db"] == 0.0 and e["scheme"] == "random")
    assert entry["rmse_m"] == pytest.approx(np.sqrt(np.mean(column**2)))
    assert entry["rmse_low_m"] < entry["rmse_m"] < entry["rmse_high_m"]
    assert entry["aligned_m"] == pytest.approx(0.25 * entry["rmse_m"])
    assert entry["each_m"] == pytest.approx(list(column))
    assert entry["paper_snr_db"] == 15.0
    table = list(csv.DictReader((folder / "fig4b.csv").read_text().splitlines()))
    assert len(table) == 5 * len(SCHEMES)
    assert float(table[0]["rmse_m"]) == pytest.approx(content["entries"][0]["rmse_m"], rel=1e-5)
    assert (folder / "figures" / "fig4b.png").read_bytes().startswith(b"\x89PNG")


def test_gains_come_from_pairs_and_so_have_no_width_where_all_luck_is_shared(fig4b):
    _, content, _ = fig4b
    for gain in content["gains"]:
        bounds = {e["scheme"]: e["bound_m"] for e in content["entries"] if e["snr_db"] == gain["snr_db"]}
        assert gain["gain"] == pytest.approx(1.0 - bounds["optimized"] / bounds[gain["over"]])
        assert gain["bound_gain"] == pytest.approx(gain["gain"])
        assert gain["gain_high"] - gain["gain_low"] < 1e-12
        assert gain["lower_by_m"] > 0.0


def test_failures_are_counted_and_never_dropped(tmp_path, undrawn):
    found = snr_rows()
    found[0] = Row(found[0].cell, "died", "its process ended", {})
    broken = dict(found[1].result["schemes"])
    broken["random"] = {"failed": "no luck"}
    found[1] = found[1]._replace(result={**found[1].result, "schemes": broken})
    lost = dict(found[2].result["schemes"])
    lost["random"] = scores(9.0, 0.1, diverged=True)
    found[2] = found[2]._replace(result={**found[2].result, "schemes": lost})
    group = group_rows(found)[0]
    entry = scheme_entry(group, "random")
    assert (entry["runs"], entry["failed"], entry["diverged"]) == (4, 2, 1)
    assert entry["rmse_m"] > 4.0  # the diverged run is in the mean: 9 m in one of four
    assert scheme_entry(group, "optimized")["failed"] == 1
    page = write_swept(found, fig4b_spec(), RECORD, tmp_path).read_text()
    assert "6 failed and 1 diverged" in page  # five schemes of the lost cell, and one of the next
    assert "- random: no luck" in page
    assert "Not complete: 29 of 30 cells" in page
    only = [row if row.cell.point[SNR] == 0.0 else row._replace(state="missing", result={}) for row in snr_rows()]
    page = write_swept(only, fig4b_spec(), RECORD, tmp_path).read_text()
    assert "Not complete: 6 of 30 cells" in page


def test_nothing_is_written_before_the_first_cell_and_one_cell_is_enough(tmp_path):
    found = snr_rows(repetitions=1)
    empty = [row._replace(state="missing", result={}) for row in found]
    assert write_swept(empty, fig4b_spec(1), RECORD, tmp_path) is None
    assert list(tmp_path.iterdir()) == []
    text = write_swept([found[0], *empty[1:]], fig4b_spec(1), RECORD, tmp_path).read_text()
    assert "Of 5 runs 0 failed" in text  # what has not run yet has not failed
    assert "nan" not in text.lower().replace("variance", "")


def test_what_limits():
    entry = {"over_bound": 1.4, "association": 0.5}
    assert what_limits(entry) == "bound"
    assert what_limits({**entry, "over_bound": 3.0}) == "association"
    assert what_limits({**entry, "over_bound": 3.0, "association": 0.99}) == "filter"
    assert what_limits({**entry, "over_bound": None}) == "-"


def test_panel_sizes_tell_agent_and_panel(tmp_path):
    points = [{"size": size} for size in (4, 8, 16)]
    spec = Fig4cSpec(kind="fig4c", name="fig4c", repetitions=6, sizes=[4, 8, 16])
    page = write_swept(rows(points, lambda p, f: 0.1 * f / p["size"]), spec, RECORD, tmp_path).read_text()
    content = json.loads((tmp_path / "fig4c.json").read_text())
    fall = next(fall for fall in content["falls"] if fall["scheme"] == "optimized")
    assert fall["agent"] == pytest.approx(0.75)  # a quarter of the error with four times the side
    assert fall["panel"] == pytest.approx(0.0)
    assert "16 x 16" in page
    assert next(e for e in content["entries"] if e["scheme"] == "no_ris")["ris_found"] is None


def test_rooms_say_which_aims_are_missed(tmp_path):
    points = [{"scene": f"../scenes/{name}"} for name in ("paper_room", "office")]
    spec = RoomsSpec(kind="rooms", name="rooms", repetitions=6, scenes=[p["scene"] for p in points])
    page = write_swept(rows(points, lambda p, f: 0.02 * f), spec, RECORD, tmp_path).read_text()
    assert "| office | optimized |" in page
    assert "1.00, bound 0.50 (50%)" in page
    assert "| 0.7 (0.1) |" in page  # the panel is held from 0.7 s on, audible from 0.1 s on
    entry = scheme_entry(group_rows(rows(points, lambda p, f: 0.02 * f))[0], "optimized")
    assert missed_aims(entry) == []
    assert missed_aims({**entry, "ris_m": None, "wall_deg": 2.1, "diverged": 1}) == ["ris_m", "wall_deg", "diverged"]
    assert missed_aims({**entry, "ris_m": None, "ris_found": None}) == []
    assert entry["wall_found"] == 0.5  # of the table too little is heard
    assert entry["ghost_walls"] == 2.0


def test_walls_that_are_found_though_none_is_heard_for_long_have_no_share(tmp_path):
    """As in a run of half a second: the table used to end in a traceback."""
    cells = rows([{"scene": "../scenes/paper_room"}], lambda p, f: 0.02 * f)
    for row in cells:
        for scheme in row.result["schemes"].values():
            scheme["walls"] = {name: {**wall, "audible_s": 0.6} for name, wall in scheme["walls"].items()}
    spec = RoomsSpec(kind="rooms", name="rooms", repetitions=6, scenes=["../scenes/paper_room"])
    page = write_swept(cells, spec, RECORD, tmp_path).read_text()
    assert "| 1.00, bound 0.50 |" in page
    assert "None" not in page


def test_what_has_not_run_is_not_counted_as_not_found():
    """Of a sweep that goes on, each share is of the runs that there are."""
    points = [{"scene": "../scenes/paper_room"}]
    whole = group_rows(rows(points, lambda p, f: 0.02 * f))[0]
    part = whole._replace(results=(*whole.results[:2], *(None for _ in whole.results[2:])), missing=4)
    found, every = (scheme_entry(group, "optimized") for group in (part, whole))
    shares = [name for name in every if name.endswith("_found") and every[name] is not None]
    assert {name: found[name] for name in shares} == {name: every[name] for name in shares}
    assert found["wall_found"] == 0.5


def test_rooms_of_one_name_are_told_apart(tmp_path):
    points = [{"scene": f"{place}/hall"} for place in ("../a", "../b")]
    spec = RoomsSpec(kind="rooms", name="rooms", repetitions=6, scenes=[p["scene"] for p in points])
    page = write_swept(rows(points, lambda p, f: 0.02 * f), spec, RECORD, tmp_path).read_text()
    assert "| a/hall | optimized |" in page
    assert "| b/hall | optimized |" in page


def test_rooms_under_several_settings_have_a_line_each(tmp_path):
    points = [{"variant": name, "scene": "../scenes/office"} for name in ("paper", "use_vt")]
    variants = [{"name": "paper"}, {"name": "use_vt", "set": {"slam.use_vt": True}}]
    spec = RoomsSpec(kind="rooms", name="rooms", repetitions=6, scenes=["../scenes/office"], variants=variants)
    write_swept(rows(points, lambda p, f: 0.02 * f * (1 + (p["variant"] == "paper"))), spec, RECORD, tmp_path)
    own = [e for e in json.loads((tmp_path / "rooms.json").read_text())["entries"] if e["scheme"] == "optimized"]
    assert [entry["room"] for entry in own] == ["office", "office"]
    assert [entry["series"] for entry in own] == ["optimized", "optimized, use_vt"]
    assert own[0]["rmse_m"] == pytest.approx(2.0 * own[1]["rmse_m"])


def test_bounds_are_those_of_what_was_found():
    """The ceiling was not: its bound of 7 degrees is in none. Where nothing was found, the bounds are all there is."""
    entry = scheme_entry(group_rows(rows([{"scene": "a/b"}], lambda p, f: 0.02))[0], "optimized")
    assert (entry["wall_bound_deg"], entry["wall_bound_m"]) == (pytest.approx(0.5), pytest.approx(0.01))
    assert (entry["scatterer_bound_m"], entry["ris_bound_m"]) == (pytest.approx(0.03), pytest.approx(0.01))
    error = np.array([np.nan, 2.0, np.nan])
    assert bound_beside(np.array([3.0, 0.5, np.nan]), error) == 0.5
    assert bound_beside(np.array([3.0, 3.0, np.nan]), error * np.nan) == pytest.approx(3.0)
    assert bound_beside(np.full(3, np.nan), error) is None


def test_budget_of_each_missed_aim():
    entry = {"over_bound": 2.0, "association": 0.99, "wall_deg": 3.0, "wall_bound_deg": 2.5}
    entry |= {"ris_m": None, "ris_bound_m": 0.2}
    assert budget(entry, "rmse_m") == "filter"
    assert budget(entry, "wall_deg") == "bound"
    assert budget({**entry, "wall_bound_deg": 0.1}, "wall_deg") == "filter"
    assert budget({**entry, "wall_bound_deg": 0.1, "association": 0.5}, "wall_deg") == "association"
    assert budget({**entry, "wall_bound_deg": None}, "wall_deg") == "not heard"
    assert budget(entry, "ris_m") == "bound"  # never found, and known to 0.2 m at best
    assert budget({**entry, "ris_bound_m": 0.02}, "ris_m") == "filter"


def test_ablations_hold_every_variant_against_the_reference(tmp_path):
    names = {"reference": 1.0, "worse": 2.0, "better": 0.5, "same": 1.0}
    variants = [{"name": name, "group": "" if name == "reference" else "Filter"} for name in names]
    spec = AblationsSpec(kind="ablations", name="ablations", repetitions=6, variants=variants)
    found = rows([{"variant": n} for n in names], lambda p, f: 0.1 * names[p["variant"]], schemes={"optimized": 1.0})
    page = write_swept(found, spec, RECORD, tmp_path).read_text()
    change = {e["variant"]: e["change"] for e in json.loads((tmp_path / "ablations.json").read_text())["entries"]}
    assert change["reference"] is None
    assert change["worse"] == pytest.approx(1.0)
    assert change["better"] == pytest.approx(-0.5)
    assert change["same"] == pytest.approx(0.0)
    assert "| `worse` | optimized |" in page


def test_claims_follow_the_numbers(fig4b, tmp_path):
    results = read_results(fig4b[2])
    found = {claim.claim: claim for claim in judge(results)}
    share = found["error at least 31 % lower than every benchmark's (calm)"]
    # random is 1.6 times as bad where SNR decides: 0.37 below; 0.31 is passed at low SNR alone, for there is a floor
    assert share.verdict == "reproduced in part"
    assert "-10 dB: 3" in share.found
    assert found["lowest error of all schemes at every SNR (calm)"].verdict == "reproduced"
    assert found["error falls as the SNR grows (calm)"].verdict == "reproduced"
    assert found["agent's error falls with the panel's size"].verdict == "not known"
    page = claims_page(list(found.values()), results)
    assert page.count("| ") > 8
    again = write_claims(judge(results), "claims", {}, tmp_path / "out")
    assert again.read_text().startswith("# The paper's claims")
    assert len(json.loads((tmp_path / "out" / "claims.json").read_text())["claims"]) == len(found)


@pytest.mark.parametrize(
    ("middle", "low", "verdict"),
    [(0.03, 0.1, "reproduced"), (0.2, 0.1, "reproduced in part"), (0.03, -0.1, "not reproduced")],
)
def test_an_error_that_falls_with_the_panel_falls_at_every_size(middle, low, verdict):
    course = {16: 0.02, 4: 0.04, 8: middle}  # in any order
    content = {
        "cases": [], "entries": [
            {"scheme": "optimized", "size": size, "rmse_m": value, "panel_m": 0.02} for size, value in course.items()
        ],
        "falls": [{"scheme": "optimized", **{f"{name}{end}": value for name in ("agent", "panel")
                   for end, value in (("", 0.5), ("_low", low), ("_high", 0.6))}}],
    }  # fmt: skip
    found = {claim.claim: claim.verdict for claim in judge({"fig4c": content})}
    assert found["agent's error falls with the panel's size"] == verdict


def test_a_claim_that_fails_is_not_called_reproduced():
    gains = [
        {"case": "calm", "snr_db": 0.0, "over": over, "gain": value, "gain_low": value - 0.1, "gain_high": value + 0.1,
         "lower_by_m": 0.01, "lower_by_low_m": 0.0, "lower_by_high_m": 0.02, "bound_gain": 0.1}
        for over, value in (("random", -0.2), ("no_ris", 0.05))
    ]  # fmt: skip
    found = {claim.claim: claim for claim in judge({"fig4b": {"gains": gains, "entries": []}})}
    assert found["lowest error of all schemes at every SNR (calm)"].verdict == "not reproduced"
    assert found["error at least 31 % lower than every benchmark's (calm)"].verdict == "not reproduced"
    assert found["error about 0.1 m lower than without a panel (calm)"].verdict == "not reproduced"
