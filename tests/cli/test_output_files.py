"""A command replaces the files that the program made, and no others unless it is told to."""

import json
import os
from pathlib import Path

import pytest

from rislam_rt.storage.files import is_own, write_atomic

ROOT = Path(__file__).parents[2]

VIEW = ("show", "empty_box", "-q", "--depth", 0)


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (("config", "--explain", "slam.sigma_a"), "--json found.json"),
        (VIEW, "--html room.html"),
        (VIEW, "--out room.png"),
        pytest.param(VIEW, "--out room.svg", marks=pytest.mark.slow),
        pytest.param(VIEW, "--out room.pdf", marks=pytest.mark.slow),
        (("trace", "empty_box", "--channel", "image_source", "--cycles", 1), "--out paths.nc"),
    ],
)
def test_a_file_of_the_users_stays_unless_told_otherwise(run, tmp_path, words, name, undrawn):
    option, _, file = name.partition(" ")
    theirs = tmp_path / file
    theirs.write_text("notes on rislam_rt, of my own")
    code, out, err = run(*words, option, file)
    assert code == 2
    assert not out
    assert (
        err == f"error: {name}: is there already, and not of this program's making; give another name, or --overwrite\n"
    )
    assert theirs.read_text() == "notes on rislam_rt, of my own"
    assert run(*words, option, file, "--overwrite")[0] == 0
    assert run(*words, option, file)[0] == 0  # now it is the program's own
    assert theirs.stat().st_size > 100


def test_a_name_that_the_command_chose_is_looked_at_too(run, tmp_path):
    (tmp_path / "empty_box.png").write_text("mine")
    code, _, err = run("show", "empty_box")
    assert code == 2
    assert err.startswith("error: empty_box.png: is there already")
    (tmp_path / "empty_box-signals.nc").write_text("mine")
    code, _, err = run("trace", "empty_box", "--channel", "image_source", "--signals", "--cycles", 1)
    assert code == 2
    assert err.startswith("error: empty_box-signals.nc: is there already")
    assert {path.read_text() for path in tmp_path.iterdir()} == {"mine"}


def test_what_loses_nothing_is_free(tmp_path):
    assert is_own(tmp_path / "none")
    assert is_own(tmp_path)  # the disk refuses a folder by itself
    write_atomic(tmp_path / "empty", b"")
    assert is_own(tmp_path / "empty")
    for content, own in ((b"RRF2\0\0rislam_rt", True), (b"RRF2\0\0other", False), (b"rislam_rt", False)):
        write_atomic(tmp_path / "run.rrd", content)
        assert is_own(tmp_path / "run.rrd") is own


@pytest.mark.parametrize(
    ("pipeline", "file", "more"),
    [
        ("fig4a", "fig4a.csv", ()),
        ("fig4b", "fig4b.md", ()),
        ("compare_channels", "figures/path_certificate.png", ("--set", "rooms=[{scene='empty_box', picture=true}]")),
        ("unseen", "unseen.json", ()),
        ("train_classifier", "weights.npz", ()),
    ],
)
def test_a_studys_page_takes_no_others_place(run, tmp_path, pipeline, file, more):
    theirs = tmp_path / "results" / file
    theirs.parent.mkdir(parents=True)
    theirs.write_text("mine")
    code, out, err = run("run", ROOT / f"pipelines/{pipeline}.toml", *more, "--out", "results")
    assert code == 2
    assert not out
    assert err == (
        f"error: --out results: results/{file} is there already, and not of this program's making; give another "
        "folder, or --overwrite\n"
    )
    assert [path.read_text() for path in tmp_path.rglob("*") if path.is_file()] == ["mine"]  # nothing was begun


def test_a_studys_own_page_is_written_anew(run, tmp_path):
    words = ("run", ROOT / "pipelines/claims.toml", "--set", f"results={ROOT}/docs/results", "--out", ".")
    (tmp_path / "claims.csv").write_text("mine")
    assert run(*words)[0] == 2
    assert (tmp_path / "claims.csv").read_text() == "mine"
    assert run(*words, "--overwrite")[0] == 0
    made = (tmp_path / "claims.csv").read_text()
    assert made != "mine"
    assert run(*words)[0] == 0  # now it is the program's own
    assert (tmp_path / "claims.csv").read_text() == made


