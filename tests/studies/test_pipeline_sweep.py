"""Sweeps of pipeline files: axes typed by the settings, cells checked before any runs, scores with their failures."""

import csv
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline import load_spec, run_slam
from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.report.studies.sweep import main_axis, scores_figure
from rislam_rt.report.terminal_tables import print_sweep
from rislam_rt.scene import load_scene
from rislam_rt.studies import pipeline_sweep
from rislam_rt.studies.pipeline_sweep import SchemeScore, load_section, run_cell, score_rows, slam_sweep, write_scores
from rislam_rt.sweeps import build_cells, run_sweep
from rislam_rt.sweeps.store import DONE, Row

ROOT = Path(__file__).parents[2]
PIPELINE = ROOT / "pipelines" / "trace_then_slam.toml"
TINY = ("channel=image_source", "cycles=3", "receiver.estimator=bound", "slam.num_samples=20", 'schemes=["random"]')


@pytest.fixture(scope="module")
def swept(tmp_path_factory, cells_here):
    folder = tmp_path_factory.mktemp("sweep")
    sweep = slam_sweep(PIPELINE, TINY, ["radio.reference_snr_db=0,13", "schemes=random,no_ris"], repeat=2)
    with cells_here():
        return folder, run_sweep(sweep, folder).rows


def test_an_axis_takes_the_place_of_what_the_file_says_instead():
    """The file gives the reference SNR; noise as an axis excludes it. From the command line it is a contradiction."""
    axis = ["radio.noise_psd=1e-20,1e-19"]
    sweep = slam_sweep(PIPELINE, TINY, axis)
    assert {cell.settings["radio"]["noise_psd"] for cell in build_cells(sweep)} == {1e-20, 1e-19}
    assert sweep.base["radio"]["reference_snr_db"] is None
    with pytest.raises(ConfigError, match="noise_psd"):
        build_cells(slam_sweep(PIPELINE, [*TINY, "radio.reference_snr_db=10"], axis))


def test_axes_become_what_the_setting_is():
    sweep = slam_sweep(PIPELINE, TINY, ["radio.reference_snr_db=0,10", "schemes=random,no_ris", "cycles=3,4"])
    assert [axis.values for axis in sweep.axes] == [(0.0, 10.0), (["random"], ["no_ris"]), (3, 4)]
    assert isinstance(sweep.axes[0].values[0], float)
    # the same noise everywhere, unless the file says otherwise
    assert len({cell.seed for cell in build_cells(sweep)}) == sweep.repetitions == 5


def test_file_has_a_sweep_of_its_own(tmp_path):
    file = tmp_path / "mine.toml"
    text = PIPELINE.read_text().replace("../scenes/paper_room", str(ROOT / "scenes" / "paper_room"))
    file.write_text(
        text + '\n[sweep]\nrepeat = 3\npaired = ["schemes"]\ntime_limit_s = 60\n'
        '[sweep.axes]\nschemes = [["random"], ["no_ris"]]\n"slam.sigma_a" = [0.01, 0.1]\n'
    )
    load_spec(file)  # `run` takes it as well
    sweep = slam_sweep(file, TINY, ["slam.sigma_a=0.2,0.3,0.4"])
    assert (sweep.repetitions, load_section(file).time_limit_s) == (3, 60.0)
    cells = build_cells(sweep)
    assert len(cells) == 2 * 3 * 3
    assert len({cell.seed for cell in cells}) == 9
    assert slam_sweep(file, TINY, repeat=4).repetitions == 4


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("[sweep]\nrepeet = 3", "sweep.repeet: unknown key; did you mean 'repeat'"),
        ("[sweep]\nrepeat = 0", "sweep.repeat: '0' received"),
        ('[sweep.axes]\n"slam.sigma_a" = []', "no values"),
        ('[sweep]\npaired = ["slam.sigma_a"]', "is no axis"),
    ],
)
def test_bad_section_is_one_line(tmp_path, text, match):
    file = tmp_path / "mine.toml"
    file.write_text(f'name = "mine"\nscene = "{ROOT / "scenes" / "paper_room"}"\n{text}\n')
    with pytest.raises(ConfigError, match=match) as error:
        slam_sweep(file)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "axis",
    ["radio.carier_ghz=1,2", "radio.carrier_ghz=a,b", "schemes=magic", "cycles=3,1000", "seed=1,2", "slam=1,2",
     "radio.carrier_ghz.x=1", "channel=image_source,x", "scene=nowhere,elsewhere", "budget.measure_s=1"],
)  # fmt: skip
def test_a_bad_cell_is_found_before_any_runs(axis, tmp_path):
    from rislam_rt.errors import RislamError

    with pytest.raises(RislamError) as error:
        run_sweep(slam_sweep(PIPELINE, TINY, [axis]), tmp_path / "out")
    assert error.value.exit_code == 2
    assert axis.partition("=")[0].partition(".")[2].partition(".")[0] in str(error.value)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


