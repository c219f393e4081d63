"""Do the tests notice when the software no longer does its work? Acts of sabotage, and the tests that each breaks.

Each mutant changes one place of a copy of the package: the pose is no longer updated, the codes are random ones, a run
never says that it diverged, a bound is half of what it is. The tests run on the copy until as many have failed, in as
many files, as must; with `--all` to their end. `nothing` changes a comment only and must break none. It asks whether
what users rely on is tested, not whether every operator is. What was found stands in `docs/tests.md`.
Run: `python benchmarks/mutants.py [--only NAME ...] [--workers 2] [--all] [--tests PATH ...]`.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
PARTS = (
    "rislam_rt",
    "tests",
    "pipelines",
    "scenes",
    "benchmarks",
    "docs",
    "notebooks",
    "README.md",
    "CHANGELOG.md",
    "Makefile",
)
ALSO = ("pyproject.toml", "mkdocs.yml", ".ci", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "requirements.lock")


class Mutant(NamedTuple):
    """One place, as it is and as it must not be."""

    name: str
    file: str
    """Below `rislam_rt/`."""
    before: str
    """Stands there exactly once."""
    after: str
    least: int = 1
    """Tests that must break..."""
    files: int = 1
    """...in so many files."""


MUTANTS = (
    Mutant("nothing", "constants.py", "", ""),
    Mutant(
        "no update of the pose", "slam/window/smoother/window_gaussian.py",
        "    return window._replace(\n        head=window.head + change[:size],\n",
        "    change = np.where(np.isin(np.arange(len(change)), np.arange(HEAD, size)), change, 0.0)\n"
        "    return window._replace(\n        head=window.head + change[:size],\n",
        5, 3,
    ),
    Mutant(
        "half the deviations", "slam/window/mapping.py",
        "        spread[:6, :6],\n", "        0.25 * spread[:6, :6],\n", 5, 3,
    ),
    Mutant(
        "random codes for optimised ones", "pipeline/code_policies.py",
        '        if method == "random":  # looks at no belief', "        if not is_own(method):", 5, 3,
    ),
    Mutant(
        "never diverged", "slam/window/cycle_explanation.py",
        "        return StepOutcome.DIVERGED\n", "        return StepOutcome.OK\n", 5, 3,
    ),
    Mutant(
        "no run counts as lost", "pipeline/scores/summary.py",
        "    return bool((errors > least).any())", "    return bool((errors > np.inf * least).any())",
    ),
    Mutant(
        "every second birth of a wrong kind", "slam/window/births/births.py",
        "    landmarks = enter(context.landmarks, verdict.is_wall,",
        "    landmarks = enter(context.landmarks, verdict.is_wall != bool(new % 2),", 2, 2,
    ),
    Mutant(
        "half the bound", "information/posterior_crlb.py",
        "        agent[cycle] = spread[: 2 * axes] @ spread[: 2 * axes].T",
        "        agent[cycle] = 0.25 * spread[: 2 * axes] @ spread[: 2 * axes].T",
        5, 3,
    ),
    Mutant(
        "the bound knows the map", "information/posterior_crlb.py",
        "        slope[:, 2 * axes :] = root * measured.unknown", "        slope[:, 2 * axes :] = 0.0",
    ),
    Mutant(
        "the best code is turned by a level", "design/single_path.py",
        "(passed < best[..., None])) % levels",
        "(passed < best[..., None]) + (passed % 2)) % levels",
    ),
    Mutant(
        "descent never steps", "design/coordinate.py",
        "    found = [coordinate_descent(objective, codes[row], problem.levels, max_steps) for row in rank]",
        "    found = [coordinate_descent(objective, codes[row], problem.levels, 0) for row in rank]",
    ),
    Mutant(
        "the receiver is twice as sure as it may be", "measurement/bound.py",
        "        found.deviation[:, 0],\n", "        0.5 * found.deviation[:, 0],\n",
    ),
    Mutant(
        "the receiver mirrors a cosine", "measurement/bound.py",
        "clip_to_unit_disc(blind_axes(found.points[:, 1:], radio))",
        "clip_to_unit_disc(blind_axes(found.points[:, 1:] * [1.0, -1.0], radio))",
    ),
    Mutant(
        "a sweep's seed hangs on its order", "sweeps/sweep.py",
        "            seed = int.from_bytes(_digest([drawn, repetition, sweep.seed])[:8]) >> 1",
        "            seed = int.from_bytes(_digest([len(cells), sweep.seed])[:8]) >> 1",
    ),
    Mutant(
        "a sweep takes any cell for its own", "sweeps/store.py",
        '        if found["ident"] == cell.ident:', "        if found:",
    ),
    Mutant(
        "a damaged file passes", "storage/seal.py",
        '    if content["checksum"] != checksum({key: value for key, value in content.items() if key != "checksum"}):',
        '    if not content["checksum"]:',
    ),
    Mutant(
        "another room is the same run", "pipeline/store/identity.py",
        '            "scene": {"name": scene.name, "sha256": scene.digest},',
        '            "scene": {"name": scene.name, "sha256": ""},',
    ),
)  # fmt: skip


def suffices(failed: Collection[str], least: int, files: int) -> bool:
    """Whether so many tests have failed, in so many files."""
    return len(failed) >= least and len({name.split("::")[0] for name in failed}) >= files


class Enough:
    """A pytest plugin: stops when enough tests in enough files have failed, and prints which."""

    def __init__(self, least: int, files: int) -> None:
        self.least, self.files = least, files
        self.failed: set[str] = set()
        self.session: Any = None

    def pytest_sessionstart(self, session: pytest.Session) -> None:
        """Remember whom to stop."""
        self.session = session

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Count."""
        if not report.failed:
            return
        if report.nodeid not in self.failed:
            self.failed.add(report.nodeid)
            print(f"\nBROKEN {report.nodeid}", flush=True)
        if suffices(self.failed, self.least, self.files):
            spread = self.session.config.pluginmanager.getplugin("dsession")  # who stops when several processes test
            (spread or self.session).shouldstop = "enough"


