"""Do the tests notice when the software no longer does its work? Acts of sabotage, and the tests that each breaks.

Each mutant changes one place of a copy of the package: the pose is no longer updated, the codes are random ones, a run
never says that it diverged, a bound is half of what it is. The tests run on the copy file by file, first the files that
the mutant names, then all others, until as many tests have failed, in as many files, as must; what a file could add no
more is left out. `nothing` changes a comment only and must break none in all the files named. With `--all` the files
named run to their end. It asks whether what users rely on is tested, not whether every operator is. What was found
stands in `docs/tests.md`.
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
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
PARTS = (
    "rislam_rt", "tests", "pipelines", "scenes", "benchmarks", "docs", "notebooks", "tools", "README.md",
    "CHANGELOG.md", "Makefile",
)  # fmt: skip
ALSO = ("pyproject.toml", "mkdocs.yml", ".ci", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "requirements.lock")
LEFT_OUT = ("tests/rules", "tests/test_mutants.py")
"""They read the code's text, so that they would notice the edit and not what it does."""
SLOW = ("tests/slam", "tests/cli", "tests/studies/unseen", "tests/studies/score_card", "tests/pipeline/long")
"""Last of those that no mutant names."""
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


class Mutant(NamedTuple):
    """One place, as it is and as it must not be."""

    name: str
    file: str
    """Below `rislam_rt/`."""
    before: str
    """Stands there exactly once."""
    after: str
    where: tuple[str, ...] = ()
    """Files under `tests/` where it is likeliest to be noticed, the quickest first."""
    least: int = 5
    """Tests that must break..."""
    files: int = 3
    """...in so many files."""


