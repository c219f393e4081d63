"""Every command on good and on bad input: exit codes, one line for each failure, nothing written."""

import json
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.adviser import link_budget
from rislam_rt.storage.files import is_own

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "scenes" / "paper_room"
PIPELINE = ROOT / "pipelines" / "trace_then_slam.toml"
SHORT = ("--set", "channel=image_source", "--set", "depth=1", "--set", "cycles=4", "--set", "receiver.estimator=bound",
         "--set", "design.iterations=5")  # fmt: skip


def test_new_room_from_corners(run):
    code, out, _ = run("new", "mine", "--floorplan", "0,0 4,0 4,3 0,3", "--height", "2.5", "--rest", "itu:brick")
    assert code == 0
    assert "brick" in out
    assert Path("mine/scene.toml").is_file()


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["compare"],
        ["compare", SCENE, "--poses", "0"],
        ["run", PIPELINE, "--colour"],
        ["trace", SCENE, "--channel", "magic"],
        ["trace", SCENE, "--deepmimo", "Upper"],
        ["trace", SCENE, "--deepmimo", ROOT / "docs"],
        ["design", SCENE],
        ["design", SCENE, "--at", "1,2"],
        ["design", SCENE, "--at", "1,2,nan"],
        ["design", SCENE, "--at", "1,2,30"],
        ["design", SCENE, "--at", "3,3,3"],
        ["design", SCENE, "--at", "1,1,3"],
        ["run", "nowhere.toml"],
        ["run", PIPELINE, "--scene", "nowhere"],
        ["run", PIPELINE, "--scene", SCENE, "--set", "scene=office"],
        ["sweep", PIPELINE, "--scene", SCENE, "--set", "scene=office"],
        ["run", PIPELINE, "--set", "radio.carier_ghz=1"],
        ["run", PIPELINE, "--set", "cycles=1000"],
        ["run", PIPELINE, "--set", "budget.measure_s=1"],
        ["run", PIPELINE, "--out", ROOT / "docs"],
        ["check", "nowhere"],
        ["show", "nowhere"],
        ["show", SCENE, "--out", "room.doc"],
        ["new", "room", "--template", "palace"],
        ["new", ROOT / "docs"],
        ["new", "room", "--from", "missing.glb"],
        ["new", "room", "--from", ROOT / "README.md"],
        ["new", "room", "--from", "missing.glb", "--origin", "1,2"],
        ["new", "room", "--from", "missing.glb", "--material", "floor=cheese"],
        ["new", "room", "--from", "missing.glb", "--material", "floor=itu:concreet"],
        ["new", "room", "--from", "missing.glb", "--floorplan", "0,0 4,0 4,3"],
        ["new", "room", "--floorplan", "0,0 4,0"],
        ["new", "room", "--floorplan", "0,0 4,0 4,3 0,3", "--seed", "3"],
        ["new", "room", "--seed", "3", "--template", "office"],
        ["new", "room", "--units", "mm"],
        ["new", ROOT / "docs", "--floorplan", "0,0 4,0 4,3 0,3"],
        ["report", ROOT / "docs"],
    ],
    ids=lambda words: " ".join(str(word) for word in words).replace(str(ROOT), ""),
)
def test_bad_input_is_one_line_and_exit_2(run, arguments, tmp_path):
    code, _, err = run(*arguments)
    lines = [line for line in err.splitlines() if not line.startswith("warning: ")]
    assert code == 2
    assert len(lines) <= 1
    assert ".;" not in err
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


def test_unwritable_file_is_exit_4(run):
    code, _, err = run("check", ROOT / "scenes" / "empty_box", "--json", "/proc/none/check.json")
    assert code == 4
    assert "/proc/none/check.json" in err


