"""From a scene file to a run, with the time that each step takes.

    python benchmarks/scenes/xml_gauntlet.py

For two scenes of Sionna RT, a window of its Munich, and the office as a scene file without its `scene.toml`: `new
--from`, `check`, `compare --poses 10` (its exit code and unexplained paths), and 100 cycles of `trace_then_slam` in the
room as it was made, with the way and the panel that were proposed. Seconds are CPU seconds of each command,
start included.
"""

import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

SOURCES = {
    "box": ["sionna:box"],
    "canyon": ["sionna:simple_street_canyon"],
    "munich": ["sionna:munich", "--within=-60,-60,60,60"],
    "office": ["office.xml/scene.xml"],
}


def run(folder: Path, *words: str) -> tuple[int, float, str]:
    """Exit code, CPU seconds and last line of a command in a folder."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-m", "rislam_rt", *words], cwd=folder, capture_output=True, text=True, check=False
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    lines = (done.stdout + done.stderr).strip().splitlines()
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return done.returncode, spent, lines[-1] if lines else ""


def main() -> None:
    """Print a row a scene."""
    print("| scene | faces | new [s] | check [s] | compare [s] | matched | unexplained | run [s] | RMSE [m] |")
    print("| --- " * 9 + "|")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        run(folder, "export", "office", "--xml", "office.xml")
        (folder / "office.xml" / "scene.toml").unlink()
        for name, source in SOURCES.items():
            steps = [
                run(folder, "new", name, "--from", *source),
                run(folder, "check", name),
                run(folder, "compare", name, "--poses", "10", "--json", "compare.json"),
                run(folder, "run", "trace_then_slam", "--scene", name, "--set", "cycles=100", "--json", "run.json"),
            ]
            bad = [step for step in steps if step[0]]
            if bad:
                print(f"| {name} | exit code {bad[0][0]}: {bad[0][2]} |")
                continue
            compared, led = (json.loads((folder / f"{step}.json").read_text()) for step in ("compare", "run"))
            from rislam_rt import load_scene

            faces = sum(len(reflector.faces) for reflector in load_scene(folder / name).reflectors)
            seconds = [f"{step[1]:.1f}" for step in steps]
            errors = ", ".join(f"{scheme} {row['rmse_m']:.3f}" for scheme, row in led["schemes"].items())
            cells = [name, faces, *seconds[:3], compared["matched"], compared["unexplained"], seconds[3], errors]
            print("| " + " | ".join(map(str, cells)) + " |", flush=True)


if __name__ == "__main__":
    main()
