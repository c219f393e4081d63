"""Both channels of one scene at the same random poses."""

import numpy as np

from rislam_rt.channel.compare.match import compare_paths
from rislam_rt.channel.compare.poses import random_poses
from rislam_rt.channel.compare.report import PathReport
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import Paths, RadioConfig, RisCode, Scene, Trajectory


def compare_channels(
    scene: Scene, radio: RadioConfig, *, poses: int, depth: int, rng: np.random.Generator
) -> PathReport:
    """Trace and compute `poses` random poses, with the panel at one random code, and compare path by path."""
    traced, analytic, trajectory = trace_both(scene, radio, poses=poses, depth=depth, rng=rng)
    return compare_paths(traced, analytic, scene, trajectory)


def trace_both(
    scene: Scene, radio: RadioConfig, *, poses: int, depth: int, rng: np.random.Generator
) -> tuple[Paths, Paths, Trajectory]:
    """Traced and analytic paths at random poses, under the same random code, and the poses."""
    from rislam_rt.channel.traced import TracedChannel  # starting the tracer takes seconds

    trajectory = random_poses(scene, poses, rng=rng)
    channels = TracedChannel(scene, radio, depth), ImageSourceChannel(scene, radio, depth)
    traced, analytic = (channel.paths(trajectory) for channel in channels)
    if scene.ris is not None:
        spec = scene.ris.spec
        code = RisCode(rng.integers(spec.levels, size=(spec.rows, spec.cols)), spec.levels)
        traced, analytic = channels[0].respond(traced, code), channels[1].respond(analytic, code)
    return traced, analytic, trajectory