def test_a_cell_is_the_run_of_its_seed(swept):
    _, rows = swept
    row = next(row for row in rows if row.cell.point == {"radio.reference_snr_db": 13.0, "schemes": ["random"]})
    spec = load_spec(PIPELINE, [*TINY, f"seed={row.cell.seed}"])
    result = run_slam(load_scene(ROOT / "scenes" / "paper_room"), spec, rng=np.random.default_rng(spec.seed))
    score = summarise(result)["schemes"]["random"]
    assert row.result["schemes"]["random"]["rmse_m"] == score["rmse_m"]
    assert row.result["schemes"]["random"]["walls"] == score["walls"]
    # at the start it is the start's own deviation: 0.01 m an axis, of which wall returns take nothing
    assert score["bound_m"] == pytest.approx(np.sqrt(2.0) * 0.01, rel=1e-2)


def test_what_the_clock_says_stays_out_of_the_cells(swept):
    folder, _ = swept
    for file in (folder / "cells").iterdir():
        text = file.read_text()
        assert "seconds" not in text
        assert str(ROOT) not in text
    lines = [json.loads(line) for line in (folder / "timings.jsonl").read_text().splitlines()]
    assert len(lines) == 8
    for line in lines:
        assert line["timing"]["trace_seconds"] > 0.0
        assert all(scheme["seconds"] > 0.0 for scheme in line["timing"]["schemes"].values())


def test_changed_code_of_the_package_is_another_cell(monkeypatch):
    before = build_cells(slam_sweep(PIPELINE, TINY))
    monkeypatch.setattr(pipeline_sweep, "code_digest", lambda: "of another code")
    assert not {cell.ident for cell in before} & {cell.ident for cell in build_cells(slam_sweep(PIPELINE, TINY))}


def test_a_changed_room_is_another_cell(tmp_path):
    room = tmp_path / "room"
    shutil.copytree(ROOT / "scenes" / "paper_room", room)
    before = build_cells(slam_sweep(PIPELINE, TINY, scene=room))
    assert before == build_cells(slam_sweep(PIPELINE, TINY, scene=room))
    file = room / "scene.toml"
    text = file.read_text()
    assert "radius = 0.05" in text
    file.write_text(text.replace("radius = 0.05", "radius = 0.06"))
    after = build_cells(slam_sweep(PIPELINE, TINY, scene=room))
    assert not {cell.ident for cell in before} & {cell.ident for cell in after}
    assert [cell.seed for cell in before] == [cell.seed for cell in after]


def test_rooms_are_an_axis():
    sweep = slam_sweep(PIPELINE, TINY, ["scene=paper_room,two_scatterers"], repeat=1)
    digests = {cell.depends["scene_sha256"] for cell in build_cells(sweep)}
    assert len(digests) == 2


def test_scores_have_every_point_and_scheme(swept, tmp_path):
    _, rows = swept
    scores = score_rows(rows)
    assert [(s.point["radio.reference_snr_db"], s.scheme) for s in scores] == [
        (0.0, "random"), (0.0, "no_ris"), (13.0, "random"), (13.0, "no_ris"),
    ]  # fmt: skip
    for score in scores:
        assert len(score.rmse) == 2
        assert score.failed == score.diverged == score.missing == 0
        assert score.interval[0] <= score.overall <= score.interval[1]
        assert score.overall == pytest.approx(np.sqrt(np.mean(np.square(score.rmse))))
    write_scores(scores, tmp_path)
    assert [entry["rmse_m"] for entry in json.loads((tmp_path / "scores.json").read_text())] == [
        score.overall for score in scores
    ]
    assert (tmp_path / "scores.csv").read_text().count("\n") == 5


def test_failures_and_what_is_missing_are_counted(swept):
    _, rows = swept
    wrecked = [
        row._replace(state="died", result={}) if row.cell.repetition else row._replace(state="missing", result={})
        for row in rows[:4]
    ]
    for score in score_rows([*wrecked, *rows[4:]])[:2]:
        assert (score.failed, score.missing, score.rmse, score.overall, score.interval) == (1, 1, (), None, None)


