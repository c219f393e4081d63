"""Does a room from any file run? Each file is made here, and goes from `new` to `check` to `compare` to 100 cycles.

    python benchmarks/scenes/import_gauntlet.py                   every file; some minutes
    python benchmarks/scenes/import_gauntlet.py --only scan       one of them
    python benchmarks/scenes/import_gauntlet.py --keep FOLDER     files, rooms and runs stay there

(a) `glb`: a furnished room as one mesh of more than 20 000 triangles in millimetres, y up: round table, six chairs,
column, cabinet, a ball. (b) `obj`, (c) `stl`, (d) `ply`: the same. (e) `planes`: the same with its column as planes.
(f) `svg`: a floor plan of five rooms with doors and windows, centimetres. (g) `scan`: a room scanned with 5 mm of noise
and holes.
A row holds walls and shades, CPU seconds of each command (all processes, libraries' start included), paths that match,
paths that nothing explains, and the agent's error; before it stands what the importer says. Exit code 1 where a command
fails, paths are unexplained, or a check takes 5 s or more.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.channel.walls import build_walls
from rislam_rt.scene import load_scene
from rislam_rt.scene.meshes import joined
from rislam_rt.scene.shapes import block, box_corners, hexahedron

SIZE = (6.0, 4.5, 2.7)
TABLE, CHAIRS = np.array([3.0, 2.2]), 6
LEAST_TRIANGLES = 20_000
NOISE, HOLES, CUT = 0.005, 40, 0.07
"""[m] of noise; number of holes; [m] longest edge of the scan."""
LONGEST_CHECK = 5.0
PLAN = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1020 820">
<g id="rooms">
<rect x="10" y="10" width="400" height="350"/><rect x="420" y="10" width="580" height="350"/>
<rect x="10" y="370" width="990" height="120"/>
<polygon points="10,500 400,500 400,810 10,810"/><path d="M 410 500 H 1000 V 810 H 410 Z"/>
</g>
<g class="doors">
<line x1="150" y1="365" x2="240" y2="365"/><line x1="600" y1="365" x2="700" y2="365"/>
<line x1="200" y1="495" x2="290" y2="495"/><line x1="700" y1="495" x2="790" y2="495" data-material="itu:wood"/>
<rect x="408" y="100" width="14" height="90"/>
</g>
<g class="windows">
<line x1="100" y1="8" x2="300" y2="8"/><line x1="600" y1="812" x2="800" y2="812" data-bottom="0.5"/>
</g>
</svg>
"""


def solid(mesh: Any) -> Any:
    """A mesh of ours as one of trimesh's."""
    import trimesh

    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def cylinder(radius: float, height: float, at: list[float], sides: int) -> Any:
    """An upright cylinder about a point."""
    import trimesh

    mesh = trimesh.creation.cylinder(radius=radius, height=height, sections=sides)
    mesh.apply_translation(at)
    return mesh


def chair(at: np.ndarray) -> list[Any]:
    """Seat, back and four legs."""
    x, y = at
    parts = [block([x - 0.2, y - 0.2, 0.43], [x + 0.2, y + 0.2, 0.47])]
    parts.append(block([x - 0.2, y + 0.17, 0.47], [x + 0.2, y + 0.2, 0.9]))
    for i in (-1, 1):
        for j in (-1, 1):
            low = [x + 0.18 * i - 0.015, y + 0.18 * j - 0.015, 0.0]
            parts.append(block(low, [low[0] + 0.03, low[1] + 0.03, 0.43]))
    return [solid(part) for part in parts]