OF_THE_BOUND = (
    "information/test_trajectory.py", "pipeline/scores/test_scheme_bound.py", "reference/test_end_to_end.py",
    "studies/test_pipeline_sweep.py", "studies/test_studies_swept.py",
)  # fmt: skip
"""Tests that a fault of the bound is likeliest to break, the quickest first."""
MUTANTS = (
    Mutant("nothing", "constants.py", "", ""),
    Mutant(
        "no update of the pose", "slam/window/smoother/window_gaussian.py",
        "    return window._replace(\n        head=window.head + change[:size],\n",
        "    change = np.where(np.isin(np.arange(len(change)), np.arange(HEAD, size)), change, 0.0)\n"
        "    return window._replace(\n        head=window.head + change[:size],\n",
        (
            "slam/window/smoother/test_window_gaussian.py",
            "slam/window/smoother/test_motion_excess.py",
            "reference/test_end_to_end.py",
            "slam/window/test_window_filter.py",
            "slam/test_hard_cases.py",
        ),
    ),
    Mutant(
        "half the deviations", "slam/window/estimates.py",
        "        spread,\n", "        0.25 * spread,\n",
        (
            "pipeline/recordings/test_own_measurements.py",
            "reference/test_end_to_end.py",
            "slam/window/test_window_filter.py",
            "slam/test_whole_filter.py",
        ),
    ),
    Mutant(
        "random codes for optimised ones", "pipeline/code_policies.py",
        '        if method == "random":  # looks at no belief', "        if not is_own(method):",
        (
            "pipeline/test_code_policies.py",
            "pipeline/test_pipeline_panels.py",
            "pipeline/scores/test_scheme_bound.py",
            "reference/test_end_to_end.py",
            "studies/test_studies_swept.py",
        ),
    ),
    Mutant(
        "never diverged", "slam/window/cycle_explanation.py",
        "        return StepOutcome.DIVERGED\n", "        return StepOutcome.OK\n",
        (
            "pipeline/scores/test_summary.py",
            "pipeline/recordings/test_own_measurements.py",
            "report/test_report.py",
            "studies/test_pipeline_sweep.py",
            "slam/test_hard_cases.py",
        ),
    ),
    Mutant(
        "no run counts as lost", "pipeline/scores/summary.py",
        "    return bool((errors > least).any())", "    return bool((errors > np.inf * least).any())",
        (
            "report/test_conclusions.py",
            "pipeline/scores/test_summary.py",
            "report/test_report.py",
            "studies/test_pipeline_sweep.py",
        ),
    ),
    Mutant(
        "every second birth of a wrong kind", "slam/window/births/births.py",
        "    landmarks = enter(context.landmarks, decision.is_wall,",
        "    landmarks = enter(context.landmarks, decision.is_wall != bool(new % 2),",
        (
            "slam/window/test_far_walls.py",
            "slam/window/landmarks/test_window_panel.py",
            "reference/test_end_to_end.py",
            "slam/test_hard_cases.py",
            "slam/test_whole_filter.py",
        ),
    ),
    Mutant(
        "half the bound", "information/posterior_crlb.py",
        "        agent[cycle] = spread[: 2 * axes] @ spread[: 2 * axes].T",
        "        agent[cycle] = 0.25 * spread[: 2 * axes] @ spread[: 2 * axes].T",
        OF_THE_BOUND,
    ),
    Mutant(
        "the bound knows the map", "information/posterior_crlb.py",
        "        slope[:, 2 * axes :] = root * measured.unknown", "        slope[:, 2 * axes :] = 0.0",
        OF_THE_BOUND,
    ),
    Mutant(
        "the bound's agent never accelerates", "information/posterior_crlb.py",
        "(np.diag(motion.accelerations) * step for", "(0.0 * np.diag(motion.accelerations) * step for",
        (
            "pipeline/scores/test_summary.py",
            "information/test_trajectory.py",
            "pipeline/scores/test_scheme_bound.py",
        ),
    ),
    Mutant(
        "the best code is turned by a level", "design/single_path.py",
        "(passed < best[..., None])) % levels",
        "(passed < best[..., None]) + (passed % 2)) % levels",
        (
            "design/test_design_several.py",
            "design/test_design_belief.py",
            "design/test_convex_dual.py",
            "design/test_designers.py",
            "design/test_design_single.py",
        ),
    ),
    Mutant(
        "descent never steps", "design/coordinate_descent.py",
        "    found = [coordinate_descent(objective, codes[row], problem.levels, max_steps) for row in rank]",
        "    found = [coordinate_descent(objective, codes[row], problem.levels, 0) for row in rank]",
        (
            "design/test_design_several.py",
            "design/test_design_curves.py",
            "design/test_design_belief.py",
            "design/test_designers.py",
        ),
    ),
    Mutant(
        "the receiver is twice as sure as it may be", "measurement/waveform_receiver.py",
        "        np.sqrt(variance[:, 0]) / radio.bandwidth,",
        "        0.5 * np.sqrt(variance[:, 0]) / radio.bandwidth,",
        (
            "measurement/test_signal_dataset.py",
            "pipeline/recordings/test_run_measurements.py",
            "measurement/test_estimator.py",
        ),
    ),
    Mutant(
        "the receiver mirrors a cosine", "measurement/waveform_receiver.py",
        "unmirrored(parameters[:, 1:], gain, radio)",
        "unmirrored(parameters[:, 1:] * [1.0, -1.0], gain, radio)",
        (
            "measurement/test_known_paths.py",
            "measurement/test_variance_inflation.py",
            "pipeline/recordings/test_run_measurements.py",
            "measurement/test_estimator.py",
        ),
    ),
    Mutant(
        "errors drawn from the bound are half of it", "measurement/bound_receiver.py",
        "parts.cosines]) + errors.error", "parts.cosines]) + 0.5 * errors.error",
        (
            "measurement/test_measurement_panels.py",
            "measurement/test_bound_receiver.py",
            "pipeline/recordings/test_run_measurements.py",
        ),
    ),
    Mutant(
        "a sweep's seed hangs on its order", "sweeps/sweep.py",
        "            seed = int.from_bytes(_digest([drawn, repetition, sweep.seed])[:8]) >> 1",
        "            seed = int.from_bytes(_digest([len(cells), sweep.seed])[:8]) >> 1",
        (
            "studies/test_pipeline_sweep.py",
            "studies/unseen/test_unseen_cell.py",
            "sweeps/test_sweeps.py",
            "studies/test_studies_swept.py",
        ),
    ),
    Mutant(
        "a sweep takes any cell for its own", "sweeps/store.py",
        '        if found["ident"] == cell.ident:', "        if found:",
        (
            "corpus/test_corpus_results.py",
            "cli/test_cli_sweep.py",
            "sweeps/test_sweeps.py",
        ),
    ),
    Mutant(
        "a damaged file passes", "storage/checksums.py",
        'if content["checksum"] != checksum({key: value for key, value in content.items() if key != "checksum"}):',
        'if not content["checksum"]:',
        (
            "corpus/test_corpus_results.py",
            "pipeline/store/test_run_folder.py",
            "sweeps/test_sweeps.py",
        ),
    ),
    Mutant(
        "another room is the same run", "pipeline/store/identity.py",
        '            "scene": {"name": scene.name, "sha256": scene.digest},',
        '            "scene": {"name": scene.name, "sha256": ""},',
        (
            "cli/test_cli_changed_room.py",
            "pipeline/recordings/test_run_measurements.py",
            "pipeline/store/test_run_folder.py",
        ),
    ),
)  # fmt: skip


def suffices(failed: Collection[str], least: int, files: int) -> bool:
    """Whether so many tests have failed, in so many files."""
    return len(failed) >= least and len(set(map(file_of, failed))) >= files


def file_of(test: str) -> str:
    """The file of a test's name."""
    return test.partition("::")[0]


