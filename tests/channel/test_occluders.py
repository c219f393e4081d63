"""Occluders: exact crossing of meshes, and the image-source channel with a scatterer that hides what lies behind it."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.compare import compare_channels, compare_paths, random_poses
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.occluders import build_occluders
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.triangles import triangle_planes
from rislam_rt.model import Occluder, PathKind, RadioConfig, Scatterer
from rislam_rt.scene.shapes import cylinder_mesh, sphere_mesh

RADIO = RadioConfig()
CENTER = np.array([2.0, 1.0, 1.0])
BALL = Scatterer("ball", CENTER, 0.3, 0.3, shade=Occluder(*sphere_mesh(CENTER, 0.3)))
POST = Scatterer(
    "post", np.array([4.0, 3.2, 1.5]), 0.1, 0.25, "constant", 2.9, np.array([0.0, 0.0, 1.0]),
    Occluder(*cylinder_mesh(np.array([4.0, 3.2, 1.5]), 0.25, 2.9, np.array([0.0, 0.0, 1.0]))),
)  # fmt: skip


def shaded(rooms, *scatterers):
    return rooms.scene(rooms.box((0, 0, 0), (6, 6, 3)), scatterers, rooms.panel(), "shaded")


def bare(scene):
    return replace(scene, scatterers=tuple(replace(s, shade=None) for s in scene.scatterers))


def clipped(start, end, scatterer):
    """Second way, for convex solids: the part [low, high] of each segment behind all faces, by Cyrus and Beck."""
    normal, offset = triangle_planes(scatterer.shade.triangles)
    ahead, toward = start @ normal.T - offset, (end - start) @ normal.T
    at = -ahead / np.where(toward == 0.0, 1e-300, toward)
    low = np.where(toward < 0.0, at, 0.0).max(axis=1)
    high = np.where(toward > 0.0, at, 1.0).min(axis=1)
    return np.maximum(low, 0.0) < np.minimum(high, 1.0)


@pytest.mark.parametrize("scatterer", [BALL, POST], ids=lambda s: s.name)
def test_crossings_of_convex_solids(rooms, scatterer):
    rng = np.random.default_rng(3)
    occluders = build_occluders(shaded(rooms, scatterer))
    start = scatterer.position + 2.0 * unit(rng.normal(size=(20_000, 3)))
    start[:10_000] *= [1.0, 1.0, 3.0]
    end = scatterer.position + rng.normal(size=(20_000, 3)) * [0.6, 0.6, 1.0]
    normal, offset = triangle_planes(scatterer.shade.triangles)
    outside = ((end @ normal.T > offset).any(axis=1)) & ((start @ normal.T > offset).any(axis=1))
    start, end = start[outside], end[outside]
    hides = occluders.hides(start, end)
    np.testing.assert_array_equal(hides, clipped(start, end, scatterer))
    assert 0.05 < hides.mean() < 0.9
    assert not occluders.hides(start, end, spared=0).any()
    np.testing.assert_array_equal(occluders.hides(end, start), hides)


def test_no_ray_slips_through_a_seam(rooms):
    """Through vertices and edge midpoints of the near side, exactly at the middle."""
    occluders = build_occluders(shaded(rooms, BALL))
    triangles = BALL.shade.triangles
    aims = np.concatenate([triangles.reshape(-1, 3), ((triangles + np.roll(triangles, 1, axis=1)) / 2).reshape(-1, 3)])
    start = CENTER + 3.0 * (aims - CENTER)
    assert occluders.hides(start, CENTER - 2.0 * (aims - CENTER)).all()
    assert occluders.hides(start, np.broadcast_to(CENTER, start.shape)).all()


def test_margin_is_the_distance_from_the_outline(rooms):
    """Of a sphere: radius against the line's distance from the centre; the mesh is within 2 % of the radius."""
    occluders, rng = build_occluders(shaded(rooms, BALL)), np.random.default_rng(5)
    for _ in range(200):
        direction = unit(rng.normal(size=3))
        aside = unit(np.cross(direction, rng.normal(size=3)))
        miss = rng.uniform(0.0, 0.6)
        start, end = CENTER + miss * aside - 2.0 * direction, CENTER + miss * aside + 2.0 * direction
        margin = occluders.margin(start, end, 0)
        assert margin == pytest.approx(miss - 0.3, abs=0.02 * 0.3)
        assert (margin < 0.0) == occluders.hides(start[None], end[None])[0]
    # a segment that ends before the ball is clear of it by that much
    short = occluders.margin(CENTER - [2.0, 0.0, 0.0], CENTER - [0.5, 0.0, 0.0], 0)
    assert short > 0.2


def test_scenes_without_shades_have_none(rooms):
    occluders = build_occluders(rooms.paper())
    assert len(occluders) == 0
    assert not occluders.hides(np.zeros((3, 3)), np.ones((3, 3))).any()


@pytest.fixture(scope="module")
def case(rooms):
    """Scene, poses, and the paths with and without shades."""
    scene = shaded(rooms, BALL, POST)
    poses = random_poses(scene, 8, rng=np.random.default_rng(8))
    return scene, poses, *(ImageSourceChannel(s, RADIO, 2).paths(poses) for s in (scene, bare(scene)))


def segments(paths, poses, cycle, p):
    """Start, end and the landmark that each segment begins or ends at (-1 for none)."""
    count = paths.num_vertices[p]
    points = np.vstack([poses.tx[cycle], paths.vertices[cycle, p, :count], poses.rx[cycle]])
    landmark, at = paths.landmark[p], 1 + (paths.tx_walls[p] >= 0).sum()
    own = [landmark if landmark >= 0 and at in (i, i + 1) else -1 for i in range(count + 1)]
    return points[:-1], points[1:], own