def furnished() -> Any:
    """The room as one mesh, z up, in metres."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.25)
    ball.apply_translation((1.2, 1.0, 0.25))
    parts = [solid(joined(list(hexahedron(box_corners([0.0, 0.0, 0.0], SIZE)).values()))), ball]
    parts += [cylinder(0.6, 0.03, [*TABLE, 0.735], 64), cylinder(0.05, 0.72, [*TABLE, 0.36], 32)]
    for k in range(CHAIRS):
        angle = 2.0 * np.pi * k / CHAIRS + 0.3
        parts += chair(TABLE + 1.1 * np.array([np.cos(angle), np.sin(angle)]))
    parts += [cylinder(0.2, 2.7, [5.0, 3.6, 1.35], 48), solid(block([0.0, 3.2, 0.0], [0.5, 4.4, 1.9]))]
    fine = []
    for part in parts:
        while part.area > 0.02 * len(part.faces) or len(part.faces) < 100:
            part = part.subdivide()
        fine.append(part)
    whole = trimesh.util.concatenate(fine)
    assert len(whole.faces) >= LEAST_TRIANGLES
    return whole


def drawn(suffix: str) -> Callable[[Path], tuple[Path, list[str]]]:
    """Writes the furnished room in millimetres, y up."""

    def write(folder: Path) -> tuple[Path, list[str]]:
        whole = furnished()
        whole.apply_transform(np.array([[1e3, 0, 0, 0], [0, 0, 1e3, 0], [0, -1e3, 0, 0], [0, 0, 0, 1.0]]))
        path = folder / f"furnished.{suffix}"
        whole.export(path)
        return path, ["--units", "mm", "--up", "y"]

    return write


def plan(folder: Path) -> tuple[Path, list[str]]:
    """Writes the floor plan."""
    (folder / "plan.svg").write_text(PLAN)
    return folder / "plan.svg", ["--units", "cm"]


def scan(folder: Path) -> tuple[Path, list[str]]:
    """Writes the scan: walls, a table, a cabinet, a column; nothing under the noise is kept."""
    import trimesh

    parts = [*hexahedron(box_corners([0.0, 0.0, 0.0], SIZE)).values(), block([2.2, 1.6, 0.7], [3.8, 2.8, 0.74])]
    parts.append(block([0.0, 3.2, 0.0], [0.5, 4.4, 1.9], without=("floor", "wall_x0")))
    whole = trimesh.util.concatenate([solid(joined(parts)), cylinder(0.2, 2.7, [5.0, 3.6, 1.35], 48)])
    vertices, faces = trimesh.remesh.subdivide_to_size(whole.vertices, whole.faces, CUT)
    whole = trimesh.Trimesh(vertices, faces)
    rng = np.random.default_rng(18)
    center = whole.triangles_center
    keep = np.ones(len(center), dtype=bool)
    for spot in center[rng.integers(len(center), size=HOLES)]:
        keep &= np.linalg.norm(center - spot, axis=1) > rng.uniform(0.08, 0.35)
    whole.update_faces(keep)
    whole.vertices = whole.vertices + rng.normal(0.0, NOISE, whole.vertices.shape)
    whole.export(folder / "scan.ply")
    return folder / "scan.ply", []


CASES: dict[str, tuple[Callable[[Path], tuple[Path, list[str]]], list[str]]] = {
    "glb": (drawn("glb"), []), "obj": (drawn("obj"), []), "stl": (drawn("stl"), []), "ply": (drawn("ply"), []),
    "planes": (drawn("glb"), ["--curved", "planes"]), "svg": (plan, []), "scan": (scan, []),
}  # fmt: skip


def command(*words: object) -> tuple[float, str, bool]:
    """CPU seconds of a command of the package, what it prints, and whether it ended well."""
    before = os.times()
    done = subprocess.run(
        [sys.executable, "-m", "rislam_rt", *map(str, words)], capture_output=True, text=True, check=False
    )
    after = os.times()
    seconds = after.children_user + after.children_system - before.children_user - before.children_system
    if done.returncode:
        print("failed:", " ".join(map(str, words)), done.stderr[-500:], done.stdout[-500:], sep="\n")
    return seconds, done.stdout, done.returncode == 0


def go(name: str, folder: Path) -> tuple[list[str], bool]:
    """One file, all the way: its row, and whether all is well."""
    folder.mkdir()
    write, more = CASES[name]
    file, options = write(folder)
    room = folder / "room"
    new, said, ok = command("new", room, "--from", file, *options, *more)
    if not ok:
        return [name, "failed"], False
    check, _, checked = command("check", room)
    compare, _, agreed = command("compare", room, "--json", folder / "compare.json")
    run, _, ran = command(
        "run", "trace_then_slam", "--scene", room, "--set", "cycles=100", "--out", folder / "run", "--json",
        folder / "run.json",
    )  # fmt: skip
    scene = load_scene(room)
    report = json.loads((folder / "compare.json").read_text())
    unexplained = report["unexplained"] + report["float32"]["unexplained"]
    schemes = json.loads((folder / "run.json").read_text())["schemes"] if ran else {}
    error = schemes.get("optimized", {}).get("rmse_m")
    counts = f"{len(scene.reflectors)} / {len(build_walls(scene))}"
    counts += f" / {sum(len(shade.faces) for shade in scene.occluders)}"
    print("\n".join(f"    {line}" for line in said.splitlines()), flush=True)
    row = [name, counts, *(f"{seconds:.1f}" for seconds in (new, check, compare, run)), str(report["matched"]),
           str(unexplained), f"{100 * error:.1f}" if error is not None else "-"]  # fmt: skip
    return row, checked and agreed and ran and unexplained == 0 and check < LONGEST_CHECK


def main() -> int:
    """Run the gauntlet and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=CASES, action="append", help="one file; repeatable")
    parser.add_argument("--keep", type=Path, help="folder that keeps files, rooms and runs; it must not exist")
    options = parser.parse_args()
    heads = ["file", "reflectors / walls / triangles of shades", "new [s]", "check [s]", "compare [s]", "run [s]",
             "paths", "unexplained", "error [cm]"]  # fmt: skip
    rows, well = [heads, ["---"] * len(heads)], True
    with tempfile.TemporaryDirectory() as place:
        folder = options.keep or Path(place) / "gauntlet"
        folder.mkdir(parents=True)
        for name in options.only or CASES:
            print(f"{name}:", flush=True)
            row, good = go(name, folder / name)
            rows.append(row)
            well &= good
    print("\n".join("| " + " | ".join(row) + " |" for row in rows))
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
