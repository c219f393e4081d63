"""What a command loads, and what it says when something to load is missing."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "scenes" / "paper_room"
PIPELINE = ROOT / "pipelines" / "trace_then_slam.toml"


def loaded(names, *commands):
    """Which of some modules are loaded after some commands, in an interpreter of their own."""
    code = (
        "import sys\n"
        "from rislam_rt.cli import main\n"
        f"for words in {commands}:\n"
        "    sys.argv = ['rislam-rt', *words]\n"
        "    try:\n        main()\n"
        "    except SystemExit as left:\n        assert left.code == 0, left.code\n"
        f"print([name for name in {names} if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1]


def test_help_and_version_import_nothing_heavy():
    heavy = ("numpy", "scipy", "sionna", "mitsuba", "drjit", "matplotlib", "xarray", "trimesh")
    assert loaded(heavy, ["--help"], ["run", "--help"], ["--version"]) == "[]"


def test_settings_are_printed_without_what_only_a_run_needs():
    """Half a second of scipy, trimesh and plots for a list of settings; on modules, as clocks lie."""
    parts = ("linalg", "special", "optimize", "spatial", "stats")
    assert loaded([*(f"scipy.{part}" for part in parts), "trimesh", "xarray", "matplotlib"], ["config"]) == "[]"


def test_missing_library_is_one_line_and_exit_3(tmp_path):
    environment = {**os.environ, "DRJIT_LIBLLVM_PATH": str(tmp_path / "libLLVM.so")}
    commands = [["trace", str(SCENE)], ["run", str(PIPELINE)], ["doctor"]]
    code = (
        "import sys\n"
        "from rislam_rt.cli import main\n"
        f"for words in {commands}:\n"
        "    sys.argv = ['rislam-rt', *words]\n"
        "    try:\n        main()\n"
        "    except SystemExit as left:\n        print('left with', left.code, file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, env=environment, check=True
    )
    lines = done.stderr.splitlines()
    assert lines[1::2] == ["left with 3"] * 3
    assert len(lines) == 6
    assert all("DRJIT_LIBLLVM_PATH" in line for line in lines[::2])
    assert list(tmp_path.iterdir()) == []
