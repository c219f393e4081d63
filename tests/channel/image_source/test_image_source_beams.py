"""Mirrored beams lose nothing: against all sequences in the rooms of `scenes/` and in random ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rislam_rt.channel.compare import random_poses
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.image_source.beam_tracing import Beams, _through, enclosing_balls, group_positions
from rislam_rt.channel.image_source.wall_facets import SEAM, build_facets
from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import ConfigError
from rislam_rt.geometry.planes import mirror
from rislam_rt.geometry.triangles import inside_any
from rislam_rt.model import Body, Material, RadioConfig, Reflector, Scatterer, Scene, Trajectory
from rislam_rt.scene import load_scene

SCENES = Path(__file__).parents[3] / "scenes"
ROOMS = sorted(path.parent.name for path in SCENES.glob("*/scene.toml"))
SELDOM = {"empty_box", "two_scatterers", "itu_room"}
"""Rooms of whose walls and scatterers others have as many."""


def found(scene, trajectory, depth, search):
    """Every path of every cycle by identity."""
    paths = ImageSourceChannel(scene, RadioConfig(), depth, search).paths(trajectory)
    return {(int(k), *paths.identity(p)) for k, p in np.argwhere(paths.valid)}


def facets_of(*walls):
    """A scene of nothing but walls."""
    still = Trajectory(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1), Body(np.zeros(3), np.ones(3)))
    return build_facets(build_walls(Scene("walls", walls, (), None, still)))


def walk(agent, cycles):
    """The first cycles of a motion, so near each other that they share beams."""
    parts = {name: getattr(agent, name)[:cycles] for name in ("time", "position", "velocity", "heading")}
    return replace(agent, **parts)


@pytest.mark.parametrize("name", [pytest.param(x, marks=pytest.mark.slow if x in SELDOM else ()) for x in ROOMS])
def test_no_path_is_lost_in_any_room(name):
    scene = load_scene(SCENES / name)
    depth = 3 if name in ("l_room", "tilted_room") else 2
    for trajectory in (random_poses(scene, 2, rng=np.random.default_rng(3)), walk(scene.agent, 3)):
        every = found(scene, trajectory, depth, "exhaustive")
        assert len(every) >= 50
        assert found(scene, trajectory, depth, "beams") == every


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 3, 4, 5))])
def test_no_path_is_lost_in_a_random_room(rooms, seed):
    """A box with a dozen plates in any attitude, some of them crossing, and positions near and far from each other."""
    rng = np.random.default_rng(seed)
    plates = []
    for number in range(12):
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        corners = rng.normal(0.0, 0.6, (rng.integers(3, 5), 2)) @ frame[:2]
        corners += rng.uniform([0.5, 0.5, 0.3], [5.5, 5.5, 2.7])
        fan = np.array([[0, i, i + 1] for i in range(1, len(corners) - 1)])
        plates.append(Reflector(f"plate{number}", corners, fan, Material(reflection=0.5)))
    sphere = Scatterer("sphere", rng.uniform([0.5, 0.5, 0.5], [5.5, 5.5, 2.5]), 0.01, 0.05)
    scene = rooms.scene([*rooms.box((0, 0, 0), (6, 6, 3)), *plates], [sphere], rooms.panel())
    near = rng.uniform([1, 1, 0.5], [5, 5, 2.5]) + rng.uniform(-0.15, 0.15, (4, 3))
    trajectory = rooms.at(np.concatenate([near, rng.uniform([0.3, 0.3, 0.3], [5.7, 5.7, 2.7], (3, 3))]))
    for depth in (2, 3):
        every = found(scene, trajectory, depth, "exhaustive")
        assert len(every) > 60
        assert found(scene, trajectory, depth, "beams") == every


@given(st.integers(0, 10_000))
def test_no_ray_from_the_ball_through_the_wall_leaves_the_beam(seed):
    """Through one wall and a second: where the ray goes after it, every half-space holds."""
    rng = np.random.default_rng(seed)
    triangles = rng.normal(size=(2, 3, 3)) * [[[1.0]], [[2.0]]]
    walls = [Reflector(f"{n}", t, np.array([[0, 1, 2]]), Material(reflection=0.5)) for n, t in enumerate(triangles)]
    facets = facets_of(*walls)
    center, radius = 3.0 * rng.normal(size=3), float(rng.choice([0.0, 0.1, 0.8]))
    start = Beams(np.zeros(1, int), np.zeros((1, 0), int), center[None], np.zeros((1, 0, 3)), np.zeros((1, 0)))
    first = _through(facets.rectangles, start, np.zeros(1, int), np.array([radius]))
    both = _through(facets.rectangles, first, np.ones(len(first.ball), int), np.array([radius]))
    ball = center + radius * (d := rng.normal(size=(200, 3))) / np.linalg.norm(d, axis=1, keepdims=True)
    hit = rng.dirichlet(np.ones(3), 200) @ triangles[0]
    for beams, order in ((first, [0]), (both, [0, 1])):
        image, on, alive = ball, hit, np.ones(200, dtype=bool)
        for wall in order:
            n, o = facets.normal[wall], facets.offset[wall]
            if wall:  # the ray from the image through the first wall's point goes on to the second plane
                a, b = image @ n - o, on @ n - o
                with np.errstate(all="ignore"):
                    reach = a / (a - b)
                on = image + reach[:, None] * (on - image)
                alive &= (reach > 1.0) & inside_any(np.nan_to_num(on), triangles[1:], 0.0)
            image = mirror(image, n, o)
        beyond = on + rng.exponential(2.0, 200)[:, None] * (on - image)
        if len(beams.ball) == 0:
            assert not alive.any()
            continue
        height = np.einsum("bpi,ni->bpn", beams.normal, beyond) - beams.offset[..., None]
        assert ((height >= -1e-6).all(axis=1).any(axis=0) | ~alive).all()


@settings(max_examples=40)
@given(st.integers(0, 10_000))
def test_rectangles_are_told_from_other_walls(seed):
    """`contains` by the rectangle is that of the triangles; a wall with a gap or a doubled part is no rectangle."""
    rng = np.random.default_rng(seed)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    ticks = [np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.0, 3))]) for _ in range(2)]
    faces = []
    for i in range(3):
        for j in range(3):
            p, q, r, s = [(ticks[0][i + a], ticks[1][j + b]) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
            faces += [(p, q, r), (p, r, s)]
    full = np.array(faces) @ frame[:2] + rng.normal(size=3)
    gap = np.delete(full, rng.integers(18), axis=0)
    doubled = np.concatenate([gap[1:], gap[:1], gap[:1]])
    for triangles, whole in ((full, True), (gap, False), (doubled, False)):
        flat = np.arange(3 * len(triangles)).reshape(-1, 3)
        wall = Reflector("wall", triangles.reshape(-1, 3), flat, Material(reflection=0.5))
        facets = facets_of(wall)
        assert facets.rectangles.whole.tolist() == [whole]
        points = full[0, 0] + rng.uniform(-0.2, 2.5, (300, 2)) @ frame[:2]
        expected = inside_any(points, triangles, SEAM)
        np.testing.assert_array_equal(facets.contains(points, np.zeros(300, int)), expected)


def test_groups_fit_their_balls():
    points = np.random.default_rng(0).uniform(0, [5, 2, 1], (200, 3))
    groups = group_positions(points, 0.4)
    assert sorted(np.concatenate(groups).tolist()) == list(range(200))
    balls = enclosing_balls(points, groups)
    assert (balls.radius <= 0.4).all()
    for group, center, radius in zip(groups, *balls, strict=True):
        assert np.linalg.norm(points[group] - center, axis=1).max() <= radius + 1e-12


def test_the_search_is_named(rooms):
    trajectory = rooms.at([1.3, 2.1, 0.8])
    words = {"auto": "all wall sequences", "exhaustive": "all wall sequences", "beams": "mirrored beams"}
    for how, said in words.items():
        channel = ImageSourceChannel(rooms.paper(), RadioConfig(), 2, how)
        assert channel.paths(trajectory).source == f"image source, {said}"
    hall = ImageSourceChannel(load_scene(SCENES / "large_hall"), RadioConfig(), 2)
    assert not hall.sequence_search.exhaustive
    with pytest.raises(ConfigError, match="search: 'rays' received"):
        ImageSourceChannel(rooms.paper(), RadioConfig(), 2, "rays")
