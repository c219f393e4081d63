"""Hostile input in bulk: changed bytes, changed values, cut and crossed files. What does the software do with them?

    python benchmarks/fuzz.py [--cases 10000] [--seed 0] [--only toml,ply,...]

Every case is a sound file with something done to it, handed to the function that reads it. There are four answers:
`read` (a value whose numbers hold), `refused` (a declared error of one line), and two that must not be: `escaped` (any
other exception, or an error of several lines) and `slow` (more than 5 s of CPU). A result file whose bytes changed must
not be read as if nothing had happened: `silent` counts those. Exit code 1 if one of the last three is not 0.
"""

import argparse
import contextlib
import io
import json
import os
import re
import shutil
import struct
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

from rislam_rt.errors import RislamError
from rislam_rt.scene.meshes import MeshReader
from rislam_rt.scene.motion import parse_tum
from rislam_rt.scene.schema import parse_spec

ROOT = Path(__file__).parents[1]
SLOW = 5.0
"""[s] of CPU that no small input may take."""
SPICE = [
    b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e-320", b"0", b"-0.0", b"-1", b"99999999999999999999", b"true",
    b"''", b'""', b"[]", b"{}", b"[[", b"]]", b"= =", b"\x00", b"\xff\xfe", b"\xe2\x80\xae", b"#", b"\n", b"\r\n",
    b"../../etc/passwd", b"a" * 300, b"a.a.a.a", b"18446744073709551616", b"4294967295", b"0x7fffffff", b"1_000",
    "Wände".encode(), "墙".encode(), b"1979-05-27", b"[" * 200, b'"""',
]  # fmt: skip
"""Pieces that have broken readers before."""
_SHARES = (0.15, 0.12, 0.05, 0.08, 0.12, 0.08, 0.05, 0.3, 0.05)
Answer = tuple[str, str]
"""`read`, `refused`, `escaped`, `slow` or `silent`, and the exception if there was one."""


class Target(NamedTuple):
    """A kind of file: sound examples, and what reads them."""

    samples: list[bytes]
    read: Callable[[bytes], object]
    sealed: bool = False
    """Whether a changed byte must be noticed."""


def damage(content: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    """One thing or more done to a file."""
    data = bytearray(content)
    for _ in range(int(rng.geometric(0.6))):
        at = int(rng.integers(0, len(data) + 1))
        kind = int(rng.choice(9, p=_SHARES))
        if kind == 0 and data:  # bits turn over
            data[min(at, len(data) - 1)] ^= 1 << int(rng.integers(0, 8))
        elif kind == 1 and data:
            data[min(at, len(data) - 1)] = int(rng.integers(0, 256))
        elif kind == 2:
            del data[at:]
        elif kind == 3:
            del data[at : at + int(rng.integers(1, 40))]
        elif kind == 4:
            data[at:at] = SPICE[int(rng.integers(0, len(SPICE)))]
        elif kind == 5:
            end = at + int(rng.integers(1, 60))
            data[at:at] = data[at:end]
        elif kind == 6:
            other = others[int(rng.integers(0, len(others)))]
            data[at:] = other[int(rng.integers(0, len(other) + 1)) :]
        elif kind == 7:
            data = _other_value(data, rng)
        else:
            data[at : at + 4] = struct.pack("<I", int(rng.choice([0, 1, 2**31 - 1, 2**32 - 1, 2**16])))
    return bytes(data[:2_000_000])


def _other_value(data: bytearray, rng: np.random.Generator) -> bytearray:
    """A word or number replaced by something else, or by another word of the file."""
    words = re.split(rb"([A-Za-z0-9_.+-]+)", bytes(data))
    if len(words) < 4:
        return data
    places = range(1, len(words), 2)
    other = words[int(rng.choice(places))] if rng.random() < 0.3 else SPICE[int(rng.integers(0, len(SPICE)))]
    words[int(rng.choice(places))] = other
    return bytearray(b"".join(words))


def try_case(target: Target, content: bytes, sound: bool) -> Answer:
    """Hand one case to its reader."""
    begin = process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            target.read(content)
        answer = ("read", "") if sound or not target.sealed else ("silent", "")
    except RislamError as error:
        lines = str(error).splitlines()
        answer = ("refused", "") if len(lines) == 1 and str(error).isprintable() else ("escaped", f"lines: {error!r}")
    except Exception as error:  # anything else is what this study looks for
        answer = ("escaped", f"{type(error).__name__}: {error}"[:300])
    return ("slow", f"{process_time() - begin:.1f} s") if process_time() - begin > SLOW else answer


def targets(folder: Path) -> Iterator[tuple[str, Target]]:
    """Every kind of input, with a reader that works in `folder`."""
    yield "toml", Target([f.read_bytes() for f in sorted((ROOT / "scenes").glob("*/scene.toml"))], parse_spec)
    for suffix, samples in mesh_samples().items():
        yield suffix, Target(samples, mesh_reader(suffix))
    yield "tum", Target(tum_samples(), parse_tum)
    files = sorted((ROOT / "pipelines").glob("*.toml"))
    yield "pipeline", Target([f.read_bytes() for f in files], pipeline_reader(folder))
    yield "scene", Target([(ROOT / "scenes/paper_room/scene.toml").read_bytes()], scene_reader(folder))
    yield from result_targets(folder)


def mesh_samples() -> dict[str, list[bytes]]:
    """The same square in every format, and some of the rooms' own meshes."""
    import trimesh

    corners = np.array([[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [6.0, 6.0, 0.0], [0.0, 6.0, 0.0]])
    square = trimesh.Trimesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), process=False)
    found: dict[str, list[bytes]] = {}
    for suffix in ("ply", "obj", "glb", "stl"):
        made = square.export(file_type=suffix)
        found[suffix] = [made.encode() if isinstance(made, str) else made]
        found[suffix] += [f.read_bytes() for f in sorted((ROOT / "scenes").glob(f"*/meshes/*.{suffix}"))[:4]]
    text = square.export(file_type="ply", encoding="ascii")
    found["ply"].append(text if isinstance(text, bytes) else text.encode())
    text = square.export(file_type="stl_ascii")
    found["stl"].append(text if isinstance(text, bytes) else text.encode())
    return found


