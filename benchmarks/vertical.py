"""Is the traced field right where rays are vertical? Gains against image sources, path by path. A table in Markdown.

A hall of 60 x 50 x 40 m and a room of 6 x 6 x 3 m, each with walls of constant reflection and with slabs; a sphere and
a panel on the ceiling. Agents at and around the panel's nadir: the midpoint or the Tx exactly below its centre, or off
by up to 0.3 m; baselines of 1e-6 to 0.05 m, level at azimuths all round, and vertical. Depth 2, so that legs without a
bounce, off the floor, off the ceiling, and between the two are among the paths. Errors are of the complex gain for
refined numbers, of its magnitude for the tracer's own float32 (whose lengths turn the phase).
Run: `python benchmarks/vertical.py [--azimuths 12]`.
"""

import argparse
from collections import Counter
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.compare import compare_paths
from rislam_rt.channel.compare.explanation import Identity
from rislam_rt.channel.compare.match import named_identity
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.traced import TracedChannel, shortest_segment
from rislam_rt.model import (
    Body,
    Material,
    PathKind,
    Paths,
    RadioConfig,
    Reflector,
    RisCode,
    RisPanel,
    RisSpec,
    Scatterer,
    Scene,
    Trajectory,
)

RADIO = RadioConfig()
BASELINES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 5e-2)
OFFSETS = (0.0, 1e-6, 1e-4, 3e-3, 0.3)
ROOMS = {"hall": (60.0, 50.0, 40.0), "room": (6.0, 6.0, 3.0)}
MATERIALS = {"R = 0.85": Material(reflection=0.85), "concrete": Material(itu="concrete", thickness=0.2)}