class Enough:
    """A pytest plugin: stops when enough tests in enough files have failed, and prints which."""

    def __init__(self, least: int, files: int, failed: Collection[str]) -> None:
        self.least, self.files = least, files
        self.failed = set(failed)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Leave out the rest of a file of which more failures could not change the verdict."""
        if sum(file_of(item.nodeid) == file_of(name) for name in self.failed) > self.least - self.files:
            pytest.skip("enough of this file")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Say what failed."""
        if report.failed and report.nodeid not in self.failed:
            self.failed.add(report.nodeid)
            print(f"\nBROKEN {report.nodeid}", flush=True)

    def pytest_runtest_teardown(self, item: pytest.Item) -> None:
        """Stop."""
        if suffices(self.failed, self.least, self.files):
            item.session.shouldstop = "enough"


def run_tests(arguments: argparse.Namespace) -> int:
    """In the copy: the tests, in the order given, up to enough failures."""
    options = ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=no"]
    options += [f"--ignore={path}" for path in arguments.ignore]
    return int(pytest.main([*options, *arguments.tests], plugins=[Enough(*arguments.enough, arguments.failed)]))


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


def likeliest(mutant: Mutant) -> list[str]:
    """Where a mutant is likeliest to be noticed; of `nothing`, all that are asked of any."""
    chosen = MUTANTS if mutant.name == "nothing" else (mutant,)
    return [f"tests/{file}" for file in dict.fromkeys(file for one in chosen for file in one.where)]


def broken_by(mutant: Mutant, arguments: argparse.Namespace) -> list[str]:
    """The tests that fail on a mutant: of the files where it is likeliest to be noticed, then of all others."""
    own = arguments.tests or likeliest(mutant)
    stages = [(own, ())]
    if not (arguments.all or arguments.tests or mutant.name == "nothing"):
        stages += [(("tests",), (*LEFT_OUT, *SLOW, *own)), (SLOW, own)]
    enough = (10**6, 1) if arguments.all else (mutant.least, mutant.files)
    failed: set[str] = set()
    with tempfile.TemporaryDirectory() as name:
        build_copy(Path(name), mutant)
        environment = {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": name, "PYTHONDONTWRITEBYTECODE": "1"}
        for tests, ignored in stages:
            if suffices(failed, *enough):
                break
            command = [sys.executable, __file__, "--inside", "--enough", *map(str, enough), "--failed", *failed]
            command += ["--ignore", *ignored, "--tests", *tests]
            done = subprocess.run(command, cwd=name, env=environment, capture_output=True, text=True, check=False)
            found = {line.split(" ", 1)[1] for line in done.stdout.splitlines() if line.startswith("BROKEN ")}
            assert found or done.returncode in (0, 5), done.stdout[-2000:] + done.stderr[-2000:]
            failed |= found
    return sorted(failed)


def verdict(mutant: Mutant, broken: Collection[str]) -> str:
    """In a word."""
    if mutant.name == "nothing":
        return "BREAKS" if broken else "good"
    return "good" if suffices(broken, mutant.least, mutant.files) else "TOO FEW"


def examine(mutant: Mutant, arguments: argparse.Namespace) -> bool:
    """Print what a mutant breaks; whether that is as it should be."""
    begin = time.perf_counter()
    broken = broken_by(mutant, arguments)
    count, files, word = len(broken), len(set(map(file_of, broken))), verdict(mutant, broken)
    lines = [f"{mutant.name:45s}{count:4d} tests in {files:2d} files  {time.perf_counter() - begin:5.0f} s  {word}"]
    print("\n    ".join([*lines, *broken]), flush=True)
    return word == "good"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", default=[], choices=[mutant.name for mutant in MUTANTS])
    parser.add_argument("--workers", type=int, default=2, help="mutants at a time")
    parser.add_argument("--all", action="store_true", help="each mutant's own files to the end, and no others")
    parser.add_argument(
        "--tests", nargs="*", default=[], help="these instead of each mutant's own files and the others"
    )
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--enough", nargs=2, type=int, default=(1, 1), help=argparse.SUPPRESS)
    parser.add_argument("--failed", nargs="*", default=[], help=argparse.SUPPRESS)
    parser.add_argument("--ignore", nargs="*", default=[], help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.inside:
        sys.exit(run_tests(given))
    if missing := [path for path in given.tests if not (ROOT / path.partition("::")[0]).exists()]:
        parser.error(f"--tests {missing[0]}: no such file or folder; name them from the repository's root")
    if given.workers < 1:
        parser.error(f"--workers {given.workers}: at least 1")
    begin = time.perf_counter()
    chosen = [mutant for mutant in MUTANTS if not given.only or mutant.name in given.only]
    with ThreadPoolExecutor(given.workers) as pool:
        good = list(pool.map(lambda mutant: examine(mutant, given), chosen))
    print(f"{sum(good)} of {len(good)} as they should be, {time.perf_counter() - begin:.0f} s", flush=True)
    sys.exit(not all(good))


if __name__ == "__main__":
    main()
