"""Swept studies: their cells, what these depend on, and the whole way from a file to a page."""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.studies import load_any
from rislam_rt.studies.swept import build_sweep, cell_spec, group_rows, paired_difference, paired_gain, spread
from rislam_rt.studies.swept import sweep as swept_sweep
from rislam_rt.studies.swept.cell import run_cell
from rislam_rt.studies.swept.sweep import SNR
from rislam_rt.sweeps import build_cells

PIPELINES = Path(__file__).parents[2] / "pipelines"
TINY = ("run.channel=image_source", "run.cycles=4", "run.depth=0", "run.receiver.estimator=bound", "repetitions=2")
NAMES = ("fig4b", "fig4b_lively", "fig4c", "rooms", "ablations", "weighting", "robustness", "hardware")


def cells_of(name, *overrides):
    path = PIPELINES / f"{name}.toml"
    spec = load_any(path, [*TINY[:3], *overrides])
    return build_cells(build_sweep(spec, path))


def settings_of(name, *overrides):
    path = PIPELINES / f"{name}.toml"
    sweep = build_sweep(load_any(path, [*TINY, *overrides]), path)
    return [({**cell.settings, **sweep.local}, cell) for cell in build_cells(sweep)]


@pytest.mark.parametrize("name", NAMES)
def test_every_committed_study_can_run(name):
    """All cells are built, which checks settings, room and schemes of each; at least twenty seeds where cheap."""
    cells = cells_of(name)
    assert len({cell.ident for cell in cells}) == len(cells)
    assert len({cell.repetition for cell in cells}) >= {"rooms": 10, "hardware": 3}.get(name, 20)


def test_all_points_of_a_repetition_draw_the_same_numbers():
    cells = cells_of("fig4b")
    by_repetition = {}
    for cell in cells:
        by_repetition.setdefault(cell.repetition, set()).add(cell.seed)
    assert all(len(seeds) == 1 for seeds in by_repetition.values())
    assert len(set.union(*by_repetition.values())) == len(by_repetition)


def test_changed_code_of_the_package_is_another_cell(monkeypatch):
    before = {cell.ident for cell in cells_of("fig4b")}
    assert before == {cell.ident for cell in cells_of("fig4b")}
    monkeypatch.setattr(swept_sweep, "code_digest", lambda: "of another code")
    assert not before & {cell.ident for cell in cells_of("fig4b")}


def test_a_changed_variant_leaves_the_others_cells_as_they_are():
    before = cells_of("ablations")
    after = cells_of("ablations", "variants=[{name='reference'},{name='exact',set={schemes=['genie']}}]")
    kept = {cell.ident for cell in before} & {cell.ident for cell in after}
    assert {cell.point["variant"] for cell in after if cell.ident in kept} == {"reference"}
    assert len(kept) == 20


def test_what_a_cell_runs_is_the_study_then_the_size_then_the_variant():
    spec = cell_spec(
        {"run": {"seed": 3, "room": {"panel_levels": 2}}, "size": 8, "variant": "a", "variants": {"a": {"seed": 4}}}
    )
    assert (spec.room.panel_rows, spec.room.panel_cols, spec.room.panel_levels, spec.seed) == (8, 8, 2, 4)


@pytest.mark.parametrize(
    ("name", "setting", "wanted"),
    [
        ("fig4b", "run.cyles=3", "did you mean 'cycles'"),
        ("ablations", "variants=[{name='a',set={'slam.filter'='kalman'}}]", "variant 'a'.*slam.filter"),
        ("fig4b", "cases=[{name='a'},{name='a'}]", "the name 'a' comes twice"),
        ("rooms", "scenes=[]", "scenes"),
    ],
)
def test_bad_files_are_refused_with_the_field(name, setting, wanted):
    with pytest.raises(ConfigError, match=wanted):
        load_any(PIPELINES / f"{name}.toml", [setting])


def test_a_room_that_does_not_fit_is_refused_before_anything_runs():
    with pytest.raises(ConfigError, match=r"empty_box.*needs a panel"):
        cells_of("rooms", "scenes=['empty_box']")
    with pytest.raises(ConfigError, match="10000 received; the scene has 600"):
        cells_of("fig4c", "run.cycles=10000")


def test_a_cell_scores_every_scheme_and_isolates_one_that_fails(monkeypatch):
    import rislam_rt.studies.swept.cell as module

    whole = module.run_scheme

    def broken(name, *arguments):
        if name == "random":
            raise ValueError("singular")
        return whole(name, *arguments)

    monkeypatch.setattr(module, "run_scheme", broken)
    settings, cell = settings_of("fig4b")[0]
    found = run_cell(settings, cell.seed)
    assert found["schemes"].pop("random") == {"failed": "ValueError: singular"}
    assert set(found["schemes"]) == {"optimized", "no_ris", "bp_slam", "channel_slam"}
    for name, scores in found["schemes"].items():
        assert np.isfinite(scores["rmse_m"]), name
        assert scores["bound_m"] > 0.0, name
        assert "seconds" not in scores
        assert found["timing"][name]["cpu_seconds"] >= 0.0


