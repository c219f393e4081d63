"""Welded mesh, whose triangles share their corners: those of its parts joined where they are nearly the same."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from rislam_rt.arrays import Floats, Integers
from rislam_rt.geometry.connected_parts import connected
from rislam_rt.geometry.triangles import triangle_heights

WELD = 2e-5
"""Distance [m] of corners below which they are one: what float32 leaves open in a file of 100 m."""


class Welded(NamedTuple):
    """A welded mesh, whose triangles share their corners."""

    vertices: Floats
    """(V, 3) [m]."""
    faces: Integers
    """(F, 3) indices into `vertices`."""
    part: Integers
    """(F,) part of the file that each comes from."""


def weld(triangles: list[Floats]) -> Welded:
    """Weld parts (T, 3, 3) [m] of a mesh at common corners, without doubles and triangles without area."""
    corners = np.concatenate([t.reshape(-1, 3) for t in triangles])
    part = np.repeat(np.arange(len(triangles)), [len(t) for t in triangles])
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    pairs = cKDTree(vertices).query_pairs(WELD, output_type="ndarray")
    group = connected(pairs, len(vertices))
    _, first = np.unique(group, return_index=True)
    vertices, faces = vertices[first], group[index.ravel()].reshape(-1, 3)
    _, single = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    keep = np.intersect1d(np.flatnonzero(triangle_heights(vertices[faces]) > WELD), single)
    return Welded(vertices, faces[keep], part[keep])
