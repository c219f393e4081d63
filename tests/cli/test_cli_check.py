"""`rislam-rt check` as an adviser: what it says, writes and refuses."""

import json

import pytest


@pytest.fixture
def check(run):
    return lambda *arguments: run("check", *arguments)


def test_a_panel_that_cannot_be_heard_is_said_so_with_the_mend(check, tmp_path):
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