def test_every_page_that_is_there_is_known_as_the_programs(run, tmp_path):
    from rislam_rt.cli.output_files import study_folder

    pages = sorted((ROOT / "docs/results").glob("*.md"))
    assert len(pages) > 10
    for page in pages:
        assert study_folder(page.parent, "", {}, [page.name]) == page.parent


@pytest.fixture
def shut(tmp_path, monkeypatch):
    """A folder that nobody may write to, whoever runs the tests."""
    folder = tmp_path / "shut"
    folder.mkdir()
    refuse(monkeypatch, folder)
    return folder


def refuse(monkeypatch, folder):
    may = os.access

    def access(path, mode, **options):
        return not (mode & os.W_OK and Path(path).absolute() == folder) and may(path, mode, **options)

    monkeypatch.setattr(os, "access", access)


@pytest.mark.parametrize(
    "words",
    [
        ("run", ROOT / "pipelines/fig4a.toml", "--out", "shut/new/results"),
        ("run", ROOT / "pipelines/claims.toml", "--out", "shut"),
        ("run", ROOT / "pipelines/train_classifier.toml", "--out", "shut"),
        ("trace", "empty_box", "--channel", "image_source", "--out", "shut/paths.nc"),
        ("config", "--json", "shut/config.json"),
        ("slam", "mine.csv", "--start", "0,0,1", "--tx", "0,0,0", "--rx", "0.1,0,0", "--out", "shut/found"),
    ],
)
def test_a_folder_that_refuses_is_known_before_anything_is_worked_out(run, tmp_path, shut, words):
    (tmp_path / "mine.csv").write_text("time_s,heading_rad,delay_s,cos_x,cos_y,amplitude\n0,0,1e-8,0.1,0.1,0.01\n")
    code, out, err = run(*words)
    assert (code, out) == (4, "")
    assert "cannot be written (Permission denied); check permissions and free space" in err
    assert len(err.splitlines()) == 1
    assert not list(shut.iterdir())


def test_a_folder_in_a_files_place_is_known_before_anything_is_worked_out(run, tmp_path):
    (tmp_path / "mine").mkdir()
    code, out, err = run("trace", "empty_box", "--channel", "image_source", "--out", "mine")
    assert (code, out, err) == (2, "", "error: --out mine: is a folder; give the name of a file\n")


def test_a_new_room_takes_no_place_of_what_another_made(run, tmp_path):
    (tmp_path / "file").write_text("mine")
    for words in (("new", "file", "--overwrite"), ("new", "file/below")):
        assert run(*words) == (2, "", "error: file: is not a folder; give another\n")
    (tmp_path / "project").mkdir()
    (tmp_path / "project" / "README.md").write_text("mine")
    code, out, err = run("new", "project", "--overwrite")
    assert (code, out) == (2, "")
    assert err.startswith("error: project: 'README.md' there is not of this program's making")
    assert [path.name for path in (tmp_path / "project").iterdir()] == ["README.md"]
    for words in (("--seed", 7), ("--seed", 8), ("--floorplan", "0,0 4,0 4,3 0,3")):
        assert run("new", "mine", *words, "--overwrite")[0] == 0
        edited = tmp_path / "mine" / "scene.toml"
        edited.write_text(edited.read_text() + "# a remark\n")


def test_an_origin_may_be_one_of_a_map_and_a_name_no_text(run, tmp_path):
    name = os.fsdecode(b"B\xfcro.geojson")
    corners = [[500_000 + x, 5_400_000 + y] for x, y in ((0, 0), (5, 0), (5, 4), (0, 4), (0, 0))]
    (tmp_path / name).write_text(json.dumps({"type": "Polygon", "coordinates": [corners]}))
    code, _, err = run("new", "mine", "--from", name)
    assert (code, err.count("--origin ")) == (2, 1)
    origin = err.split("--origin ")[1].split(", a point")[0]
    code, out, _ = run("new", "mine", "--from", name, "--origin", origin)
    assert code == 0
    assert "mine: made from 'B\\udcfcro.geojson'" in out


