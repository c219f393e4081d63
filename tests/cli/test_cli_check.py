"""`rislam-rt check` as an adviser: what it says, writes and refuses."""

import json
import re
import shutil
from functools import partial
from pathlib import Path

import pytest

from rislam_rt.adviser import forecast_codes, link_budget

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.fixture
def check(run, monkeypatch):
    """The command; it looks at one place of the way instead of fifteen, and reckons with two random codes."""
    monkeypatch.setattr(link_budget, "survey", partial(link_budget.survey, places=1))
    monkeypatch.setattr(forecast_codes, "RANDOM_CODES", 2)
    return lambda *arguments: run("check", *arguments)


def test_a_panel_that_cannot_be_heard_is_said_so_with_the_mend(check, tmp_path, monkeypatch):
    monkeypatch.setattr(link_budget, "survey", partial(link_budget.survey, places=3))  # the columns of its table
    arguments = ("paper_room", "--set", "radio.reference_snr_db=-12", "--json", "c.json", "--picture", "map.png")
    code, out, _ = check(*arguments)
    assert code == 0
    line = next(line for line in out.splitlines() if line.startswith("ris: "))
    assert "dB lack where it is too weak" in line
    assert "or a panel of" in line
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    advice = json.loads((tmp_path / "c.json").read_text())["advice"]
    assert {(link["landmark"], link["code"]) for link in advice["links"]} == {
        ("sphere", ""), ("ris", "aimed"), ("ris", "swept"), ("ris", "random"),
    }  # fmt: skip
    assert advice["links"][1]["start"]["margin_db"] < 0.0
    assert line in advice["remedies"]
    assert [cost["depth"] for cost in advice["costs"]] == [1, 2, 3]


def test_the_pipelines_radio_counts_and_a_wrong_setting_is_one_line(check):
    assert "threshold of 10.0 dB" in check("empty_box", "--pipeline", "demo")[1] + check("paper_room")[1]
    code, out, err = check("paper_room", "--set", "radio.reference_snr=3")
    assert code == 2
    assert not out
    assert "reference_snr_db" in err
    assert len(err.splitlines()) == 1
    code, _, err = check("paper_room", "--picture", "map.doc")
    assert code == 2
    assert "map.doc" in err


def test_only_the_part_of_the_way_is_looked_at_that_the_run_goes(check, tmp_path, monkeypatch):
    """The paper's sphere is too weak at the end of its way, and loud after 60 cycles."""
    monkeypatch.setattr(link_budget, "survey", partial(link_budget.survey, places=2))
    ends = []
    for more in ((), ("--set", "cycles=60")):
        check("paper_room", "--json", "c.json", *more)
        ends.append(json.loads((tmp_path / "c.json").read_text())["advice"]["links"][0]["end"]["margin_db"])
    assert ends[0] < 0.0 < ends[1]
    code, out, _ = check("paper_room", "--set", "cycles=6000")
    assert code == 2
    assert "error: --set: cycles: 6000 received; the scene has 600, give no more" in out


def test_an_array_that_tells_no_direction_is_said_before_it_runs(check):
    _, out, _ = check("empty_box", "--set", "radio.array.rows=1", "--set", "radio.array.spacing_wavelengths=1")
    assert "warning: --set: radio.array.rows: 1 x 4 antennas in a line tell no cosine along the body's x" in out
    assert "warning: --set: radio.array.spacing_wavelengths: antennas 1 wavelengths apart" in out
    _, out, _ = check("empty_box", "--set", "radio.array.rows=1", "--set", 'schemes=["bp_slam_no_ris"]')
    assert "radio.array" not in out, "it uses no directions"


@pytest.mark.parametrize(("rows", "said"), [(1, "1 cycle, 0.1 s"), (2, "2 cycles, 0.2 s"), (20, "")])
def test_a_motion_too_short_to_locate_anything_is_said_before_it_runs(check, tmp_path, rows, said):
    room = tmp_path / "room"
    shutil.copytree(SCENES / "paper_room", room)
    scene = (room / "scene.toml").read_text()
    (room / "scene.toml").write_text(scene[: scene.index("[agent]")] + '[agent]\ntrajectory = "way.csv"\n')
    lines = [f"{0.1 * row:.1f},{3.0 + 0.01 * row:.2f},3.0,0.5" for row in range(rows)]
    (room / "way.csv").write_text("\n".join(["time,x,y,z", *lines, ""]))
    told = [line for line in check(room)[1].splitlines() if "a motion of" in line]
    assert len(told) == bool(said)
    assert all(f"warning: {room / 'scene.toml'}: agent: a motion of {said}: " in line for line in told)