def test_designed_codes_are_worth_their_gain_at_0_db(tmp_path):
    """A cell of Fig. 4(b) beside the panel, which designed codes make known four times as well in variance.

    Information grows with power, and once it is known a panel of 36 elements gives 15 dB more than under random codes.
    """
    shutil.copytree(PIPELINES.parent / "scenes" / "paper_room", tmp_path / "room")
    file = tmp_path / "room" / "scene.toml"
    text = file.read_text()
    for old, new in (("start = [0.5, 0.7, 0.5]", "start = [2.2675, 2.4675, 0.5]"), ("cycles = 600", "cycles = 35")):
        assert old in text
        text = text.replace(old, new)
    file.write_text(text)
    near = ("run.cycles=35", "snr_db=[0.0]", "run.schemes=['optimized', 'random']", "run.design.method='coordinate'")
    settings, cell = settings_of("fig4b", *near)[0]
    found = run_cell({**settings, "scene": str(tmp_path / "room")}, cell.seed)["schemes"]
    panel = {name: scores["landmarks"]["ris"] for name, scores in found.items()}
    over_start = {name: scores["bound_m"] ** 2 - 2.0 * 0.01**2 for name, scores in panel.items()}
    assert over_start["optimized"] < over_start["random"] / 4.0
    # nothing measured tells where the start was: 0.01 m an axis; float64
    assert min(scores["bound_m"] for scores in found.values()) > np.sqrt(2.0) * 0.01 * (1.0 - 1e-6)


def test_the_papers_snr_follows_ours_decibel_by_decibel():
    """The noise alone changes along the axis, so that both definitions differ by one number."""
    own = [(s, c) for s, c in settings_of("fig4b", "run.schemes=['no_ris']") if c.repetition == 0][:3]
    shift = [run_cell(s, c.seed)["paper_snr_db"] - c.point[SNR] for s, c in own]
    np.testing.assert_allclose(shift, shift[0], atol=1e-9)


def test_rivals_exist_with_and_without_the_panel():
    for name in ("bp_slam", "channel_slam"):
        assert SCHEMES[name].panel
        assert not SCHEMES[f"{name}_no_ris"].panel
        assert SCHEMES[name].estimator == SCHEMES[f"{name}_no_ris"].estimator == name


def test_gain_and_difference_of_known_numbers():
    ours, theirs = np.array([0.1, 0.2, 0.3, np.nan]), np.array([0.2, 0.4, 0.6, 0.1])
    assert paired_gain(ours, theirs) == pytest.approx((0.5, 0.5, 0.5))
    root = float(np.sqrt(np.mean([0.01, 0.04, 0.09])))
    assert paired_difference(ours, theirs).value == pytest.approx(root)
    assert paired_gain(ours[2:], theirs[2:]) is None
    assert spread(np.array([np.nan])) is None
    assert spread(ours).value == pytest.approx(root)


def test_paired_seeds_share_their_luck():
    rng = np.random.default_rng(5)
    luck = rng.lognormal(0.0, 0.8, 30)
    good, bad = luck * rng.normal(0.6, 0.02, 30), luck * rng.normal(1.0, 0.02, 30)
    paired = paired_gain(good, bad)
    assert paired.lower < 0.4 < paired.upper or paired.value == pytest.approx(0.4, abs=0.03)
    broken = paired_gain(good, np.roll(bad, 7))
    assert paired.upper - paired.lower < 0.2 * (broken.upper - broken.lower)


def test_from_the_file_to_the_page_and_on_again(tmp_path, monkeypatch, capsys):
    """Two cells in workers of their own; the second call finds them and writes the same page."""
    from rislam_rt.cli import main

    monkeypatch.chdir(tmp_path)
    sets = (*TINY[:3], "repetitions=1", "snr_db=[0.0,30.0]", "run.schemes=['no_ris']")
    words = [word for setting in sets for word in ("--set", setting)]
    command = ["rislam-rt", "run", str(PIPELINES / "fig4b.toml"), "--out", "out", "--jobs", "1", *words]
    monkeypatch.setattr(sys, "argv", command)

    def call():
        with pytest.raises(SystemExit) as left:
            main()
        return left.value.code, capsys.readouterr().err, {f.name: f.read_bytes() for f in Path("out").rglob("*.*")}

    code, _, before = call()
    assert code == 0
    assert set(before) == {"fig4b.md", "fig4b.csv", "fig4b.json", "fig4b.png"}
    content = json.loads(before["fig4b.json"])
    assert [entry["snr_db"] for entry in content["entries"]] == [0.0, 30.0]
    assert len(content["scenes"]["paper_room"]["sha256"]) == 64
    code, err, after = call()
    assert code == 0
    assert "nothing left to do" in err
    assert after == before


def test_claims_from_a_folder(tmp_path, monkeypatch, capsys):
    from rislam_rt.cli import main

    monkeypatch.chdir(tmp_path)
    command = ["rislam-rt", "run", str(PIPELINES / "claims.toml"), "--out", "out"]
    monkeypatch.setattr(sys, "argv", [*command, "--set", f"results={tmp_path}"])
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 2
    assert "run pipelines/fig4b.toml" in capsys.readouterr().err
    monkeypatch.setattr(sys, "argv", command)  # the committed results: Fig. 4(a) at least
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 0
    assert "reproduced: gain of the panel" in capsys.readouterr().out
    assert "# The paper's claims" in Path("out/claims.md").read_text()


@pytest.mark.parametrize(
    "content", ["{}", "[]", '"text"', '{"gains": [{}], "entries": []}', '{"gains": [], "entries": []}', "{"]
)
def test_results_of_another_form_are_one_line(tmp_path, content):
    from rislam_rt.studies.claims import read_results

    (tmp_path / "fig4b.json").write_text(content)
    with pytest.raises(ConfigError, match=r"^results: .*/fig4b\.json .*run pipelines/fig4b\.toml again$"):
        read_results(tmp_path)


def test_rows_of_a_point_stay_together():
    from rislam_rt.sweeps.store import Row

    cells = cells_of("fig4c", "repetitions=3", "sizes=[4,6]")
    groups = group_rows([Row(cell, "missing", "", {}) for cell in cells])
    assert [group.point["size"] for group in groups] == [4, 6]
    assert all(len(group.results) == group.missing == 3 for group in groups)