def test_a_trace_is_written_for_deepmimo(run, tmp_path):
    words = ("trace", SCENE, "--channel", "image_source", "--depth", 1, "--stride", 300, "--deepmimo", "s/room")
    assert run(*words)[0] == 0
    assert sorted(path.name for path in (tmp_path / "s" / "room").iterdir()) == [
        "params.json", "scene_00000", "scene_00001",
    ]  # fmt: skip
    assert run(*words)[0] == 2


def test_a_room_without_a_panel_runs_without_the_default_schemes_that_need_one(run, tmp_path):
    """But not where the user named them, on the command line or in a file."""
    room, named = ("--scene", ROOT / "scenes" / "empty_box", "--no-report"), 'schemes=["random"]'
    code, out, _ = run("run", PIPELINE, *SHORT, *room, "--json", "run.json")
    assert code == 0
    assert out.startswith("scene 'empty_box' has no panel, which optimized, random need: no_ris alone\n")
    assert list(json.loads((tmp_path / "run.json").read_text())["schemes"]) == ["no_ris"]
    assert "complete already" in run("run", PIPELINE, *SHORT, *room)[1]
    code, _, err = run("run", PIPELINE, *SHORT, *room, "--set", named)
    assert code == 2
    assert "schemes: 'random' needs a panel" in err
    (tmp_path / "mine.toml").write_text(f'name = "mine"\n{named}\n')
    assert run("run", "mine.toml", *SHORT, *room)[0] == 2


def test_a_panels_delay_spread_is_warned_of_once(run):
    """By the run, of the motion that it drew; not by the check of the scene as well. Without a panel by nobody."""
    wide = ("--set", "radio.bandwidth_ghz=5", "--set", 'schemes=["random", "no_ris"]', "--no-report", "--jobs", 1)
    words = "delays over the panel spread by up to"
    code, _, err = run("run", PIPELINE, *SHORT, *wide, "--set", "cycles=2")
    assert code == 0
    assert err.count(words) == 1
    assert words not in run("run", PIPELINE, *SHORT, *wide, "--set", "cycles=2", "--set", 'schemes=["no_ris"]')[2]


def test_run_report_and_json(run, tmp_path, monkeypatch, undrawn):
    one = ("--set", 'schemes=["random"]')
    code, out, _ = run("run", PIPELINE, *SHORT, *one, "--json", "run.json", "--out", "mine")
    assert code == 0
    assert "agent" in out
    content = json.loads((tmp_path / "run.json").read_text())
    assert (content["seed"], content["cycles"]) == (7, 4)
    for scheme in content["schemes"].values():
        assert {"rmse_m", "landmarks", "walls", "diverged", "seconds"} <= set(scheme)
        assert (scheme["diverged"], sum(scheme["outcomes"].values())) == (False, 4)
        # the start's own deviation, 0.01 m an axis: nothing measured tells where it was
        assert scheme["bound_m"] == pytest.approx(np.sqrt(2.0) * 0.01, rel=1e-2)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "run.json"]
    page = tmp_path / "mine" / "report.html"
    first = page.read_bytes()
    assert len(list((tmp_path / "mine" / "figures").glob("*.png"))) == 7
    words = ("--config", "mine/config.toml", "--truth", "mine/truth.tum", "--json", "slam.json", "--out", "again")
    assert run("slam", "mine/measurements_random.nc", *words)[0] == 0
    found = json.loads((tmp_path / "slam.json").read_text())
    assert found["rmse_m"] == pytest.approx(content["schemes"]["random"]["rmse_m"], abs=1e-8)  # poses of nine digits
    monkeypatch.setitem(sys.modules, "rerun", None)  # as where the extra is not installed
    code, _, err = run("report", "mine", "--rerun", "mine.rrd")
    assert code == 3
    assert "rislam-rt[viz]" in err
    code, _, err = run("report", "mine", "--gif", "run.mp4")
    assert code == 2
    assert "give a name that ends in .gif" in err
    code, again, _ = run("report", "mine", "--gif", "run.gif")
    assert code == 0
    assert "moving picture: run.gif" in again
    assert (tmp_path / "run.gif").read_bytes().startswith(b"GIF89a")
    assert is_own(tmp_path / "run.gif")
    assert page.read_bytes() == first
    assert [line for line in again.splitlines() if "agent" in line] == [
        line for line in out.splitlines() if "agent" in line
    ]