def run_tests(arguments: argparse.Namespace) -> int:
    """In the copy: the tests, up to enough failures."""
    options = ["-q", "-p", "no:cacheprovider", "--tb=no", "-n", str(arguments.workers), "--dist", "worksteal"]
    return int(pytest.main([*options, *arguments.tests], plugins=[Enough(arguments.least, arguments.files)]))


def build_copy(folder: Path, mutant: Mutant) -> None:
    """The package and its tests under `folder`, with the mutant in it."""
    for part in (*PARTS, *ALSO):
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
        elif source.exists():
            shutil.copy(source, folder / part)
    file = folder / "rislam_rt" / mutant.file
    text = file.read_text()
    if mutant.name == "nothing":
        file.write_text(text + "# a comment\n")
        return
    assert text.count(mutant.before) == 1, f"{mutant.name}: {mutant.file} has it {text.count(mutant.before)} times"
    file.write_text(text.replace(mutant.before, mutant.after))


def broken_by(mutant: Mutant, arguments: argparse.Namespace) -> list[str]:
    """The tests that fail on a mutant."""
    with tempfile.TemporaryDirectory() as name:
        build_copy(Path(name), mutant)
        command = [sys.executable, __file__, "--inside", "--workers", str(arguments.workers)]
        many = (10**6, 10**6) if arguments.all else (mutant.least, mutant.files)
        command += ["--least", str(many[0]), "--files", str(many[1]), "--tests", *arguments.tests]
        environment = {**os.environ, "PYTHONPATH": name, "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(command, cwd=name, env=environment, capture_output=True, text=True, check=False)
    found = sorted(line.split(" ", 1)[1] for line in done.stdout.splitlines() if line.startswith("BROKEN "))
    assert found or done.returncode in (0, 5), done.stdout[-2000:] + done.stderr[-2000:]
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", default=[], choices=[mutant.name for mutant in MUTANTS])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--all", action="store_true", help="to the end, rather than until enough have failed")
    parser.add_argument("--least", type=int, default=1, help=argparse.SUPPRESS)
    parser.add_argument("--files", type=int, default=1, help=argparse.SUPPRESS)
    parser.add_argument("--tests", nargs="*", default=["tests"])
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.inside:
        sys.exit(run_tests(given))
    if missing := [path for path in given.tests if not (ROOT / path.partition("::")[0]).exists()]:
        parser.error(f"--tests {missing[0]}: no such file or folder; name them from the repository's root")
    spared = 0
    for mutant in MUTANTS:
        if given.only and mutant.name not in given.only:
            continue
        begin = time.perf_counter()
        broken = broken_by(mutant, given)
        files = {name.split("::")[0] for name in broken}
        enough = not broken if mutant.name == "nothing" else suffices(broken, mutant.least, mutant.files)
        spared += not enough
        word = "good" if enough else "TOO FEW" if mutant.name != "nothing" else "BREAKS"
        seconds = time.perf_counter() - begin
        print(f"{mutant.name:45s}{len(broken):4d} tests in {len(files):2d} files  {seconds:5.0f} s  {word}", flush=True)
        for name in broken:
            print(f"    {name}", flush=True)
    sys.exit(spared > 0)


if __name__ == "__main__":
    main()
