"""Image-source channel against two independent constructions: the lattice of a box, and brute force in any room."""

from itertools import pairwise, product

import numpy as np
import pytest

from rislam_rt.arrays import cross
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.walls import build_walls
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import PathKind, RadioConfig


def lattice(tx, rx, size, depth):
    """Lengths and bounce counts of all image paths in a box, from the closed form of its image lattice."""
    axes = []
    for t, r, edge in zip(tx, rx, size, strict=True):
        even = [(2 * m * edge + t - r, abs(2 * m)) for m in range(-depth, depth + 1)]
        odd = [(2 * m * edge - t - r, abs(2 * m - 1)) for m in range(-depth, depth + 1)]
        axes.append(even + odd)
    found = [
        (np.hypot(np.hypot(a, b), c), i + j + k) for (a, i), (b, j), (c, k) in product(*axes) if i + j + k <= depth
    ]
    return sorted(found)


@pytest.mark.parametrize(("depth", "count"), [(0, 1), (1, 7), (2, 25), (3, 63)])
def test_a_box_has_the_paths_of_its_image_lattice(rooms, depth, count):
    scene, radio = rooms.paper(), RadioConfig()
    trajectory = rooms.at(np.random.default_rng(1).uniform(0.2, 2.8, (20, 3)))
    paths = ImageSourceChannel(scene, radio, depth).paths(trajectory)
    direct = paths.landmark < 0
    assert (paths.valid[:, direct].sum(axis=1) == count).all()
    for cycle in range(20):
        columns = np.flatnonzero(direct & paths.valid[cycle])
        want = lattice(trajectory.tx[cycle], trajectory.rx[cycle], (6.0, 6.0, 3.0), depth)
        order = columns[np.argsort(paths.tau[cycle, columns])]
        lengths = np.array([length for length, _ in want])
        np.testing.assert_allclose(paths.tau[cycle, order] * SPEED_OF_LIGHT, lengths, rtol=1e-13)
        bounces = np.array([b for _, b in want])
        np.testing.assert_array_equal(paths.num_vertices[order], bounces)
        gain = (
            radio.wavelength * 0.85**bounces / (4 * np.pi * lengths) * np.exp(-2j * np.pi / radio.wavelength * lengths)
        )
        # phase: 2 pi / lambda times the rounding of some 10 m
        np.testing.assert_allclose(paths.gain[cycle, order], gain, rtol=1e-10)


def ray_hits(start, end, triangles):
    """Moeller-Trumbore: fractions of the segment at which it meets those of the triangles (T, 3, 3) that it meets."""
    edge1, edge2, ray = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0], end - start
    p = cross(ray, edge2)
    det = np.sum(edge1 * p, axis=1)
    crossed = np.abs(det) >= 1e-14
    s, det = start - triangles[:, 0], np.where(crossed, det, 1.0)
    q = cross(s, edge1)
    u, v, t = np.sum(s * p, axis=1) / det, q @ ray / det, np.sum(edge2 * q, axis=1) / det
    inside = crossed & (u >= -1e-10) & (v >= -1e-10) & (u + v <= 1 + 1e-10)
    return t[inside & (t > 1e-9) & (t < 1 - 1e-9)]


def brute_force(walls, device, far, depth, host=-1):
    """Every wall sequence tried one by one; the result maps sequences to bounce points."""
    found = {}
    for bounces in range(depth + 1):
        for sequence in product(range(len(walls)), repeat=bounces):
            if any(a == b for a, b in pairwise(sequence)) or sequence[-1:] == (host,):
                continue
            points = trace(walls, sequence, device, far)
            if points is not None:
                found[sequence] = points
    return found


def trace(walls, sequence, device, far):
    """Bounce points of one sequence, or None."""
    images = [device]
    for wall in sequence:
        n = walls.normal[wall]
        images.append(images[-1] - 2 * (images[-1] @ n - walls.offset[wall]) * n)
    points = [far]
    for wall, image in zip(sequence[::-1], images[:0:-1], strict=True):
        hits = ray_hits(points[0], image, walls.triangles[walls.wall_of_triangle == wall])
        if not len(hits):
            return None
        points.insert(0, points[0] + hits[0] * (image - points[0]))
    points.insert(0, device)
    for start, end in pairwise(points):
        if len(ray_hits(start, end, walls.triangles)):
            return None
    return points[1:-1]


@pytest.mark.parametrize("name", ["paper", "l_shape", "parted"])
def test_brute_force_finds_the_same_paths(rooms, name):
    scene, depth = getattr(rooms, name)(), 2
    walls = build_walls(scene)
    trajectory = rooms.at([[1.1, 2.3, 1.2], [2.4, 4.7, 0.5], [2.61, 3.2, 1.9]])
    paths = ImageSourceChannel(scene, RadioConfig(), depth).paths(trajectory)
    for cycle, (tx, rx) in enumerate(zip(trajectory.tx, trajectory.rx, strict=True)):
        points = brute_force(walls, tx, rx, depth)
        want = {(-1, s, ()) for s in points}
        for number, point in enumerate(scene.landmark_positions):
            host = walls.hosts[0] if number == len(scene.scatterers) else -1
            out = brute_force(walls, tx, point, depth, host)
            back = brute_force(walls, rx, point, depth, host)
            want |= {(number, a, b[::-1]) for a in out for b in back if len(a) + len(b) <= depth}
        columns = np.flatnonzero(paths.valid[cycle])
        assert {paths.identity(p)[1:] for p in columns} == want
        for p in columns:
            if paths.landmark[p] < 0 and paths.kind[p] == PathKind.VT:
                vertices = paths.vertices[cycle, p, : paths.num_vertices[p]]
                np.testing.assert_allclose(vertices, points[paths.identity(p)[2]], atol=1e-12)


@pytest.mark.parametrize("name", ["paper", "l_shape", "parted"])
def test_every_path_obeys_the_law_of_reflection(rooms, name):
    scene = getattr(rooms, name)()
    walls = build_walls(scene)
    trajectory = rooms.at(np.random.default_rng(5).uniform(0.3, 2.7, (5, 3)))
    paths = ImageSourceChannel(scene, RadioConfig(), 2).paths(trajectory)
    assert paths.valid.any(axis=0).all()
    for cycle, p in np.argwhere(paths.valid):
        count = paths.num_vertices[p]
        points = np.vstack([trajectory.tx[cycle], paths.vertices[cycle, p, :count], trajectory.rx[cycle]])
        rays = np.diff(points, axis=0)
        lengths = np.linalg.norm(rays, axis=1)
        assert lengths.sum() == pytest.approx(paths.tau[cycle, p] * SPEED_OF_LIGHT, abs=1e-12)
        rays /= lengths[:, None]
        np.testing.assert_allclose(paths.departure[cycle, p], rays[0], atol=1e-9)
        np.testing.assert_allclose(paths.arrival[cycle, p], -rays[-1], atol=1e-9)
        _, _, tx_walls, rx_walls = paths.identity(p)
        order = list(tx_walls) + ([None] if paths.landmark[p] >= 0 else []) + list(rx_walls)
        for vertex, wall in enumerate(order):
            if wall is not None:
                n = walls.normal[wall]
                assert abs(points[vertex + 1] @ n - walls.offset[wall]) < 1e-12
                np.testing.assert_allclose(rays[vertex] - 2 * (rays[vertex] @ n) * n, rays[vertex + 1], atol=1e-9)
