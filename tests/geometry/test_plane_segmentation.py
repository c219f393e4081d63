"""Flat parts of meshes, and which lie on each other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rislam_rt.constants import COPLANAR_ANGLE, COPLANAR_OFFSET, RAY_OFFSET
from rislam_rt.geometry.coplanar import overlap, stack_walls, tracer_gap
from rislam_rt.geometry.plane_segmentation import fit_plane, planar_regions

LIMITS = COPLANAR_ANGLE, COPLANAR_OFFSET


def plate(size, across, frame, origin=(0.0, 0.0, 0.0)):
    """A rectangle (2,) [m] as triangles of `across` [m] in the plane of two unit vectors, in float32."""
    steps = [max(1, round(side / across)) for side in size]
    a, b = np.meshgrid(*(np.linspace(0.0, s, n + 1) for s, n in zip(size, steps, strict=True)), indexing="ij")
    points = np.asarray(origin) + a[..., None] * frame[0] + b[..., None] * frame[1]
    points = points.astype(np.float32).astype(np.float64)
    p, q, r, s = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.concatenate([np.stack(c, axis=2).reshape(-1, 3, 3) for c in ((p, q, r), (p, r, s))])


def any_frame(seed):
    """Right, up and normal in a random attitude."""
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0].T


@pytest.mark.parametrize("across", [0.5, 0.05, 0.005, 0.002])
def test_a_plate_of_small_triangles_is_one_plane(across):
    """Corners rounded by 2.4e-7 m turn triangles of 2 mm by 1e-4 rad and more; thousands of them average out."""
    frame = any_frame(3)
    triangles = plate((0.5, 0.4), across, frame, origin=(4.1, 5.2, 2.3))
    parts = planar_regions(triangles, *LIMITS)
    assert len(parts.offset) == 1
    tilt = np.linalg.norm(np.cross(parts.normal[0], frame[2]))
    assert tilt < 2.4e-7 / 0.4  # one corner off by its rounding over the plate's width
    assert abs(parts.normal[0] @ [4.1, 5.2, 2.3] - parts.offset[0]) < 5e-7


def test_an_exact_plane_stays_as_it_is():
    triangles = np.array([[[0, 0, 1], [1, 0, 1], [1, 1, 1]], [[0, 0, 1], [0, 1, 1], [1, 1, 1]]], dtype=float)
    parts = planar_regions(triangles, *LIMITS)
    np.testing.assert_array_equal(parts.group, [0, 0])
    np.testing.assert_array_equal(parts.normal, [[0.0, 0.0, 1.0]])  # the side of the first triangle
    np.testing.assert_array_equal(parts.offset, [1.0])
    assert len(planar_regions(triangles[:0], *LIMITS).offset) == 0


@given(st.integers(0, 10_000))
def test_the_fit_is_the_least_squares_plane(seed):
    """No small turn or shift of it brings the points nearer."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(12, 3)) * [2.0, 1.0, 0.01] @ any_frame(seed)
    normal, offset = fit_plane(points, np.ones(3))
    assert normal @ np.ones(3) >= 0.0
    best = np.sum((points @ normal - offset) ** 2)
    for _ in range(20):
        other = normal + 1e-4 * rng.normal(size=3)
        other /= np.linalg.norm(other)
        assert np.sum((points @ other - points.mean(axis=0) @ other + 1e-4 * rng.normal()) ** 2) >= best


def test_a_round_body_keeps_its_facets():
    """A prism of 60 sides, each of 6 triangles: neighbours meet at 0.1 rad."""
    angle = np.arange(60) * 2 * np.pi / 60
    sides = []
    for a in angle:
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        middle = 0.3 * np.array([np.cos(a), np.sin(a), 0.0])
        width = 2 * 0.3 * np.tan(np.pi / 60)
        sides.append(plate((width, 3 * width), width, (right, np.array([0, 0, 1.0])), middle - width / 2 * right))
    parts = planar_regions(np.concatenate(sides), *LIMITS)
    np.testing.assert_array_equal(parts.group, np.repeat(np.arange(60), 6))
    facing = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    np.testing.assert_allclose(np.abs(np.sum(parts.normal * facing, axis=-1)), 1.0, atol=1e-9)


