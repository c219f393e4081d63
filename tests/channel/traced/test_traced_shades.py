"""Scatterers that hide what lies behind them, except their own centre."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rislam_rt.channel.compare.path_matching import named_identity
from rislam_rt.channel.traced import TracedChannel
from rislam_rt.model import Occluder, PathKind, RadioConfig
from rislam_rt.scene.shapes import sphere_mesh

RADIO = RadioConfig()
RADIUS = 0.3


@pytest.fixture(scope="module")
def rooms_and_paths(rooms):
    """The paper's room with a second scatterer, without and with a large dark sphere about the first, at some poses."""
    bare = rooms.paper()
    other = replace(bare.scatterers[0], name="other", position=np.array([4.5, 3.5, 1.4]))
    bare = replace(bare, scatterers=(bare.scatterers[0], other))
    shade = Occluder(*sphere_mesh(bare.scatterers[0].position, RADIUS))
    dark = replace(bare, scatterers=(replace(bare.scatterers[0], shade=shade), other))
    trajectory = rooms.at([[1.3, 2.1, 0.8], [0.8, 0.5, 1.1], [3.1, 1.2, 0.9], [2.1, 0.4, 2.2]])
    return [(scene, TracedChannel(scene, RADIO, 2).paths(trajectory)) for scene in (bare, dark)], trajectory


def legs_of(paths, cycle, path, tx, rx):
    """Polylines from either device to the landmark, or the one from Tx to Rx."""
    points = [tx[cycle], *paths.vertices[cycle, path, : paths.num_vertices[path]], rx[cycle]]
    middle = 1 + int((paths.tx_walls[path] >= 0).sum())
    return [points] if paths.landmark[path] < 0 else [points[: middle + 1], points[middle:][::-1]]


def distance_to_center(start, end, center):
    """Smallest distance of a segment from a point."""
    along = end - start
    fraction = np.clip((center - start) @ along / (along @ along), 0.0, 1.0)
    return np.linalg.norm(start + fraction * along - center)


def test_dark_sphere_takes_exactly_what_it_hides(rooms_and_paths):
    """A path goes if, and only if, one of its segments meets the sphere, the last one to its own centre excepted."""
    ((bare, before), (_, after)), trajectory = rooms_and_paths
    center = bare.scatterers[0].position
    names = {named_identity(after, p): p for p in range(after.num_paths)}
    gone = stayed = 0
    for cycle, path in np.argwhere(before.valid):
        clearance = np.inf
        for leg in legs_of(before, cycle, path, trajectory.tx, trajectory.rx):
            spare = before.landmark[path] == 0
            segments = list(pairwise(leg))[: -1 if spare else None]
            clearance = min([clearance, *(distance_to_center(a, b, center) for a, b in segments)])
        identity = named_identity(before, path)
        there = identity in names and bool(after.valid[cycle, names[identity]])
        if abs(clearance - RADIUS) < 0.02 * RADIUS:  # the mesh's outline is off the sphere's by up to 2 %
            continue
        assert there == (clearance > RADIUS), before.label(path)
        gone, stayed = gone + (not there), stayed + there
    assert gone > 50
    assert stayed > 500
    assert set(after.kind) == set(PathKind)


def test_shades_reflect_nothing(rooms_and_paths):
    ((_, before), (dark, after)), _ = rooms_and_paths
    assert after.walls == before.walls == TracedChannel(dark, RADIO, 1).walls.names
    assert {named_identity(after, p) for p in range(after.num_paths)} <= {
        named_identity(before, p) for p in range(before.num_paths)
    }
