"""`--set radio.*` of the commands that know no more of a pipeline than its radio."""

import json

import pytest


@pytest.fixture
def answer(run, tmp_path):
    """Run a command; returns exit code, error stream and what `--json` wrote."""

    def _answer(*arguments):
        code, _, said = run(*arguments, "--json", "found.json")
        file = tmp_path / "found.json"
        return code, said, json.loads(file.read_text()) if file.exists() else None

    return _answer


@pytest.mark.parametrize(
    "command",
    [
        ("trace", "paper_room", "--channel", "image_source", "--stride", "300", "--depth", "1"),
        ("design", "paper_room", "--at", "1.5,1.5,0", "--depth", "1"),
        ("compare", "paper_room", "--poses", "2", "--depth", "1"),
    ],
)
def test_a_command_hears_through_the_antennas_that_it_is_given(answer, command):
    found = [answer(*command, *more)[2] for more in ((), ("--set", "radio.tx_pattern=hw_dipole"))]
    for one in found:
        one.pop("seconds", None)
        one.get("methods", {}).clear()  # times of the designers are never alike
    assert found[0] != found[1]
    assert {one.get("verdict", {}).get("passed", True) for one in found} == {True}


@pytest.mark.parametrize(
    "command", [("trace", "paper_room"), ("design", "paper_room", "--at", "1,1,0"), ("compare", "paper_room")]
)
def test_an_unknown_pattern_is_one_line_and_nothing_is_written(answer, command):
    code, said, found = answer(*command, "--set", "radio.tx_pattern=yagi")
    assert (code, found) == (2, None)
    assert said.count("\n") == 1
    assert "radio.tx_pattern: 'yagi' received" in said