def test_paths_that_a_solid_cuts_are_gone_and_no_others(case):
    scene, poses, with_shade, without = case
    place = {with_shade.identity(p): p for p in range(with_shade.num_paths)}
    assert set(place) <= {without.identity(p) for p in range(without.num_paths)}
    gone = 0
    for cycle, p in np.argwhere(without.valid):
        start, end, own = segments(without, poses, cycle, p)
        cut = False
        for number, scatterer in enumerate(scene.scatterers):
            cut |= (clipped(start, end, scatterer) & (np.array(own) != number)).any()
        column = place.get(without.identity(p), -1)
        assert (column >= 0 and with_shade.valid[cycle, column]) == (not cut)
        gone += cut
        if not cut:
            assert with_shade.gain[cycle, column] == without.gain[cycle, p]
            assert with_shade.tau[cycle, column] == without.tau[cycle, p]
    assert 0.03 < gone / without.valid.sum() < 0.4
    direct = np.isin(with_shade.kind, (PathKind.PS,))
    assert with_shade.valid[:, direct].mean() > 0.9  # a centre is seen through its own mesh


def test_a_ball_hides_its_own_centre_from_below(rooms):
    """The bounce on the floor straight below it: the ray from above would have to pass through the ball first."""
    scene = shaded(rooms, BALL)
    above = rooms.at(CENTER + np.array([0.02, 0.01, 1.0]), tx=(0.03, 0.0, 0.0), rx=(-0.03, 0.01, 0.0))
    with_shade, without = (ImageSourceChannel(s, RADIO, 1).paths(above) for s in (scene, bare(scene)))
    floor = without.walls.index("floor")
    below = [
        (int(PathKind.VS), 0, (floor,), ()),
        (int(PathKind.VS), 0, (), (floor,)),
        (int(PathKind.VT), -1, (floor,), ()),
    ]
    seen = {with_shade.identity(p) for p in range(with_shade.num_paths)}
    assert {without.identity(p) for p in range(without.num_paths)} - seen == set(below)


def test_the_certificate_knows_shades(case):
    """Against a channel that ignores them, every missing path is proved hidden, and nothing else differs."""
    scene, _, _, _ = case
    poses = random_poses(scene, 12, rng=np.random.default_rng(2))
    with_shade, without = (ImageSourceChannel(s, RADIO, 1).paths(poses) for s in (scene, bare(scene)))
    report = compare_paths(without, with_shade, scene, poses)
    assert report.unexplained == 0
    assert set(report.explained) == {"occluded"}
    assert report.matched + report.explained["occluded"] == without.valid.sum()
    assert report.explained["occluded"] > 10
    # asked of the bare room, in which nothing hides them, there is no proof
    wrong = compare_paths(without, with_shade, bare(scene), poses)
    assert wrong.unexplained >= 0.95 * report.explained["occluded"]


def test_random_poses_keep_out_of_solids(case):
    scene, poses, *_ = case
    for scatterer in scene.scatterers:
        normal, offset = triangle_planes(scatterer.shade.triangles)
        # convex: the largest distance from a face's plane is a lower bound of the distance
        outside = (poses.position @ normal.T - offset).max(axis=1)
        assert outside.min() > 0.0
        reach = np.linalg.norm((poses.position - scatterer.position)[:, : 3 if scatterer is BALL else 2], axis=1)
        assert reach.min() > scatterer.radius + 0.09


@pytest.mark.parametrize("refine", [True, False])
def test_the_tracer_sees_the_same_shadows(rooms, refine):
    """Rays through meshes in float32 against crossings in float64: the same paths, nothing to explain."""
    scene = shaded(rooms, BALL, POST)
    rng = np.random.default_rng(1)
    report = compare_channels(scene, RADIO, poses=12, depth=2, rng=rng, refine=refine)
    assert report.unexplained == 0
    assert report.matched > 2000
    # a ray within 0.1 mm of an outline may be seen either way: 1e-4 of a shadow some 0.3 m wide
    assert sum(report.explained.values()) <= 2
    assert report.length_error.max() <= (1e-9 if refine else 2e-5)


def test_a_shade_alone_hides_like_a_scatterers_and_is_no_landmark(rooms):
    """Against the same shade about a scatterer: the same paths, those of that scatterer apart; both channels agree."""
    owned = shaded(rooms, BALL)
    alone = replace(owned, scatterers=(), occluders=(replace(BALL.shade, name="heap"),))
    poses = random_poses(alone, 20, rng=np.random.default_rng(5))
    with_ball, without = (ImageSourceChannel(scene, RADIO, 2).paths(poses) for scene in (owned, alone))
    assert alone.landmarks == ("ris",)
    landmark = with_ball.landmark - (with_ball.landmark > 0)  # the panel moves up to number 0
    rest = with_ball.landmark != 0
    keys = [
        {(int(k), int(mark[p]), *map(int, [*paths.tx_walls[p], *paths.rx_walls[p]])) for k, p in np.argwhere(valid)}
        for paths, mark, valid in (
            (with_ball, landmark, with_ball.valid & rest), (without, without.landmark, without.valid),
        )
    ]  # fmt: skip
    assert keys[0] == keys[1]
    assert len(keys[1]) < ImageSourceChannel(replace(alone, occluders=()), RADIO, 2).paths(poses).valid.sum()
    assert compare_channels(alone, RADIO, poses=20, depth=2, rng=np.random.default_rng(6), refine=True).passed