def mesh_reader(suffix: str) -> Callable[[bytes], object]:
    """Reads a mesh and looks at its numbers."""

    def read(content: bytes) -> object:
        mesh = MeshReader().parse(content, f"a.{suffix}")
        assert len(mesh.faces) > 0
        assert mesh.faces.min() >= 0
        assert mesh.faces.max() < len(mesh.vertices)
        assert np.isfinite(mesh.vertices).all()
        return mesh

    return read


def tum_samples() -> list[bytes]:
    """A straight line and a turn, with comments."""
    time = 0.1 * np.arange(40)
    line = "\n".join(f"{t:.1f} {1 + 0.01 * t} 1.2 0.5 0 0 0 1" for t in time)
    turn = "\n".join(f"{1.7e9 + t:.1f} 1.5 1.2 0.5 0 0 {np.sin(t / 2):.9f} {np.cos(t / 2):.9f}" for t in time)
    return [b"# timestamp x y z qx qy qz qw\n" + line.encode() + b"\n", turn.encode()]


def pipeline_reader(folder: Path) -> Callable[[bytes], object]:
    """Reads a pipeline file of any kind."""
    from rislam_rt.studies import load_any

    file = folder / "pipeline.toml"

    def read(content: bytes) -> object:
        file.write_bytes(content)
        return load_any(file, ())

    return read


def scene_reader(folder: Path) -> Callable[[bytes], object]:
    """Reads and checks a whole room whose scene file is the content."""
    from rislam_rt.scene import check_scene, load_scene

    room = folder / "room"
    shutil.copytree(ROOT / "scenes/paper_room", room)

    def read(content: bytes) -> object:
        (room / "scene.toml").write_bytes(content)
        for finding in check_scene(room):
            assert finding.line.isprintable()
        return load_scene(room)

    return read


def result_targets(folder: Path) -> Iterator[tuple[str, Target]]:
    """Files of a completed run and of a sweep's cell: any changed value must be noticed."""
    run = make_run(folder / "run")
    for name, kind in (("run.json", "marker"), ("scheme_random.nc", "scheme"), ("paths.nc", "paths")):
        yield kind, Target([(run / name).read_bytes()], run_reader(run, name), sealed=True)
    file, read = cell_reader(folder / "sweep")
    yield "cell", Target([file.read_bytes()], read, sealed=True)


