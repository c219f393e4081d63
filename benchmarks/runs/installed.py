"""Does it work where it is installed? A wheel, a clean environment, an empty folder, and every block of the tutorial.

    python benchmarks/runs/installed.py [--write]      --write puts the log into docs/tutorial.md

The wheel is built from the working tree by hatchling and installed with `--no-deps` into a new environment; the
packages that it depends on are those of the environment that runs this, added by a `.pth` file, so that nothing is
fetched. The package itself comes of the wheel alone: that is checked. `PYTHONPATH` is not set, home is a new folder.
"""

import argparse
import os
import re
import resource
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
TUTORIAL = ROOT / "docs" / "tutorial.md"
HEADING = "## The log\n"
FENCE = re.compile(r"^```(sh|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    """A command line, or a file to write (with its name)."""

    text: str
    file: str | None


def read_blocks(page: Path) -> Iterator[Block]:
    """Commands one by one, and Python files, which begin with their name as a comment, in the order of the page."""
    for kind, text in FENCE.findall(page.read_text(encoding="utf-8").partition(HEADING)[0]):
        if kind == "python":
            yield Block(text, text.partition("\n")[0].removeprefix("# "))
        else:
            lines = re.sub(r"\\\n\s*", "", text).splitlines()
            yield from (Block(line, None) for line in lines if line)


def build_wheel(folder: Path) -> Path:
    """The wheel of the working tree."""
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder], cwd=ROOT, check=True,
                   capture_output=True)  # fmt: skip
    return next(folder.glob("*.whl"))


def install(wheel: Path, folder: Path) -> Path:
    """A new environment with the wheel and with the packages of this one; returns its `bin`."""
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    subprocess.run([folder / "bin" / "python", "-m", "pip", "install", "-q", "--disable-pip-version-check", "--no-deps",
                    "--no-index", wheel], check=True)  # fmt: skip
    site = next((folder / "lib").glob("python*")) / "site-packages"
    (site / "beside.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return folder / "bin"


class Outcome(NamedTuple):
    """Of a command."""

    code: int
    wall: float
    """[s]."""
    processor: float
    """[s] of all its processes."""
    said: str
    """The result, and behind it, where it failed, the errors."""


def run(command: str, folder: Path, environment: dict[str, str]) -> Outcome:
    """A command in a shell."""
    begin, used = time.perf_counter(), processor_time()
    done = subprocess.run(
        ["bash", "-c", command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    said = done.stdout + (done.stderr if done.returncode else "")
    return Outcome(done.returncode, time.perf_counter() - begin, processor_time() - used, said)


def processor_time() -> float:
    """[s] of all processes that were waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def log_lines(bin_folder: Path, folder: Path) -> Iterator[str]:
    """Each command with its time and the last two lines that it said.

    Raises
    ------
    SystemExit
        A command failed, or the package is not that of the wheel.
    """
    environment = {
        "PATH": f"{bin_folder}:{os.environ['PATH']}", "HOME": str(folder.parent), "COLUMNS": "100", "LANG": "C.UTF-8",
    }  # fmt: skip
    where = run("python -c 'import rislam_rt; print(rislam_rt.__file__)'", folder, environment).said.strip()
    if not where.startswith(str(bin_folder.parent)):
        raise SystemExit(f"the package is {where}, not that of the wheel")
    begin, used = time.perf_counter(), processor_time()
    for block in read_blocks(TUTORIAL):
        if block.file is not None:
            (folder / block.file).write_text(block.text)
            continue
        done = run(block.text, folder, environment)
        yield f"{done.wall:6.1f} {done.processor:6.1f}  $ {block.text}"
        told = [line for line in done.said.splitlines() if re.search(r"\w", line)]
        yield from (f"{'':14} {line}" for line in told[-2:])
        if done.code:
            raise SystemExit(f"{block.text}: exit code {done.code}\n{done.said}")
    yield f"{time.perf_counter() - begin:6.1f} {processor_time() - used:6.1f}  in all"


def main() -> None:
    """Print the log, and put it into the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true")
    write = parser.parse_args().write
    place = Path(tempfile.mkdtemp(prefix="rislam-installed-"))
    try:
        empty = place / "empty"
        empty.mkdir()
        begin = time.perf_counter()
        print("  wall    cpu  [s]")
        wheel = build_wheel(place)
        bin_folder = install(wheel, place / "environment")
        took = f"{time.perf_counter() - begin:6.1f} {processor_time():6.1f}"
        lines = [f"{took}  wheel {wheel.name} built and installed"]
        print(lines[0], flush=True)
        for line in log_lines(bin_folder, empty):
            lines.append(line.replace(str(place), "..."))
            print(lines[-1], flush=True)
    finally:
        shutil.rmtree(place)
    if write:
        about = "`python benchmarks/runs/installed.py --write`, on two cores that other work shared; seconds on the\n"
        about += "clock, and of the processor:\n"
        text = TUTORIAL.read_text(encoding="utf-8").partition(HEADING)[0]
        TUTORIAL.write_text(f"{text}{HEADING}\n{about}\n```\n" + "\n".join(lines) + "\n```\n", encoding="utf-8")


if __name__ == "__main__":
    main()