def test_a_run_is_shown_and_other_settings_make_another_folder(run, tmp_path):
    words = ("run", PIPELINE, *SHORT, "--set", 'schemes=["random"]', "--no-report")
    code, first, _ = run(*words)
    assert code == 0
    (folder,) = (tmp_path / "runs").iterdir()
    assert folder.name.startswith("trace_then_slam-paper_room-7-")
    before = {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in folder.rglob("*.*")}
    code, again, _ = run(*words)
    assert code == 0
    assert again.splitlines()[0] == "this run is complete already; nothing was computed"
    assert again.splitlines()[1:] == first.splitlines()
    assert {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in folder.rglob("*.*")} == before
    # another SNR at the same seed is another run, beside it or, in the same folder, none
    other = ("--set", "radio.reference_snr_db=0")
    assert run(*words, *other)[0] == 0
    assert len(list((tmp_path / "runs").iterdir())) == 2
    code, _, err = run(*words, *other, "--out", folder)
    assert code == 2
    assert "config.radio.reference_snr_db is 13.0 there and 0.0 here" in err
    assert {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in folder.rglob("*.*")} == before


def test_what_config_prints_and_what_a_run_leaves_are_pipelines_that_run(run, tmp_path):
    """From any folder, with the room that the pipeline names, and with the same numbers from the folder of a run."""
    code, out, _ = run("config")
    assert (code, '\nscene = "paper_room"\n' in out) == (0, True)
    (tmp_path / "mine.toml").write_text(out)
    words = (*SHORT, "--set", 'schemes=["random"]', "--no-report")
    assert run("run", "mine.toml", *words, "--out", "first")[0] == 0
    (tmp_path / "first").rename(tmp_path / "moved")
    assert run("run", "moved/config.toml", "--no-report", "--out", "again")[0] == 0
    first, again = (json.loads((tmp_path / name / "summary.json").read_text()) for name in ("moved", "again"))
    assert first["schemes"]["random"]["rmse_m"] == again["schemes"]["random"]["rmse_m"]
    for study in ("compare_channels", "rooms"):
        out = run("config", study)[1]
        assert '"office"' in out
        assert "../scenes" not in out


def test_a_run_touches_nothing_of_the_user(run, tmp_path):
    words = ("run", PIPELINE, *SHORT, "--set", 'schemes=["random"]', "--no-report", "--jobs", 1)
    mine = ("X.partial/notes", "X.old/notes", "runs/notes", ".git-credentials", ".x-y", "Y/run.json", "Y/thesis.tex")
    for name in mine:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(f"{{}} {name}")
    assert run(*words, "--out", "X")[0] == 0
    for place in ("Y", "X.old", "."):
        code, _, err = run(*words, "--out", place)
        assert code == 2
        assert len(err.splitlines()) == 1
    assert all((tmp_path / name).read_text() == f"{{}} {name}" for name in mine)
    assert sorted(path.name for path in (tmp_path / "X.old").iterdir()) == ["notes"]


def test_an_own_room_is_called_after_its_folder(run, tmp_path):
    from rislam_rt.scene import load_scene

    assert run("new", "my room")[0] == 0
    assert load_scene(tmp_path / "my room").name == "my_room"
    assert "rislam_rt.scene.build" not in (tmp_path / "my room" / "README.md").read_text()
    assert run("run", PIPELINE, *SHORT, "--set", 'schemes=["random"]', "--no-report", "--scene", "my room")[0] == 0
    assert [path.name[:26] for path in (tmp_path / "runs").iterdir()] == ["trace_then_slam-my_room-7-"]