class Errors(NamedTuple):
    """Relative gain errors (N,) of matched paths by group, and one-sided paths."""

    plain: Floats
    panel: Floats
    """Against the sum of all elements' magnitudes: a null has no relative error."""
    explained: int
    """Paths of one side with a proof from the geometry; most are double bounces in a corner, met by a tiny baseline."""
    failed: int
    """Paths of one side without one, and errors beyond the limits of `compare`."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--azimuths", type=int, default=12)
    azimuths = parser.parse_args().azimuths
    columns = ["room", "walls", "numbers", "paths", "largest error", "panel paths", "largest error"]
    columns += ["one-sided, explained", "failed"]
    print(f"| {' | '.join(columns)} |")
    print(f"|{' --- |' * len(columns)}")
    count: Counter[str] = Counter()
    for room, size in ROOMS.items():
        for walls, material in MATERIALS.items():
            scene = build_room(np.array(size), material)
            poses = list(all_poses(scene, azimuths))
            for refine in (True, False):
                found = errors(scene, poses, refine=refine)
                numbers = "refined" if refine else "float32"
                count[numbers] += len(found.plain) + len(found.panel)
                print(
                    f"| {room} | {walls} | {numbers} | {len(found.plain)} | {found.plain.max():.1e} "
                    f"| {len(found.panel)} | {found.panel.max():.1e} | {found.explained} | {found.failed} |"
                )
    print()
    print(", ".join(f"{number} paths with {numbers} numbers" for numbers, number in count.items()))


def build_room(size: Floats, material: Material) -> Scene:
    """A box with a sphere off its middle and the paper's panel in the middle of its ceiling."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size
    quads = {
        "floor": (0, 2, 6, 4), "ceiling": (1, 5, 7, 3), "x0": (0, 1, 3, 2), "x1": (4, 6, 7, 5),
        "y0": (0, 4, 5, 1), "y1": (2, 3, 7, 6),
    }  # fmt: skip
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    walls = tuple(Reflector(name, corners[list(quad)], faces, material) for name, quad in quads.items())
    spec = RisSpec(6, 6, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
    panel = RisPanel(spec, size * [0.5, 0.5, 1.0], "ceiling")
    sphere = Scatterer("sphere", size * [0.3, 0.2, 0.4], np.pi * 0.05**2, 0.05)
    still = Trajectory(np.zeros(1), size[None] / 2.0, np.zeros((1, 3)), np.zeros(1), Body(np.zeros(3), np.ones(3)))
    return Scene("box", walls, (sphere,), panel, still)


def all_poses(scene: Scene, azimuths: int) -> list[Trajectory]:
    """One trajectory a baseline and direction: azimuths all round, at and around the nadir, at two heights."""
    assert scene.ris is not None
    nadir, top = scene.ris.center * [1.0, 1.0, 0.0], scene.ris.center[2]
    turns = 2.0 * np.pi * (np.arange(azimuths) + 0.1) / azimuths
    turns = np.concatenate([turns, [0.0, 0.5 * np.pi]])  # along the axes too
    found = []
    for baseline in BASELINES:
        for level in (True, False):
            half = 0.5 * baseline * np.array([1.0, 0.0, 0.0] if level else [0.0, 0.0, 1.0])
            off, turn, below = (part.ravel() for part in np.meshgrid(OFFSETS, turns, [0.0, 1.0], indexing="ij"))
            heading = turn if level else np.zeros_like(turn)
            around = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
            # every other pose has not the midpoint but the Tx there
            shift = off + below * (0.5 * baseline if level else 0.0)
            height = np.where(below > 0.0, 0.13, 0.52) * top
            position = nadir + shift[:, None] * around + height[:, None] * [0.0, 0.0, 1.0]
            count = len(position)
            found.append(
                Trajectory(np.arange(float(count)), position, np.zeros((count, 3)), heading, Body(-half, half))
            )
    return found


def errors(scene: Scene, poses: list[Trajectory], *, refine: bool) -> Errors:
    """Both channels at all poses."""
    traced, analytic = TracedChannel(scene, RADIO, 2, refine=refine), ImageSourceChannel(scene, RADIO, 2)
    assert scene.ris is not None
    spec = scene.ris.spec
    code = RisCode(np.random.default_rng(3).integers(spec.levels, size=(spec.rows, spec.cols)), spec.levels)
    plain, panel, explained, failed = [], [], 0, 0
    for motion in poses:
        ours, exact = (channel.respond(channel.paths(motion), code) for channel in (traced, analytic))
        mine, theirs = (by_identity(paths) for paths in (ours, exact))
        shared = [(mine[key], theirs[key]) for key in mine.keys() & theirs.keys()]
        i, j = (np.array(columns) for columns in zip(*shared, strict=True))
        cycle, pair = np.nonzero(ours.valid[:, i] & exact.valid[:, j])
        found, wanted = ours.gain[cycle, i[pair]], exact.gain[cycle, j[pair]]
        miss = np.abs(found - wanted) if refine else np.abs(np.abs(found) - np.abs(wanted))
        is_panel = np.isin(exact.kind[j[pair]], [PathKind.RIS, PathKind.VRIS])
        scale = np.abs(wanted)
        scale[is_panel] = element_sum(exact, cycle[is_panel], j[pair][is_panel])
        plain.append((miss / scale)[~is_panel])
        panel.append((miss / scale)[is_panel])
        report = compare_paths(ours, exact, scene, motion, radio=RADIO, shortest_segment=shortest_segment(scene))
        explained += sum(report.explained.values())
        failed += report.unexplained + report.num_breaches
    return Errors(np.concatenate(plain), np.concatenate(panel), explained, failed)


def by_identity(paths: Paths) -> dict[Identity, int]:
    """Columns by identity in names."""
    return {named_identity(paths, path): path for path in range(paths.num_paths)}


def element_sum(paths: Paths, cycle: Integers, path: Integers) -> Floats:
    """Sum (N,) of the magnitudes that the panel's elements contribute."""
    assert paths.ris is not None
    tx, rx = paths.ris.tx[cycle, paths.ris.tx_leg[path]], paths.ris.rx[cycle, paths.ris.rx_leg[path]]
    return np.abs(tx * rx).sum(axis=(1, 2))


if __name__ == "__main__":
    main()
