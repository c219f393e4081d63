"""Help, loudness, and several faults at once."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def commands():
    from typer.main import get_command

    from rislam_rt.cli.app import app

    return get_command(app).commands


@pytest.mark.parametrize("name", sorted(commands()))
def test_every_help_has_examples_of_options_that_are_there(name):
    command = commands()[name]
    examples = re.findall(r"Example: (rislam-rt [^\n]+)", command.help)
    assert examples, name
    known = {option for one in command.params for option in (*one.opts, *one.secondary_opts)}
    assert {"-q", "-v"} <= known
    for example in examples:
        words = shlex.split(example)
        assert words[1] == name
        assert {word for word in words if word.startswith("--")} <= known


@pytest.mark.parametrize("name", sorted(commands()))
def test_no_help_loses_a_unit_in_brackets(name):
    """Words in square brackets are marks of colour to the help that is shown, and are left out of it."""
    texts = [commands()[name].help, *(getattr(one, "help", None) or "" for one in commands()[name].params)]
    assert [text for text in texts if re.search(r"\[[a-zA-Z/]", text)] == []


def test_wrong_usage_leads_to_the_help_of_the_command(run):
    assert run("trace", "paper_room", "more")[2].endswith("; see rislam-rt trace --help\n")
    assert run("nonsense")[2].endswith("; see rislam-rt --help\n")


def test_several_faults_are_several_lines(run, tmp_path):
    (tmp_path / "mine.toml").write_text('name = "a"\nscheems = ["random"]\n[radio]\ncarier_ghz = 10\nnum_samples = 9\n')
    code, _, err = run("run", "mine.toml", "--scene", ROOT / "scenes" / "paper_room", "--set", "depth=-1")
    lines = err.splitlines()
    assert code == 2
    assert len(lines) == 4
    assert all(line.startswith("error: ") for line in lines)
    told = " ".join(lines)
    for place, meant in (("scheems", "schemes"), ("radio.carier_ghz", "carrier_ghz"), ("radio.num_samples", "slam.")):
        assert f"mine.toml: {place}: unknown key; did you mean '{meant}" in told
    assert "error: --set: depth: " in told
    code, _, err = run("config", "--set", "slamm.sigma_a.x=1")
    assert (code, len(err.splitlines())) == (2, 1)
    assert err.startswith("error: --set: slamm: unknown key")


def test_a_study_that_does_not_say_its_kind_is_told_which_it_may_be(run, tmp_path):
    text = (ROOT / "pipelines" / "fig4b.toml").read_text()
    assert '\nkind = "fig4b"\n' in text
    (tmp_path / "mine.toml").write_text(text.replace('\nkind = "fig4b"\n', "\n"))
    code, _, err = run("run", "mine.toml")
    assert (code, err) == (2, "error: mine.toml: kind: missing; with these keys, give 'fig4b'\n")


def test_a_line_ends_where_a_screen_does_and_still_says_how_to_mend_it(run):
    code, _, err = run("config", "--set", f"receiver.estimator={'x' * 5000}")
    assert (code, len(err.splitlines())) == (2, 1)
    assert len(err) < 1100
    assert err.startswith("error: --set: receiver.estimator: 'xxx")
    assert err.endswith("received; give 'bound' or 'waveform'\n")


def test_several_faults_of_a_scene_are_several_lines(run, tmp_path):
    import shutil

    shutil.copytree(ROOT / "scenes" / "paper_room", tmp_path / "room")
    file = tmp_path / "room" / "scene.toml"
    text = file.read_text()
    file.write_text(text.replace("radius = 0.05", "radius = -0.05").replace("rows = 6", "rows = 0"))
    for words in (("trace", "room"), ("run", "--scene", "room")):
        code, out, err = run(*words)
        assert (code, out) == (2, "")
        fields = [line.partition("scene.toml: ")[2].partition(":")[0] for line in err.splitlines()]
        assert fields == ["scatterer[0].radius", "ris.rows"]
        assert [path.name for path in tmp_path.iterdir()] == ["room"]
    assert run("check", "room")[0] == 2


def test_quiet_and_verbose(run):
    words = ("trace", ROOT / "scenes" / "paper_room", "--channel", "image_source", "--depth", 1, "--cycles", 2)
    _, out, err = run(*words)
    assert "warning: " in err
    code, quiet, err = run(*words, "-q")
    assert (code, err) == (0, "")
    assert quiet.splitlines()[2:] == out.splitlines()[2:]
    code, _, err = run(*words, "-v")
    assert code == 0
    assert "numpy " in err
    assert "processor time" in err
    code, _, err = run("trace", "nowhere", "-v")
    assert code == 2
    code, _, err = run("run", "--set", "depth=-1", "-v")
    assert code == 2
    assert "Traceback" in err
    assert err.splitlines()[-1].startswith("error: ")


def test_as_a_module(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "rislam_rt", "--version"], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    assert re.fullmatch(r"\d+\.\d+\.\d+\n", done.stdout)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("compare", "paper_room", "--poses", "0"), "'--poses': give at least 1; see rislam-rt compare --help"),
        (("compare", "paper_room", "--poses", "ten"), "'--poses': give a valid integer; see"),
        (
            ("new", "x", "--from", "a.ply", "--units", "ell"),
            "'--units': 'ell' is not one of 'mm', 'cm', 'm', 'in'; see",
        ),
    ],
)
def test_wrong_usage_is_said_in_plain_words(run, arguments, says):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert says in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("config", "--set", 'schemes=["no_ris","no_ris"]'), "--set: schemes: each at most once; leave"),
        (("config", "--set", f"seed={10**23}"), "give a whole number that 64 bits hold"),
        (("config", "--set", "radio.carrier_ghz=nan"), "received; give a finite number"),
        (("new", "x", "--floorplan", "0,0 4,0 4,3", "--rest", "itu:cheese"), "error: --rest: 'cheese' is no ITU"),
        (("new", "x", "--from", ""), "error: .: is a folder; give a file: .glb"),
        (("run", "trace_then_slam", "--set", "cycles=2", "--out", "/proc/x"), "error: --out /proc/x: cannot be"),
    ],
)
def test_a_line_names_what_was_typed(run, words, said):
    code, _, err = run(*words)
    assert code in (2, 4)
    assert said in err