def test_a_run_interrupted_at_once_says_that_nothing_was_kept(run, monkeypatch):
    import rislam_rt.pipeline as module

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "run_slam", interrupted)
    code, _, err = run("run", PIPELINE, *SHORT, "--no-report")
    assert code == 130
    assert err.splitlines()[-1] == "interrupted: nothing was kept"


def test_an_interrupt_in_code_made_from_text_has_its_exit_code_too(tmp_path):
    (tmp_path / "ended.py").write_text(
        "import atexit, sys\n"
        "from rislam_rt.cli.interrupts import end_quietly\n"
        "try:\n    exec('raise KeyboardInterrupt')\nexcept KeyboardInterrupt:\n    atexit.register(end_quietly)\n"
        "sys.exit(130)\n"
    )
    assert subprocess.run([sys.executable, "-m", "ended"], cwd=tmp_path, check=False).returncode == 130


def test_an_interrupt_that_an_import_took_for_a_fault_is_one_line(run, monkeypatch):
    import signal

    from rislam_rt.pipeline import run as module

    def broken(*_, **__):
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            raise ImportError("Encountered an error while initializing the extension.") from None

    monkeypatch.setattr(module, "check_run", broken)
    code, out, err = run("run", "trace_then_slam", "--scene", "empty_box", "--set", "channel=image_source")
    assert (code, out, err) == (130, "", "interrupted\n")


@pytest.mark.parametrize("blow", [pytest.param(signal.SIGINT, marks=pytest.mark.slow), signal.SIGTERM])
def test_interrupted_run_goes_on(run, tmp_path, monkeypatch, blow):
    import rislam_rt.pipeline.run as module

    whole = module.run_scheme
    seen = []

    def broken(name, *rest):
        seen.append(name)
        if name == "random" and seen.count("random") == 1:
            signal.raise_signal(blow)
        return whole(name, *rest)

    monkeypatch.setattr(module, "run_scheme", broken)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be ignored in the background
    code, _, err = run("run", PIPELINE, *SHORT, "--no-report", "--jobs", 1)
    signal.signal(signal.SIGINT, before)
    assert code == 130
    assert err.splitlines()[-1] == "interrupted: 1 scheme kept; the same command goes on from there"
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    (folder,) = (tmp_path / "runs").iterdir()
    assert sorted(path.name for path in folder.iterdir()) == [
        "measurements_optimized.nc", "run.json", "scheme_optimized.nc",
    ]  # fmt: skip
    assert run("report", folder)[0] == 2
    assert run("run", PIPELINE, *SHORT, "--no-report", "--jobs", 1)[0] == 0
    assert seen == ["optimized", "random", "random"]
    assert [path.name for path in folder.parent.iterdir()] == [folder.name]


def test_compare_writes_what_it_found(run, tmp_path):
    code, out, _ = run("compare", SCENE, "--poses", 2, "--depth", 1, "--seed", 3, "--json", "compare.json")
    content = json.loads((tmp_path / "compare.json").read_text())
    assert code == 0
    assert content["unexplained"] == 0
    assert content["matched"] > 0
    assert content["max_length_error_m"] < 2e-5
    assert {"explained", "max_gain_error_db", "max_phase_error_rad", "max_angle_error_rad"} <= set(content)
    assert "unexplained" in out


def test_trace_writes_paths(run, tmp_path):
    import xarray as xr

    code, _, _ = run("trace", SCENE, "--channel", "image_source", "--depth", 1, "--out", "paths.nc", "--json", "t.json")
    assert code == 0
    data = xr.load_dataset(tmp_path / "paths.nc", engine="h5netcdf")
    classes = {row["class"]: row["identities"] for row in json.loads((tmp_path / "t.json").read_text())["classes"]}
    # a box: 6 walls, both legs of the sphere, and of the panel without the bounces on its host next to it
    assert classes == {"LOS": 1, "VT": 6, "PS": 1, "VS": 12, "RIS": 1, "VRIS": 10}
    assert data.sizes["path"] == sum(classes.values())