def test_a_scene_without_a_panel_has_no_map(check, tmp_path):
    code, out, _ = check("empty_box", "--picture", "map.png")
    assert code == 0
    assert "picture: none: the scene has no panel" in out
    assert not (tmp_path / "map.png").exists()


def test_an_agent_faster_than_the_receiver_is_told_so_before_it_runs(check, tmp_path):
    assert check("paper_room", "--set", "receiver.top_speed=0.1", "--json", "c.json")[1].count("warning: ") == 1
    code, out, _ = check("paper_room", "--set", "receiver.top_speed=0.09", "--json", "c.json")
    assert code == 0
    line = next(line for line in out.splitlines() if "top_speed" in line)
    assert "scene.toml: receiver.top_speed: 0.09 m/s, and the agent moves at up to 0.1 m/s (cycle 0)" in line
    assert out.endswith("paper_room: 0 errors, 2 warnings\n")
    assert "receiver.top_speed" in [one["field"] for one in json.loads((tmp_path / "c.json").read_text())["findings"]]


def test_what_keeps_a_pipeline_from_running_in_a_room_is_an_error_in_the_words_of_the_run(check, run, tmp_path):
    mine, named = tmp_path / "mine.toml", 'schemes = ["optimized"]'
    mine.write_text(f'name = "mine"\n{named}\n')
    code, out, _ = check("empty_box", "--pipeline", mine, "--json", "c.json")
    told = "schemes: 'optimized' needs a panel and scene 'empty_box' has none; give 'no_ris'"
    assert run("run", mine, "--scene", "empty_box", "--no-report")[::2] == (2, f"error: {told}\n")
    assert code == 2
    assert f"error: {mine}: {told}\n" in out
    assert out.endswith("empty_box: 1 error, 0 warnings\n")
    found = json.loads((tmp_path / "c.json").read_text())
    assert (found["errors"], found["findings"][0]["field"]) == (1, "schemes")
    assert "advice" in found
    assert f"error: --set: {told}\n" in check("empty_box", "--set", 'schemes=["optimized"]')[1]
    mine.write_text(f'name = "mine"\n{named}\n[budget]\nmeasure_s = 0.05\n')
    assert "mine.toml: budget: the four steps sum to 0.14 s; make them" in check("paper_room", "--pipeline", mine)[1]
    room = tmp_path / "levels"
    shutil.copytree(SCENES / "paper_room", room)
    scene = room / "scene.toml"
    scene.write_text(re.sub(r"(?m)^levels = .*$", "levels = 3", scene.read_text()))
    assert f"error: {scene}: ris.levels: 3 received" in check(room, "--pipeline", "trace_then_slam")[1]


@pytest.mark.parametrize("words", [(), ("--pipeline", "trace_then_slam")])
def test_a_cycle_that_the_budget_does_not_sum_to_is_refused_as_by_the_run(check, run, tmp_path, words):
    """With settings that mend it, and no file of the package as what is to be edited."""
    room = tmp_path / "room"
    shutil.copytree(SCENES / "paper_room", room)
    scene = room / "scene.toml"
    scene.write_text(re.sub(r"(?m)^cycle_s = .*$", "cycle_s = 0.05", scene.read_text()))
    told = run("run", "trace_then_slam", "--scene", room, "--no-report")[2].removeprefix("error: ")
    code, out, _ = check(room, *words)
    assert code == 2
    assert f"error: pipeline 'trace_then_slam': {told}" in out  # nobody gave --set
    assert f"error: --set: {told[:30]}" in check(room, *words, "--set", "budget.optimise_s=0.05")[1]
    assert "the four steps sum to 0.1 s; make them the scene's cycle of 0.05 s (--set budget.optimise_s=0.025 " in out
    mend = re.search(r"\((--set .*)\)", told).group(1).split()
    assert check(room, *words, *mend)[0] == 0


@pytest.mark.parametrize("words", [(), ("--pipeline", "trace_then_slam"), ("--set", "radio.reference_snr_db=3")])
def test_a_room_without_a_panel_stands_where_nobody_named_schemes(check, words):
    """A run leaves out the schemes of a built-in pipeline that need a panel, so that nothing is wrong."""
    code, out, _ = check("empty_box", *words)
    assert code == 0
    assert out.endswith("empty_box: 0 errors, 0 warnings\n")