def make_run(folder: Path) -> Path:
    """A completed run of a few cycles."""
    from rislam_rt.pipeline import load_spec, run_slam
    from rislam_rt.pipeline.scores.summary import summarise
    from rislam_rt.pipeline.store.identity import run_identity
    from rislam_rt.pipeline.store.run_folder import open_run
    from rislam_rt.scene import load_scene

    settings = ["channel=image_source", "cycles=12", "depth=1", 'schemes=["random"]']
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", settings)
    room = load_scene(ROOT / "scenes" / "paper_room")
    with open_run(folder, run_identity(spec, room)) as store:
        result = run_slam(room, spec, rng=np.random.default_rng(7), done=store)
        store.complete(result, summarise(result))
    return folder


def run_reader(folder: Path, name: str) -> Callable[[bytes], object]:
    """Reads a whole run one of whose files is the content."""
    from rislam_rt.pipeline.store.run_folder import read_run

    sound = (folder / name).read_bytes()

    def read(content: bytes) -> object:
        (folder / name).write_bytes(content)
        try:
            return read_run(folder)
        finally:
            (folder / name).write_bytes(sound)

    return read


def cell_reader(folder: Path) -> tuple[Path, Callable[[bytes], object]]:
    """Reads a sweep's cell; one that will be run again counts as refused."""
    from rislam_rt.errors import ResultError
    from rislam_rt.sweeps import Sweep, build_cells
    from rislam_rt.sweeps.store import MISSING, read_row, write_cell
    from rislam_rt.sweeps.work import CellOutcome

    cell = build_cells(Sweep("math:hypot", base={"cycles": 3}))[0]
    write_cell(folder, cell, "math:hypot", CellOutcome({"rmse_m": [0.1, 0.2], "name": "random"}))
    file = next((folder / "cells").iterdir())

    def read(content: bytes) -> object:
        file.write_bytes(content)
        row = read_row(folder, cell)
        if row.state == MISSING:
            raise ResultError("run again")
        return row

    return file, read


def same_value(content: bytes, sound: bytes) -> bool:
    """Whether a file says what it said: JSON may be spaced in another way."""
    try:
        return content == sound or json.loads(content) == json.loads(sound)
    except (ValueError, RecursionError):
        return False


def run_cases(name: str, target: Target, cases: int, rng: np.random.Generator) -> Counter[str]:
    """Count the answers to damaged examples of one kind; what should not be is printed."""
    found: Counter[str] = Counter()
    for number in range(cases):
        sample = target.samples[int(rng.integers(0, len(target.samples)))]
        content = damage(sample, target.samples, rng)
        with contextlib.redirect_stderr(io.StringIO()) as said:
            answer, cause = try_case(target, content, same_value(content, sample))
        if "Traceback" in said.getvalue():
            answer, cause = "escaped", "a traceback on the error stream"
        found[answer] += 1
        if answer in ("escaped", "slow", "silent"):
            keep = Path(tempfile.gettempdir()) / f"fuzz-{name}-{number}"
            keep.write_bytes(content)
            print(f"  {name} case {number}: {answer}: {cause} ({keep})", flush=True)
    return found


def main() -> int:
    """All kinds, and a table of the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=10_000, help="in all, shared out evenly")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="kinds, separated by commas")
    given = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with tempfile.TemporaryDirectory() as place:
        wanted = given.only.split(",") if given.only else None
        kinds = {name: target for name, target in targets(Path(place)) if wanted is None or name in wanted}
        share, total, begin = -(-given.cases // len(kinds)), Counter[str](), process_time()
        print(
            f"{'kind':10} {'cases':>6} {'read':>6} {'refused':>8} {'escaped':>8} {'slow':>5} {'silent':>7} {'CPU s':>7}"
        )
        streams = np.random.default_rng(given.seed).spawn(len(kinds))
        for (name, target), rng in zip(kinds.items(), streams, strict=True):
            start = process_time()
            for sample in target.samples:
                target.read(sample)  # what is sound must be read, or nothing here means anything
            found = run_cases(name, target, share, rng)
            total += found
            print(_row(name, found, process_time() - start), flush=True)
        print(_row("all", total, process_time() - begin))
    return int(any(total[answer] for answer in ("escaped", "slow", "silent")))


def _row(name: str, found: Counter[str], seconds: float) -> str:
    widths = {"read": 6, "refused": 8, "escaped": 8, "slow": 5, "silent": 7}
    counts = " ".join(f"{found[answer]:>{width}}" for answer, width in widths.items())
    return f"{name:10} {found.total():>6} {counts} {seconds:>7.1f}"


if __name__ == "__main__":
    sys.exit(main())
