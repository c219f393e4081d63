"""Mirror images of the agent: what lies behind a wall, as its wall returns tell."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import Body
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.nested.belief_moments import Moments
from rislam_rt.slam.nested.landmark_table import LandmarkTable
from rislam_rt.slam.nested.tracks import LandmarkTracks
from rislam_rt.slam.returns import reflect
from rislam_rt.slam.ris_candidate import rays

MIRROR_CYCLES = 3
"""Measurements of a wall return before it is held against points."""


def mirror_images(tracks: LandmarkTracks, moments: Moments, table: LandmarkTable, body: Body) -> Floats:
    """Images (V, 3) [m] of the agent, from the wall returns that are followed now and from the walls of the map."""
    rows = np.flatnonzero(tracks.specular & (tracks.misses == 0) & (tracks.length >= MIRROR_CYCLES))
    seen = tracks.mean[rows, :, 0]
    poses = poses_of(moments.position, np.asarray(moments.heading), body)
    shown = poses.rx + seen[:, :1] * rays(seen, poses.heading)
    walls = table.walls
    held = reflect(moments.position, moments.features[walls], table.anchor[walls])
    return np.concatenate([shown, held.reshape(-1, 3)])


def is_behind_mirror(point: Floats, agent: Floats, mirrored: Floats, margin: float) -> bool:
    """Whether a point (3,) lies nearer, by a margin [m], to an image (V, 3) of the agent (3,) than to the agent.

    No way over walls is shorter than the straight one, so that nothing in the room does: such a point is itself an
    image, of something not yet found. Where walls end short, a point beside one has to wait until that wall's return
    is gone.
    """
    direct = np.linalg.norm(point - agent)
    return bool((np.linalg.norm(point - mirrored, axis=1) < direct - margin).any())
