"""Are paths lost where wall sequences are too many to try, and what does looking for them cost?

    python benchmarks/channel/wall_sequences.py              everything; some minutes
    python benchmarks/channel/wall_sequences.py --quick      the hall's ratio and the spheres alone

(a) All ten rooms and random ones: the paths of mirrored beams (image sources) and of cones (tracer) against all wall
sequences, each at random poses and along a walk; what either lacks is counted. (b) `large_hall`, 60 cycles, two
bounces: CPU time of the image sources over that of the tracer, first and second call. (c) Spheres of more and more
facets in the paper's room, two bounces: walls, paths on both sides and CPU seconds, and by all sequences where that
ends.
Seconds are CPU seconds of the process.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from rislam_rt.channel.compare import compare_paths, random_poses
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.traced import TracedChannel, shortest_segment, wall_sequences
from rislam_rt.model import Material, Paths, RadioConfig, Reflector, Scene, Trajectory
from rislam_rt.scene import load_scene

RADIO = RadioConfig()
SCENES = Path(__file__).parents[2] / "scenes"
ALWAYS, NEVER = 0, 10**12
"""Values of `sequences.MANY`: cones in every room, or in none."""

CENTER = np.array([3.8, 2.1, 0.6])
RINGS = [(16, 20), (24, 24), (36, 36), (51, 52)]


def timed(channel: Any, trajectory: Trajectory) -> tuple[Any, float]:
    """A channel's paths and its CPU seconds."""
    start = process_time()
    result = channel.paths(trajectory)
    return result, process_time() - start


def identities(paths: Paths) -> set[Any]:
    """Every path of every cycle."""
    return {(int(k), *paths.identity(int(p))) for k, p in np.argwhere(paths.valid)}


def cut(agent: Trajectory, cycles: Any) -> Trajectory:
    """Some cycles of a motion."""
    parts = {name: getattr(agent, name)[cycles] for name in ("time", "position", "velocity", "heading")}
    return replace(agent, **parts)


def lost(scene: Scene, trajectory: Trajectory, depth: int) -> list[int]:
    """Number of paths by all sequences; how many beams and cones lack, and have besides."""
    image = {how: ImageSourceChannel(scene, RADIO, depth, how).paths(trajectory) for how in ("exhaustive", "beams")}
    channel, traced = TracedChannel(scene, RADIO, depth), {}
    for how, many in (("exhaustive", NEVER), ("cones", ALWAYS)):
        wall_sequences.MANY = many
        traced[how] = channel.paths(trajectory)
    wall_sequences.MANY = 100_000
    every, beams = identities(image["exhaustive"]), identities(image["beams"])
    asked, cones = identities(traced["exhaustive"]), identities(traced["cones"])
    return [len(every), len(every - beams), len(beams - every), len(asked), len(asked - cones), len(cones - asked)]


def random_rooms(count: int) -> Iterator[Scene]:
    """The paper's room with a dozen plates in any attitude."""
    paper = load_scene(SCENES / "paper_room")
    for seed in range(count):
        rng = np.random.default_rng([15, seed])
        plates = []
        for number in range(12):
            frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            corners = rng.uniform([0.5, 0.5, 0.3], [5.5, 5.5, 2.5]) + rng.normal(0.0, 0.5, (4, 2)) @ frame[:2]
            faces = np.array([[0, 1, 2], [0, 2, 3]])
            plates.append(Reflector(f"plate{number}", corners, faces, Material(reflection=0.5)))
        yield replace(paper, reflectors=(*paper.reflectors, *plates), name=f"random {seed}")


def print_losses() -> None:
    """(a)."""
    print("room: paths by all sequences, lost by beams, besides | by the tracer, lost by cones, besides")
    total = np.zeros(6, dtype=int)
    rooms = [load_scene(path.parent) for path in sorted(SCENES.glob("*/scene.toml"))]
    for scene in [*rooms, *random_rooms(20)]:
        depth = 2 if scene.name in ("large_hall", "office") else 3
        row = np.zeros(6, dtype=int)
        walk = cut(scene.agent, np.linspace(0, len(scene.agent) - 1, 12).astype(int))
        for trajectory in (random_poses(scene, 10, rng=np.random.default_rng(5)), walk):
            row += lost(scene, trajectory, depth)
        total += row
        print(f"{scene.name}: {row[0]} {row[1]} {row[2]} | {row[3]} {row[4]} {row[5]}", flush=True)
    print(f"all: {total[0]} paths, beams lose {total[1]}; {total[3]} traced, cones lose {total[4]}")


def print_hall() -> None:
    """(b)."""
    scene = load_scene(SCENES / "large_hall")
    TracedChannel(scene, RADIO, 2).paths(cut(scene.agent, slice(0, 2)))  # compiles the tracer's kernels
    last = len(scene.agent) - 1
    for name, cycles in (("first 60", np.arange(60)), ("60 of all", np.linspace(0, last, 60).astype(int))):
        walk = cut(scene.agent, cycles)
        traced, image = TracedChannel(scene, RADIO, 2), ImageSourceChannel(scene, RADIO, 2)
        for call in ("cold", "warm"):
            (a, slow), (b, fast) = timed(image, walk), timed(traced, walk)
            print(
                f"large_hall, {name} cycles, {call}: image sources {slow:.2f} s, tracer {fast:.2f} s, ratio "
                f"{slow / fast:.1f}; paths {a.valid.sum()}, {b.valid.sum()}",
                flush=True,
            )


def print_spheres(poses: int) -> None:
    """(c)."""
    import trimesh

    paper = load_scene(SCENES / "paper_room")
    for rings in RINGS:
        mesh = trimesh.creation.uv_sphere(radius=0.35, count=rings)
        vertices = (np.asarray(mesh.vertices) + CENTER).astype(np.float32).astype(np.float64)
        ball = Reflector("ball", vertices, np.asarray(mesh.faces), Material(reflection=0.5))
        scene = replace(paper, reflectors=(*paper.reflectors, ball))
        trajectory = random_poses(scene, poses, rng=np.random.default_rng(1))
        traced, image = TracedChannel(scene, RADIO, 2), ImageSourceChannel(scene, RADIO, 2)
        (a, cones), (b, beams) = timed(traced, trajectory), timed(image, trajectory)
        report = compare_paths(a, b, scene, trajectory, shortest_segment=shortest_segment(scene))
        text = f"{len(ball.faces)} triangles, {len(image.walls)} walls, {poses} poses: traced {a.valid.sum()} paths"
        text += f" in {cones:.2f} s, image sources {b.valid.sum()} in {beams:.2f} s, unexplained {report.unexplained}"
        if len(image.walls) < 700:
            every, seconds = timed(ImageSourceChannel(scene, RADIO, 2, "exhaustive"), trajectory)
            text += f"; all sequences {seconds:.1f} s, lost {len(identities(every) - identities(b))}"
        print(text, flush=True)


def main() -> None:
    """Answer on the terminal."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="ratio and spheres alone")
    parser.add_argument("--poses", type=int, default=4, help="random poses about the spheres")
    options = parser.parse_args()
    print_hall()
    print_spheres(options.poses)
    if not options.quick:
        print_losses()


if __name__ == "__main__":
    main()