def test_a_new_room_over_another_tells_which_files_remain(run, tmp_path):
    assert run("new", "mine", "--template", "two_scatterers")[0] == 0
    code, out, _ = run("new", "mine", "--floorplan", "0,0 4,0 4,3 0,3", "--overwrite")
    assert code == 0
    left = {path.name for path in (tmp_path / "mine" / "meshes").iterdir()} - {
        line.split('"')[1].removeprefix("meshes/")
        for line in (tmp_path / "mine" / "scene.toml").read_text().splitlines()
        if line.startswith("mesh =")
    }
    assert left
    (line,) = (line for line in out.splitlines() if line.startswith("- of the room before remain, unused: "))
    assert all(f"meshes/{name}" in line for name in left)
    code, out, err = run("new", "mine", "--floorplan", "0,0 4,0 4,3 0,3", "--overwrite")
    assert (code, err) == (0, "")  # over an import of its own
    assert "remain" not in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("trace", "empty_box", "--out", "x.csv"), "--out x.csv: not of that ending; give a name that ends in .nc"),
        (("show", "empty_box", "--html", "x.png"), "--html x.png: not of that ending; give a name that ends in .html"),
    ],
)
def test_a_file_is_not_written_under_the_ending_of_another_format(run, tmp_path, words, said):
    code, _, err = run(*words)
    assert code == 2
    assert said in err
    assert not list(tmp_path.iterdir())


def test_a_link_stays_a_link(run, tmp_path):
    words = ("config", "--explain", "slam.sigma_a", "--json")
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to("there/found.json")
    assert run(*words, "link")[0] == 0
    assert run(*words, "link")[0] == 0
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "there" / "found.json").stat().st_size
    (tmp_path / "loop").symlink_to("loop")
    code, out, err = run(*words, "loop")
    assert (code, out) == (4, "")
    assert err.startswith("error: loop: cannot be written (Too many levels of symbolic links)")
    assert (tmp_path / "loop").is_symlink()


def test_a_device_is_written_to_wherever_it_lies(run, monkeypatch):
    refuse(monkeypatch, Path("/dev"))
    assert run("config", "--explain", "slam.sigma_a", "--json", "/dev/null")[0] == 0


LONG = "x" * 300


@pytest.mark.parametrize(
    "words",
    [
        ("check", LONG),
        ("run", LONG),
        ("run", "--scene", LONG),
        ("show", "empty_box", "--out", f"{LONG}.png"),
        ("trace", "empty_box", "--out", LONG),
        ("report", LONG),
        ("config", "--json", LONG),
        ("run", "claims", "--out", LONG),
    ],
)
def test_a_name_that_the_disk_does_not_take_is_one_line(run, words):
    code, out, err = run(*words)
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert "(File name too long)" in err
    assert len(err.splitlines()) == 1


def test_output_that_finds_no_room_is_one_line(run, monkeypatch):
    import errno

    import typer

    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(typer, "echo", full)
    code, _, err = run("config")
    assert code == 4
    assert (
        err == "error: output: cannot be written (No space left on device); check where it goes, and the free space\n"
    )


def test_a_link_that_leads_to_itself_takes_no_room(run, tmp_path):
    (tmp_path / "loop").symlink_to("loop")
    for words in (
        ("new", "loop"),
        ("slam", "mine.csv", "--start", "0,0,1", "--tx", "0,0,0", "--rx", "1,0,0", "--out", "loop"),
    ):
        (tmp_path / "mine.csv").write_text("time_s,heading_rad,delay_s,cos_x,cos_y,amplitude\n0,0,1e-8,0,0,0.01\n")
        code, _, err = run(*words)
        assert code == 4
        assert err.startswith("error: loop: cannot be written (")
        assert (tmp_path / "loop").is_symlink()