def test_design_lists_every_method(run, tmp_path):
    from rislam_rt.design import DESIGNERS

    code, out, _ = run("design", SCENE, "--at", "1.5,1.5,0", "--json", "design.json", "--figure", "codes.png")
    content = json.loads((tmp_path / "design.json").read_text())
    assert code == 0
    assert set(content["methods"]) == set(DESIGNERS)
    # the paper's panel from (1.5, 1.5, 0): reference figures of the exact and the all-zero code
    assert content["methods"]["exact"]["gain_db"] == pytest.approx(-88.51, abs=0.05)
    assert content["methods"]["zero"]["gain_db"] == pytest.approx(-118.25, abs=0.05)
    assert content["bound"] <= min(m["crlb_m2"] for m in content["methods"].values())
    assert (tmp_path / "codes.png").read_bytes().startswith(b"\x89PNG")
    assert "exact" in out


def test_design_does_not_take_a_walled_path_for_the_direct_one(run, tmp_path):
    from rislam_rt.model import Reflector
    from rislam_rt.scene import load_scene, write_scene

    scene = load_scene(SCENE)
    corners = [[2.5, 2.5, 2.5], [3.5, 2.5, 2.5], [3.5, 3.5, 2.5], [2.5, 3.5, 2.5]]
    board = Reflector("board", corners, [[0, 1, 2], [0, 2, 3]], scene.reflectors[0].material)
    write_scene(replace(scene, reflectors=(*scene.reflectors, board)), tmp_path / "room")
    for room, direct in ((SCENE, True), ("room", False)):
        code, out, _ = run("design", room, "--at", "3.1,2.9,0.4", "--json", "design.json")
        content = json.loads((tmp_path / "design.json").read_text())
        assert code == 0
        assert content["direct_path"] == direct
        assert content["target"].startswith("RIS ris" if direct else "VRIS wall_")
        for method in content["methods"].values():
            assert method["gain_db"] == (method["target_gain_db"] if direct else None)
            assert method["gap_db"] == (method["target_gap_db"] if direct else None)
        assert ("is hidden" in out) != direct


def test_a_material_not_specified_at_the_carrier_names_the_file(run, tmp_path, monkeypatch):
    monkeypatch.setattr(link_budget, "survey", partial(link_budget.survey, places=1))
    room = ROOT / "scenes" / "itu_room"
    code, out, _ = run("check", room, "--carrier-ghz", "0.3")
    assert code == 2
    assert "itu_room/scene.toml: reflector[" in out
    code, out, _ = run("check", room)
    assert code == 0
    for command in (["run", PIPELINE, "--scene", room, *SHORT], ["trace", room, "--signals"]):
        code, _, err = run(*command, "--set", "radio.carrier_ghz=0.6")
        assert code == 2
        for line in err.splitlines():  # one for each of four reflectors
            assert "itu_room/scene.toml: reflector[" in line
            assert "not specified at the carrier of 0.6 GHz" in line
        assert len(err.splitlines()) == 4
    assert list(tmp_path.iterdir()) == []


def test_doctor_proves_the_tracer(run, tmp_path):
    code, out, _ = run("doctor", "--json", "doctor.json")
    assert code == 0
    assert json.loads((tmp_path / "doctor.json").read_text())["small_box"]["num_paths"] == 25
    assert "libLLVM" in out


def test_a_signal_that_falls_into_a_destructor_is_not_lost():
    from rislam_rt.cli.interrupts import interruptible

    class Thing:
        def __del__(self):
            signal.raise_signal(signal.SIGTERM)

    def work():
        Thing()
        time.sleep(5.0)

    begin = time.monotonic()
    with interruptible() as heard, pytest.raises(KeyboardInterrupt):
        work()
    assert time.monotonic() - begin < 5.0, "the second signal is to wake who sleeps"
    assert heard == [signal.SIGTERM, signal.SIGTERM]
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
