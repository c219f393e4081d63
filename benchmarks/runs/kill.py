"""Does a run that is killed, interrupted, doubled or starved of disk end with the results of an undisturbed one?

A short run of the main job with three schemes, some with the report, each case in a folder of its
own in which a user has left files of all kinds. Four questions, each asked at moments (or sizes of the disk) spread
over the whole run: SIGKILL to the process group; SIGINT and SIGTERM to it with two jobs; a second process with the same
command; and a disk that is full after so many bytes (a tmpfs in a mount namespace of its own, so that it is a real disk
that says no), for a run and for a sweep. After each the same command is given again, and all values are compared with
those of the undisturbed run; times of the clock are left out. Exit code 1 if a value differs, a file of the user's is
not as it was, an exit code is wrong, or a traceback was printed.

To spare the start of the interpreter, which writes nothing, each case but the interrupts is a fork of one that has
imported the package.

    python benchmarks/runs/kill.py [kill interrupt double disk] [--moments 20] [--seed 1]
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.cli import main as cli_main
from rislam_rt.storage.netcdf import read_dataset

ROOT = Path(__file__).resolve().parents[2]
SHORT = (
    *("--scene", str(ROOT / "scenes" / "paper_room"), "--set", "channel=image_source"),
    *("--set", "slam.num_samples=40"),
)
RUN = (
    *("run", *SHORT, "--set", "cycles=8", "--set", "design.iterations=5"),
    *("--set", 'schemes=["optimized","random","no_ris"]', "--jobs", "1", "--no-report"),
)
DRAWN = RUN[:-1]
PAIRED = (*RUN, "--jobs", "2")
SWEEP = (
    *("sweep", *SHORT, "--set", "cycles=5", "--set", 'schemes=["random"]', "--jobs", "1"),
    *("--axis", "radio.reference_snr_db=-5,5", "--axis", "slam.sigma_a=0.01,0.1", "--repeat", "3"),
)
MINE = (
    *(".git-credentials", ".pre-commit-config.yaml", ".x-y", "notes.txt", "X.partial/notes", "X.old/notes"),
    *("runs/notes.txt", "runs/.hidden-file", "runs/old-7/run.json", "sweeps/.hidden-file", "sweeps/mine/cells/a.json"),
)
"""What a user has there, with names that a program may take for its own."""
PIPELINE = str(ROOT / "pipelines" / "trace_then_slam.toml")
CLOCK = ("timing.png", "report.html", "timings.jsonl")
QUESTIONS = ("kill", "interrupt", "double", "disk")


def main() -> int:
    """Print one line a question."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("questions", nargs="*", default=list(QUESTIONS), help=", ".join(QUESTIONS))
    parser.add_argument("--moments", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    if unknown := set(given.questions) - set(QUESTIONS):
        parser.error(f"{', '.join(unknown)}: give some of {', '.join(QUESTIONS)}")
    if "disk" in given.questions and "RUN_KILL_INSIDE" not in os.environ:
        return in_namespace()
    rng, bad = np.random.default_rng(given.seed), 0
    with tempfile.TemporaryDirectory() as folder:
        base = Path(folder)
        here(RUN, prepare(base / "first"))
        took = timed(RUN, prepare(base / "whole"))
        whole = values(base / "whole")
        print(f"undisturbed: {len(whole)} files, {took:.1f} s", flush=True)
        shares = (np.arange(given.moments) + rng.uniform(size=given.moments)) / given.moments
        for question in given.questions:
            bad += ASKED[question](base / question, shares, took, whole)
    return int(bad > 0)


def ask_kill(base: Path, shares: Any, took: float, whole: dict[str, Any]) -> int:
    """SIGKILL to the process group at each moment, of a run and of a sweep."""
    bad = 0
    for name, words, some in (("run", RUN, shares), ("run and report", DRAWN, shares[::4]), ("sweep", SWEEP, shares)):
        found, alone = Counter[str](), prepare(base / name)
        seconds, wanted = timed(words, alone), values(alone)
        for number, moment in enumerate(some * seconds):
            folder = prepare(base / f"{name}{number}")
            hit = strike(start(words, folder), moment, signal.SIGKILL)
            found[f"killed {stage(folder)}" if hit else "too late"] += 1
            judge(finish(start(words, folder)), (0,), found)
            compare(folder, wanted, found)
        bad += tell(f"SIGKILL to the group, {name}", found)
    return bad


def ask_interrupt(base: Path, shares: Any, took: float, whole: dict[str, Any]) -> int:
    """SIGINT and SIGTERM, turn about, to the process group."""
    found, took = Counter[str](), timed(PAIRED, prepare(base / "whole"), fresh=True)
    for number, moment in enumerate(shares * took):
        folder = prepare(base / str(number))
        process = start(PAIRED, folder, fresh=True)
        hit = strike(process, moment, (signal.SIGINT, signal.SIGTERM)[number % 2])
        code, err = finish(process)
        born = bool(err.strip()) or code == 130  # a signal before Python's first line ends it without a word
        found[f"interrupted {stage(folder)}" if code == 130 else f"exit {code}{'' if hit and born else ' (edge)'}"] += 1
        judge((code, err), (130, 0, -signal.SIGTERM, -signal.SIGINT), found)
        if code == 130 and not err.strip().splitlines()[-1].startswith("interrupted"):
            found[f"BAD last line: {err.strip().splitlines()[-1][:200]}"] += 1
        found["BAD process left"] += is_left(process.pid)
        judge(finish(start(RUN, folder)), (0,), found)
        compare(folder, whole, found)
    return tell("SIGINT, SIGTERM to the group", found)


def ask_double(base: Path, shares: Any, took: float, whole: dict[str, Any]) -> int:
    """The same command twice, the second so much later; and another setting beside them."""
    found = Counter[str]()
    for number, moment in enumerate(shares * took):
        folder = prepare(base / str(number))
        first = start(RUN, folder)
        other = start((*RUN, "--set", "seed=8"), folder) if number % 4 == 0 else None
        time.sleep(moment)
        second = start(RUN, folder)
        codes = []
        for process in (first, second):
            code, err = finish(process)
            judge((code, err), (0, 2), found)
            codes.append(code)
            if code == 2 and f"process {(second if process is first else first).pid} on " not in err:
                found["BAD refused without a name"] += 1
        found[f"exits {' and '.join(map(str, codes))}"] += 1
        if other is not None:
            judge(finish(other), (0,), found)
            shutil.rmtree(next((folder / "runs").glob("trace_then_slam-paper_room-8-*")))
        compare(folder, whole, found)
    return tell("twice at once", found)


def ask_disk(base: Path, shares: Any, took: float, whole: dict[str, Any]) -> int:
    """A disk that is full after so many bytes, for a run and for a sweep."""
    bad = 0
    for name, words in (("run", RUN), ("sweep", SWEEP)):
        found, place = Counter[str](), prepare(base / name)
        finish(start(words, place))
        wanted = values(place)
        size = sum(-(-file.stat().st_size // 4096) for file in place.rglob("*") if file.is_file())
        for share in (np.arange(len(shares)) + 1) / (len(shares) + 1):
            with small_disk(base / "disk", len(MINE) + int(share * (size - len(MINE)))) as grow:
                folder = prepare(base / "disk" / "home")
                code, err = finish(start(words, folder))
                judge((code, err), (4,), found)
                found[f"exit {code}"] += 1
                grow()
                judge(finish(start(words, folder)), (0,), found)
                compare(folder, wanted, found)
        bad += tell(f"disk full, {name}", found)
    return bad


ASKED = dict(zip(QUESTIONS, (ask_kill, ask_interrupt, ask_double, ask_disk), strict=True))


def in_namespace() -> int:
    """This command again, where it may mount a disk of its own that nobody else sees."""
    words = ["unshare", "--user", "--map-root-user", "--mount", sys.executable, *sys.argv]
    try:
        return subprocess.run(words, env={**os.environ, "RUN_KILL_INSIDE": "1"}, check=False).returncode
    except FileNotFoundError:
        print("no 'unshare' here: the question 'disk' needs it; ask the others by name", file=sys.stderr)
        return 3


@contextmanager
def small_disk(place: Path, pages: int) -> Iterator[Any]:
    """A disk of so many pages of 4096 bytes; calling what is given makes it large."""
    place.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={max(pages, 1) * 4}k", "tmpfs", str(place)], check=True)
    try:
        yield lambda: subprocess.run(["mount", "-o", "remount,size=200m", str(place)], check=True)
    finally:
        subprocess.run(["umount", str(place)], check=True)


def prepare(folder: Path) -> Path:
    """A folder with files of a user's."""
    for name in MINE:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(name)
        os.utime(folder / name, (1e9, 1e9))
    return folder


class Forked:
    """The command in a fork of this process and a group of its own, with what of `Popen` is asked for here."""

    def __init__(self, words: tuple[str, ...], folder: Path) -> None:
        self.said = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as the process)
        self.returncode: int | None = None
        self.pid = os.fork()
        if self.pid == 0:
            os.setsid()
            os.chdir(folder)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.dup2(self.said.fileno(), 2)
            sys.argv = ["rislam-rt", words[0], PIPELINE, *words[1:]]
            signal.signal(signal.SIGINT, signal.default_int_handler)
            try:
                cli_main()
            except SystemExit as left:
                os._exit(left.code if isinstance(left.code, int) else 1)
            except BaseException:
                traceback.print_exc()
            os._exit(1)

    def poll(self) -> int | None:
        """Exit code, negative for a signal; None while it runs."""
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def communicate(self, timeout: float) -> tuple[None, bytes]:
        """Wait for the end; what it said on the error stream."""
        end = time.monotonic() + timeout
        while self.poll() is None:
            if time.monotonic() > end:
                raise TimeoutError
            time.sleep(0.005)
        self.said.seek(0)
        return None, self.said.read()


def here(words: tuple[str, ...], folder: Path) -> None:
    """The command in this very process, so that it has imported what forks of it need."""
    place, output = os.getcwd(), os.dup(1)
    os.chdir(folder)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    sys.argv = ["rislam-rt", words[0], PIPELINE, *words[1:]]
    with suppress(SystemExit):
        cli_main()
    os.chdir(place)
    os.dup2(output, 1)


def start(words: tuple[str, ...], folder: Path, *, fresh: bool = False) -> Any:
    """The command in a process group of its own; `fresh`: in an interpreter of its own too."""
    if not fresh:
        return Forked(words, folder)
    command = [sys.executable, "-m", "rislam_rt", words[0], PIPELINE, *words[1:]]
    return subprocess.Popen(
        command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL) and None,  # whoever started us may ignore it
    )  # fmt: skip


def strike(process: Any, moment: float, blow: signal.Signals) -> bool:
    """Wait for the moment and send the signal; whether it found the run at work."""
    time.sleep(moment)
    if process.poll() is not None:
        return False
    os.killpg(process.pid, blow)
    return True


def timed(words: tuple[str, ...], folder: Path, *, fresh: bool = False) -> float:
    """Seconds that the command takes."""
    begin = time.monotonic()
    code, err = finish(start(words, folder, fresh=fresh))
    if code:
        sys.exit(f"the undisturbed command ended with exit code {code}: {err}")
    return time.monotonic() - begin


def is_left(group: int) -> int:
    """1 if a process of a group is still there 5 s after its leader's end."""
    end = time.monotonic() + 5.0
    while time.monotonic() < end:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return 0
        time.sleep(0.05)
    return 1


def finish(process: Any) -> tuple[int, str]:
    """Exit code and error stream."""
    _, err = process.communicate(timeout=600)
    return process.returncode, err.decode(errors="replace")


def stage(folder: Path) -> str:
    """How far the run had come."""
    cells = len(list(folder.glob("sweeps/trace_then_slam-paper_room/cells/*.json")))
    if cells:
        return "after some cells" if cells < 12 else "after all cells"
    marks = list((folder / "runs").glob("trace_then_slam-*/run.json"))
    if not marks:
        return "before its marker"
    about = json.loads(marks[0].read_text())
    if about["state"] == "done":
        return "at its report"
    return f"after {len(about['files'])} schemes"


def judge(ended: tuple[int, str], wanted: tuple[int, ...], found: "Counter[str]") -> None:
    """Count what should not be."""
    code, err = ended
    if code not in wanted:
        found[f"BAD exit {code}: {err.strip().splitlines()[-1][:200] if err.strip() else ''}"] += 1
    if "Traceback" in err and "in main" not in err and "rislam_rt" not in err:
        found["a traceback of Python's own start, before our first line"] += 1
    elif "Traceback" in err:
        found["BAD traceback"] += 1
        print(err, file=sys.stderr)


def compare(folder: Path, whole: dict[str, Any], found: "Counter[str]") -> None:
    """Count a case as identical, or say what differs; what was the user's must be as it was."""
    for name in MINE:
        file = folder / name
        if not file.is_file() or file.read_text() != name or file.stat().st_mtime != 1e9:
            found[f"BAD touched {name}"] += 1
    here = values(folder)
    differ = sorted(name for name in whole.keys() | here.keys() if whole.get(name) != here.get(name))
    found["identical" if not differ else f"BAD differ: {', '.join(differ[:5])}"] += 1


def values(folder: Path) -> dict[str, Any]:
    """All files that are not the user's, without what the clock says."""
    names = (file.relative_to(folder).as_posix() for file in sorted(folder.rglob("*")) if file.is_file())
    return {name: _value(folder / name) for name in names if name not in MINE and Path(name).name not in CLOCK}


def _value(file: Path) -> Any:
    if file.suffix == ".nc":
        data = read_dataset(file)
        return {str(name): data[name].to_numpy().tobytes() for name in data.variables if name != "seconds"}
    if file.name in ("run.json", "summary.json"):
        return _timeless(json.loads(file.read_bytes()))
    return file.read_bytes()


def _timeless(content: Any) -> Any:
    if not isinstance(content, dict):
        return content
    clock = ("over_budget", "checksum", "files")
    return {key: _timeless(value) for key, value in content.items() if not key.endswith("seconds") and key not in clock}


def tell(name: str, found: "Counter[str]") -> int:
    """Print the counts; whether any is bad."""
    seen = {what: count for what, count in sorted(found.items()) if count}
    print(f"{name}: " + "; ".join(f"{count} {what}" for what, count in seen.items()), flush=True)
    return int(any(what.startswith("BAD") for what in seen))


if __name__ == "__main__":
    sys.exit(main())
