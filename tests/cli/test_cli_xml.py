"""Scenes of Sionna RT by command: from its files, to its files, and what a wrong option is told."""

import pytest


def test_there_and_back(run, tmp_path):
    code, out, _ = run("export", "office", "--xml", "theirs")
    assert code == 0
    assert "load_scene(..., merge_shapes=False)" in out
    assert "not in it, but in scene.toml beside it: the panel 'ris'" in out
    code, out, _ = run("new", "mine", "--from", "theirs/scene.xml")
    assert code == 0
    assert "mine: made from 'theirs/scene.xml'" in out
    assert (tmp_path / "mine" / "scene.toml").read_text().count("[[reflector]]") == 12
    assert run("export", "office", "--xml", "theirs")[0] == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--from", "sionna:nosuch"], "give one of box,"),
        (["--from", "sionna:box", "--up", "y"], "--up: an XML scene is in metres"),
        (["--from", "sionna:box", "--within", "a,b"], "--within: 'a,b' received"),
        (["--from", "sionna:box", "--within", "1,2,3"], "give x0,y0,x1,y1"),
        (["--from", "missing.xml"], "missing.xml: no such file"),
        (["--from", "room.glb", "--within", "0,0,1,1"], "only XML scenes are cut"),
    ],
)
def test_a_wrong_option_is_one_line(run, tmp_path, arguments, words):
    code, _, err = run("new", "mine", *arguments)
    assert code == 2
    assert words in err
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
