"""Comparison of Sionna's own `PathSolver` on an exported scene file with the image-source channel: a room's round
trip."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from sionna_paths import solve_file

from rislam_rt.arrays import Floats
from rislam_rt.channel.compare.comparison_report import PathReport
from rislam_rt.channel.compare.path_matching import compare_paths
from rislam_rt.channel.compare.unmatched_paths import SHORTEST_SEGMENT
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.walls import Walls, build_walls
from rislam_rt.constants import RAY_OFFSET
from rislam_rt.model import Paths, RadioConfig, Scene, Trajectory
from rislam_rt.model.slab import slab_coefficients, slab_permittivity

SAMPLES = 100_000
"""Rays shot from each device: enough for rooms of a few dozen faces; a hall of 186 walls takes a million."""


@dataclass(frozen=True, slots=True, eq=False)
class RoundTrip:
    """Comparison of the paths that Sionna finds in a scene file with the image-source paths of the same scene."""

    report: PathReport
    allowed: Floats
    """(M,) largest gain error, of the coherent scale, that follows from Sionna's own bounce points."""

    @property
    def passed(self) -> bool:
        """Whether every one-sided path is explained, and lengths, directions and gains agree as float32 allows."""
        report, names = self.report, ("length [m]", "departure [rad]", "arrival [rad]")
        judged = [error <= limit for name, (error, limit) in report.judged.items() if name in names]
        return not report.unexplained and bool(np.all(judged) and (report.gain_error <= self.allowed).all())


def compare_with_path_solver(
    file: str | Path, scene: Scene, radio: RadioConfig, trajectory: Trajectory, depth: int, samples: int = SAMPLES
) -> RoundTrip:
    """Compare the paths that Sionna's `PathSolver` finds in a scene file with the image-source paths of `scene`, one by
    one.

    `samples` rays are shot from each device: candidates are found at random, more rays find more of them. The panel is
    left out, and so are scatterers with an occluding mesh: it hides its own centre from Sionna.
    """
    alone = tuple(s for s in scene.scatterers if s.shade is None)
    hiding = tuple(replace(s.shade, name=s.name) for s in scene.scatterers if s.shade is not None)
    scene = replace(scene, ris=None, scatterers=alone, occluders=(*scene.occluders, *hiding))
    solved = solve_file(file, scene, radio, trajectory, depth, samples)
    exact = ImageSourceChannel(scene, radio, depth).paths(trajectory)
    report = compare_paths(solved, exact, scene, trajectory, radio=radio, shortest_segment=SHORTEST_SEGMENT)
    return RoundTrip(report, report.limits.gain + vertex_errors(exact, report, scene, radio, trajectory))


def vertex_errors(exact: Paths, report: PathReport, scene: Scene, radio: RadioConfig, trajectory: Trajectory) -> Floats:
    """Gain error (M,) of matched paths that follows from the float32 rounding of Sionna's bounce points.

    Sionna evaluates its materials along the segments between its own bounce points. Those lie up to
    `RAY_OFFSET (1 m + E + L)` off, E being the largest coordinate in the file: so a segment is turned by that over its
    length, and the coefficients at either end of it are those of another angle.
    """
    walls, extent = build_walls(scene), float(np.abs(scene.bounds).max())
    label = {exact.label(p): p for p in range(exact.num_paths)}
    found = np.zeros(report.matched)
    for row, (cycle, path) in enumerate(zip(report.cycle, report.path, strict=True)):
        p = label[report.labels[path]]
        ends = trajectory.tx[cycle], exact.vertices[cycle, p, : exact.num_vertices[p]], trajectory.rx[cycle]
        _, landmark, tx, rx = exact.identity(p)
        met = [*tx, *([-1] if landmark >= 0 else []), *rx]
        found[row] = _turned(np.vstack(ends), met, walls, radio, extent)
    return found


def _turned(points: Floats, met: list[int], walls: Walls, radio: RadioConfig, extent: float) -> float:
    """Relative gain error of a path through `points` (V + 2, 3) [m] whose segments are turned at each bounce on the
    walls `met` (-1 for a landmark)."""
    along = np.diff(points, axis=0)
    length = np.linalg.norm(along, axis=1)
    off = RAY_OFFSET * (1.0 + extent + length.sum())
    total = 0.0
    for bounce, wall in enumerate(met):
        turn = min(off * (1.0 / length[bounce] + 1.0 / length[bounce + 1]), 0.5 * np.pi)
        if wall < 0:
            continue
        angle = np.arccos(np.clip(abs(along[bounce] @ walls.normal[wall]) / length[bounce], 0.0, 1.0))
        material = walls.material[wall]
        cosine = np.cos(np.clip(angle + turn * np.linspace(-1.0, 1.0, 21), 0.0, 0.5 * np.pi))
        coefficients = np.stack(
            slab_coefficients(
                cosine,
                np.array(slab_permittivity(material, radio.carrier)),
                np.array(material.thickness),
                radio.carrier,
            )
        )
        change = np.abs(coefficients - coefficients[:, 10:11]).max()
        total += float(change) + 2.0 * turn  # and the plane of incidence turns at both ends
    return total
