"""The agent's own images: what lies behind a wall, as its wall returns tell."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Body
from rislam_rt.slam.book import Book
from rislam_rt.slam.moments import Moments, poses_of
from rislam_rt.slam.returns import reflect
from rislam_rt.slam.tracks import Tracks

MIRROR_CYCLES = 3
"""Measurements of a wall return before it is held against points."""


def mirror_images(tracks: Tracks, moments: Moments, book: Book, body: Body) -> Floats:
    """Images (V, 3) [m] of the agent, from the wall returns that are followed now and from the walls of the map."""
    rows = np.flatnonzero(tracks.specular & (tracks.misses == 0) & (tracks.length >= MIRROR_CYCLES))
    seen = tracks.mean[rows, :, 0]
    poses = poses_of(moments.position, np.asarray(moments.heading), body)
    shown = poses.rx + seen[:, :1] * rays(seen, poses.heading)
    walls = book.walls
    held = reflect(moments.position, moments.features[walls], book.anchor[walls])
    return np.concatenate([shown, held.reshape(-1, 3)])


def rays(seen: Floats, heading: Floats) -> Floats:
    """Unit vectors (..., 3) towards what arrives from above with lengths and cosines (..., 3), in the room's axes."""
    flat = seen[..., 1:] / np.maximum(1.0, np.linalg.norm(seen[..., 1:], axis=-1))[..., None]
    up = np.sqrt(np.maximum(1.0 - np.sum(flat**2, axis=-1), 0.0))
    return np.concatenate([flat, up[..., None]], axis=-1) @ rotation_z(np.asarray(heading)).T


def is_behind_mirror(point: Floats, agent: Floats, mirrored: Floats, margin: float) -> bool:
    """Whether a point (3,) lies nearer, by a margin [m], to an image (V, 3) of the agent (3,) than to the agent.

    No way over walls is shorter than the straight one, so that nothing in the room does: such a point is itself an
    image, of something not yet found. Where walls end short, a point beside one has to wait until that wall's return
    is gone.
    """
    direct = np.linalg.norm(point - agent)
    return bool((np.linalg.norm(point - mirrored, axis=1) < direct - margin).any())
