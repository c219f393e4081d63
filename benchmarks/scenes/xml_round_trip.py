"""Does a room survive the way to Sionna RT and back?

    python benchmarks/scenes/xml_round_trip.py [--poses 20] [--figure docs/figures/xml_round_trip.png]

Every shipped room is written as a scene file (`rislam-rt export --xml`) and opened with Sionna's `load_scene`; its own
`PathSolver` looks for LOS, VT, PS and VS up to two bounces at random poses (seed 3), and each path is held against the
image sources of the room as its file has it (`compare_with_path_solver`). Then the same for scenes that Sionna brings
along, opened by our reader. `back`: paths of the room that was read back beside its scene file, panel included, are
those of the room to the last bit. Seconds are CPU seconds of Sionna's side and ours together.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np
from sionna_comparison import SAMPLES, RoundTrip, compare_with_path_solver

from rislam_rt.channel.compare import random_poses
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import RadioConfig, Scene
from rislam_rt.scene import load_scene
from rislam_rt.scene.xml import scene_of_xml, sionna_scenes, write_xml
from rislam_rt.shipped import shipped_rooms

RADIO, DEPTH, SEED = RadioConfig(), 2, 3
THEIRS = ("box", "box_one_screen", "box_two_screens", "floor_wall", "double_reflector", "triple_reflector",
          "simple_street_canyon", "simple_street_canyon_with_cars")  # fmt: skip
RAYS = {"large_hall": 1_000_000}
"""With 100 000 rays Sionna finds 3359 of 3362 paths there."""
FIELDS = ("kind", "landmark", "tx_walls", "rx_walls", "valid", "tau", "gain", "vertices")


def as_written(room: Scene, folder: Path) -> tuple[Scene, bool]:
    """The room as its file alone has it, and whether the room that comes back beside its scene file has its paths."""
    write_xml(room, folder)
    file = folder / "scene.xml"
    back, _ = scene_of_xml(file, room.name)
    where = random_poses(room, 3, rng=np.random.default_rng(SEED))
    here, there = (ImageSourceChannel(scene, RADIO, DEPTH).paths(where) for scene in (room, back))
    (folder / "scene.toml").unlink()
    bare, _ = scene_of_xml(file, room.name)
    bare = replace(bare, scatterers=room.scatterers, occluders=room.occluders, agent=room.agent)
    return bare, all(np.array_equal(getattr(here, name), getattr(there, name)) for name in FIELDS)


def row(name: str, trip: RoundTrip, back: str, seconds: float) -> str:
    """A line of the table."""
    report = trip.report
    explained = ", ".join(f"{count} {reason}" for reason, count in report.explained.items()) or "0"
    share = float((report.gain_error / trip.allowed).max(initial=0.0))
    angle = max(report.aod_error.max(initial=0.0), report.aoa_error.max(initial=0.0))
    numbers = f"{report.length_error.max(initial=0.0):.1e} | {angle:.1e} | {report.gain_error_db.max(initial=0.0):.2g}"
    verdict = "yes" if trip.passed else "NO"
    return (
        f"| `{name}` | {report.matched} | {explained} | {report.unexplained} | {numbers} | {share:.0%} | {verdict} "
        f"| {back} | {seconds:.1f} |"
    )


def draw(trips: dict[str, RoundTrip], file: Path) -> None:
    """Gain errors against what Sionna's own bounce points leave open."""
    from matplotlib.figure import Figure

    from rislam_rt.report.style import save_figure, styled

    with styled():
        figure = Figure(figsize=(6.4, 4.2))
        axes = figure.subplots()
        allowed = np.concatenate([trip.allowed for trip in trips.values()])
        error = np.concatenate([trip.report.gain_error for trip in trips.values()])
        axes.loglog(allowed, np.maximum(error, 1e-9), ".", color="#0072B2", markersize=2, alpha=0.4)
        line = np.array([allowed.min(), allowed.max()])
        axes.loglog(line, line, color="black", linewidth=1, label="limit")
        axes.set_xlabel("gain error that follows from float32 bounce points, of the coherent scale")
        axes.set_ylabel("gain error found")
        axes.set_title(f"Sionna's PathSolver against image sources, {len(error)} paths of {len(trips)} scenes")
        axes.legend()
        save_figure(figure, file)


def main() -> None:
    """Print the table, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--poses", type=int, default=20)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    trips: dict[str, RoundTrip] = {}
    columns = (
        "scene", "matched", "one-sided, explained", "unexplained", "length [m]", "angle [rad]", "gain [dB]",
        "of its limit", "passed", "back", "CPU [s]",
    )  # fmt: skip
    print(f"| {' | '.join(columns)} |\n" + "| --- " * len(columns) + "|")
    with tempfile.TemporaryDirectory() as place:
        for name in (*shipped_rooms(), *(f"sionna:{their}" for their in THEIRS)):
            start, same = process_time(), "-"
            if name.startswith("sionna:"):
                file = sionna_scenes()[name.removeprefix("sionna:")]
                scene, _ = scene_of_xml(file, name.removeprefix("sionna:"))
            else:
                file = Path(place) / name / "scene.xml"
                scene, is_same = as_written(load_scene(name), file.parent)
                same = "same" if is_same else "NOT THE SAME"
            where = random_poses(scene, options.poses, rng=np.random.default_rng(SEED))
            trips[name] = compare_with_path_solver(file, scene, RADIO, where, DEPTH, RAYS.get(name, SAMPLES))
            print(row(name, trips[name], same, process_time() - start), flush=True)
    if options.figure:
        draw(trips, options.figure)


if __name__ == "__main__":
    main()
