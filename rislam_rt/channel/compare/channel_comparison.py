"""Both channels of a scene, ray-traced and image-source, run at the same random poses and compared."""

import zlib
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from rislam_rt.channel.compare.comparison_report import PathReport
from rislam_rt.channel.compare.path_matching import compare_paths
from rislam_rt.channel.compare.poses import random_poses
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import Paths, RadioConfig, RisCode, Scene, Trajectory


class Validation(NamedTuple):
    """Comparison of the ray-traced and the image-source channel in one room."""

    scene: str
    depth: int
    numbers: str
    """Precision of the traced paths: `traced` (the tracer's float32) or `refined` (float64)."""
    report: PathReport


def compare_channels(
    scene: Scene, radio: RadioConfig, *, poses: int, depth: int, rng: np.random.Generator, refine: bool = True
) -> PathReport:
    """Compare the ray-traced with the image-source channel path by path, at random poses and under one random code.

    By default the channel as its users get it, its numbers refined in float64 on the facets that the tracer named;
    without `refine` the tracer's own float32 numbers.
    """
    from rislam_rt.channel.traced.float32_limits import shortest_segment

    traced, analytic, trajectory = trace_both(scene, radio, poses=poses, depth=depth, rng=rng, refine=refine)
    return compare_paths(traced, analytic, scene, trajectory, radio=radio, shortest_segment=shortest_segment(scene))


def trace_both(
    scene: Scene, radio: RadioConfig, *, poses: int, depth: int, rng: np.random.Generator, refine: bool = True
) -> tuple[Paths, Paths, Trajectory]:
    """Ray-traced and image-source paths of a scene at random poses, under the same random panel code, and the poses."""
    from rislam_rt.channel.traced import TracedChannel  # starting the tracer takes seconds

    trajectory = random_poses(scene, poses, rng=rng)
    channels = TracedChannel(scene, radio, depth, refine=refine), ImageSourceChannel(scene, radio, depth)
    traced, analytic = (channel.paths(trajectory) for channel in channels)
    if scene.ris is not None:
        spec = scene.ris.spec
        code = RisCode(rng.integers(spec.levels, size=(spec.rows, spec.cols)), spec.levels)
        traced, analytic = channels[0].respond(traced, code), channels[1].respond(analytic, code)
    return traced, analytic, trajectory


def validate_rooms(
    rooms: Iterable[tuple[Scene, int]], radio: RadioConfig, *, poses: int, seed: int
) -> list[Validation]:
    """Compare ray-traced and image-source channel in several rooms, each with its depth, in float32 and refined.

    A room's poses depend on seed and name alone.
    """
    rows = []
    for scene, depth in rooms:
        for refine in (False, True):
            rng = room_rng(scene, seed)
            report = compare_channels(scene, radio, poses=poses, depth=depth, rng=rng, refine=refine)
            rows.append(Validation(scene.name, depth, "refined" if refine else "traced", report))
    return rows


def room_rng(scene: Scene, seed: int) -> np.random.Generator:
    """Random generator of a room's poses for comparison, from the seed and the room's name."""
    return np.random.default_rng([seed, zlib.crc32(scene.name.encode())])