@given(st.integers(0, 10_000), st.floats(-1.2, 1.2), st.floats(-1.2, 1.2))
def test_overlap_against_points(seed, x, y):
    """Two triangles overlap where a point is inside both; seen along the normal, whatever their height."""
    rng = np.random.default_rng(seed)
    frame = any_frame(seed)
    flat = rng.normal(size=(2, 3, 2)) + np.array([[[0.0, 0.0]], [[x, y]]])
    a, b = (t @ frame[:2] + h * frame[2] for t, h in zip(flat, (0.0, 1e-5), strict=True))
    weights = rng.dirichlet(np.ones(3), size=400)
    inside = [weights @ t for t in flat]

    def margin(points, triangle):
        """Depth of points in a triangle, whichever way it turns."""
        edges = np.roll(triangle, -1, axis=0) - triangle
        out = np.stack([edges[:, 1], -edges[:, 0]], axis=-1) / np.linalg.norm(edges, axis=1, keepdims=True)
        depth = np.einsum("ni,ei->ne", points, out) - np.einsum("ei,ei->e", triangle, out)
        return np.maximum(depth.min(axis=1), (-depth).min(axis=1))

    deepest = max(margin(inside[0], flat[1]).max(), margin(inside[1], flat[0]).max())
    found = overlap(a[None], b[None], frame[2], 1e-9)
    if deepest > 1e-6:
        assert found
    if not found:
        assert deepest <= 1e-6
    assert found == overlap(b[None], a[None], frame[2], 1e-9)


def stacked(*plates, gap=1e-5):
    """The stack of one-wall plates."""
    parts = [planar_regions(t, *LIMITS) for t in plates]
    assert all(len(p.offset) == 1 for p in parts)
    owner = np.repeat(np.arange(len(plates)), [len(t) for t in plates])
    normal, offset = (np.concatenate([getattr(p, name) for p in parts]) for name in ("normal", "offset"))
    return stack_walls(np.concatenate(plates), owner, normal, offset, gap)


def test_who_lies_on_whom():
    frame = np.eye(3)
    wall = plate((4.0, 3.0), 1.0, frame)
    poster = plate((1.0, 1.0), 0.5, frame, (1.0, 1.0, 3e-6))
    note = plate((0.2, 0.2), 0.2, frame, (1.9, 1.1, 0.0))  # on the poster's edge
    away = plate((1.0, 1.0), 1.0, frame, (1.0, 1.0, 2e-5))  # too far off the plane
    beside = plate((4.0, 3.0), 1.0, frame, (4.0, 0.0, 0.0))  # shares an edge only
    upright = plate((1.0, 1.0), 1.0, frame[[0, 2]], (1.0, 1.0, 0.0))
    again = plate((4.0, 3.0), 3.0, -frame[:2], (4.0, 3.0, 0.0))
    stack = stacked(wall, poster, note, away, beside, upright, again)
    pairs = {(p.upper, p.lower) for p in stack.pairs}
    assert pairs == {(1, 0), (2, 0), (2, 1), (0, 6), (1, 6), (2, 6)}
    assert [over.tolist() for over in stack.over] == [[1, 2], [2], [], [], [], [], [0, 1, 2]]
    assert stack.plane.tolist() == [0, 0, 0, 3, 4, 5, 0]
    gap = {(p.upper, p.lower): p.gap for p in stack.pairs}
    assert gap[1, 0] == pytest.approx(3e-6, rel=1e-3)


def test_the_gap_is_the_tracers_step_off_a_surface():
    assert tracer_gap(np.array([[-1.0, 0.0, 2.0], [9.0, 4.0, 3.0]])) == pytest.approx(RAY_OFFSET * 6.0)