def test_picture_shows_a_line_for_each_scheme(swept):
    scores = score_rows(swept[1])
    assert main_axis(scores) == "radio.reference_snr_db"
    axis = scores_figure(scores).axes[0]
    assert axis.get_ylabel().endswith("[m]")
    assert axis.get_xlabel() == "radio.reference_snr_db [dB]"
    marks = axis.yaxis.get_major_formatter()
    assert [marks(value, 0) for value in (0.005, 0.02)] == ["0.005", "0.02"], "plain numbers, not 2 x 10^-2"
    assert [container.get_label() for container in axis.containers] == ["random", "no_ris"]
    np.testing.assert_allclose(axis.containers[0].lines[0].get_xydata(), [
        (s.point["radio.reference_snr_db"], s.overall) for s in scores if s.scheme == "random"
    ])  # fmt: skip


def test_a_sweep_counts_what_is_lost_and_keeps_what_was_said(capsys):
    """A start told right, and one told wrong by two metres and two metres a second; the cells in this process."""
    settings = ("channel=image_source", "cycles=10", "depth=1", "receiver.estimator=bound", 'schemes=["no_ris"]')
    sweep = slam_sweep(PIPELINE, settings, ["told.start_scale=1,200"], repeat=1)
    cells = build_cells(sweep)
    rows = [Row(cell, DONE, "", run_cell({**cell.settings, **sweep.local}, cell.seed)) for cell in cells]
    said = [row.result["schemes"]["no_ris"]["outcomes"].get("diverged", 0) > 0 for row in rows]
    assert said == [cell.point["told.start_scale"] == 200.0 for cell in cells]
    scores = score_rows(rows)
    assert [score.diverged for score in scores] == [0, 1]
    print_sweep(scores)
    lines = [line.split("│") for line in capsys.readouterr().out.splitlines() if "no_ris" in line]
    assert [[cell.strip() for cell in line[-3:-1]] for line in lines] == [["1", "0"], ["1", "1"]]


def made_up(scheme, relative, ends):
    """A score of three runs at one point, of which the start's error is 1.8 cm."""
    point = {"radio.reference_snr_db": 0.0, "slam.sigma_a": 0.01}
    return SchemeScore(point, scheme, (0.018, 0.018, 0.018), (0.005, 0.031), 0, 0, 0, relative, ends)


def test_two_methods_that_share_the_error_of_their_start_are_told_apart(tmp_path, capsys):
    scores = [
        made_up("optimized", 0.0021, (0.0012, 0.0034)),
        made_up("mine:my_designer", 0.0093, (0.0081, 0.0102)),
        made_up("my_package.filters:DeadReckoning", None, None),
    ]
    write_scores(scores, tmp_path)
    with (tmp_path / "scores.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["relative_rmse_m"] for row in rows] == ["0.0021", "0.0093", ""]
    assert [row["relative_high_m"] for row in rows] == ["0.0034", "0.0102", ""]
    print_sweep(scores)
    table = capsys.readouterr().out
    for words in ("my_package.filters:DeadReckoning", "reference_snr_db", "1.8 cm", "(0.5-3.1)", "2.1 mm", "(1.2-3.4)"):
        assert words in table
    assert "…" not in table
    axes = scores_figure(scores).axes
    labels = [axis.get_ylabel() for axis in axes]
    assert labels == ["RMSE of the agent's position [m]", "RMSE relative to its start [m]"]
    drawn = [container.lines[0].get_ydata().tolist() for container in axes[1].containers]
    assert drawn[:2] == [[0.0021], [0.0093]]
    assert np.isnan(drawn[2]).all()


def test_axes_that_end_in_the_same_word_have_a_column_each(capsys):
    point = {"start.position_std_m": 0.25, "hardware.position_std_m": 0.0625, "slam.sigma_a": 0.01}
    print_sweep([made_up("random", None, None)._replace(point=point)])
    table = capsys.readouterr().out
    for words in ("start.position_std_m", "hardware.position_std_m", "0.25", "0.0625", " sigma_a"):
        assert words in table


@pytest.mark.parametrize("width", [60, 80])
def test_a_terminal_without_room_breaks_names_and_drops_none(width, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setenv("FORCE_COLOR", "1")
    print_sweep([made_up("mine:my_quite_long_designer", 0.0021, (0.0012, 0.0034))])
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line) for line in capsys.readouterr().out.splitlines()]
    assert max(map(len, lines)) <= width
    assert "…" not in "".join(lines)
    name = "".join(line.split("│")[3].strip() for line in lines if "│" in line)
    assert name == "mine:my_quite_long_designer"


def test_more_repetitions_and_values_are_added_to_those_that_ran():
    few = build_cells(slam_sweep(PIPELINE, TINY, ["slam.sigma_a=0.1,0.2", "cycles=3,4"], repeat=1))
    many = build_cells(slam_sweep(PIPELINE, TINY, ["slam.sigma_a=0.05,0.1,0.2", "cycles=2,3,4"], repeat=2))
    assert (len(few), len(many)) == (4, 18)
    assert {cell.ident for cell in few} < {cell.ident for cell in many}
