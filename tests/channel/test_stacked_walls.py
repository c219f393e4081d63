"""Surfaces in one plane, and walls of many triangles: one answer for both channels, one identity a path."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.compare import compare_paths, random_poses
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.traced import TracedChannel
from rislam_rt.channel.walls import build_walls
from rislam_rt.geometry.coplanar import tracer_gap
from rislam_rt.model import Material, RadioConfig, Reflector

RADIO = RadioConfig()
DIM = Material(reflection=0.3)
GAPS = [0.0, 1e-7, 1e-6, 3e-6, 1e-5, 2.3e-5, -1e-5]
"""[m] in front of the wall; the tracer's step in this room is 2.4e-5 m. The last one lies behind."""


def with_parts(scene, *parts):
    return replace(scene, reflectors=(*scene.reflectors, *parts))


def paths_of(scene, trajectory):
    """Valid identities cycle by cycle, and gains, of both channels."""
    channels = TracedChannel(scene, RADIO, 2), ImageSourceChannel(scene, RADIO, 2)
    paths = [channel.paths(trajectory) for channel in channels]
    report = compare_paths(*paths, scene, trajectory)
    assert (report.unexplained, report.explained) == (0, {})
    assert report.gain_error_db.max() < 1e-3  # the tracer's float32
    return paths[1]


def names(paths, cycle):
    """Identities in names, one each."""
    labels = [paths.label(p) for p in np.flatnonzero(paths.valid[cycle])]
    assert len(set(labels)) == len(labels)
    return set(labels)


@pytest.fixture(scope="module")
def bare_paths(rooms):
    """The room without anything on its walls: positions, and the paths there."""
    trajectory = random_poses(rooms.paper(), 15, rng=np.random.default_rng(2))
    return trajectory, paths_of(rooms.paper(), trajectory)


@pytest.mark.parametrize(("gap", "foot"), [*((gap, 0.5) for gap in GAPS), (0.0, 0.0)])
def test_a_poster_reflects_in_the_walls_stead_where_it_lies(rooms, bare_paths, gap, foot):
    """And a door, which goes down to the wall's edge; the wall reflects elsewhere."""
    scene = rooms.paper()
    corners = [(gap, 1, foot), (gap, 2.5, foot), (gap, 2.5, 2), (gap, 1, 2)]
    trajectory, bare = bare_paths
    hung = paths_of(with_parts(scene, rooms.polygon("poster", corners, DIM)), trajectory)
    seen = beside = 0
    for cycle in range(15):
        assert bare.valid[cycle].sum() == hung.valid[cycle].sum()  # the same paths under other names
        assert {n.replace("poster", "wall_x0") for n in names(hung, cycle)} == names(bare, cycle)
        for column in np.flatnonzero(hung.valid[cycle]):
            _, _, tx_walls, rx_walls = hung.identity(column)
            points = hung.vertices[cycle, column, : hung.num_vertices[column]]
            order = [*tx_walls, *([] if hung.landmark[column] < 0 else [-1]), *rx_walls]
            for point, wall in zip(points, order, strict=True):
                if wall >= 0 and hung.walls[wall] in ("wall_x0", "poster"):
                    on_poster = 1 < point[1] < 2.5 and foot < point[2] < 2
                    assert hung.walls[wall] == ("poster" if on_poster else "wall_x0")
                    seen, beside = seen + on_poster, beside + (not on_poster)
    assert min(seen, beside) > 20


@pytest.mark.parametrize("gap", [0.0, 1e-6, 1e-5])
@pytest.mark.parametrize("wall", ["wall_x0", "ceiling"])
def test_a_wall_given_twice_reflects_once(rooms, bare_paths, wall, gap):
    """Also the one that the panel hangs on. The first of the two reflects."""
    scene = rooms.paper()
    first = next(r for r in scene.reflectors if r.name == wall)
    shift = np.array([gap, 0, 0] if wall == "wall_x0" else [0, 0, -gap])
    again = Reflector("again", first.vertices + shift, first.faces[::-1], DIM)
    trajectory, bare = bare_paths
    twice = paths_of(with_parts(scene, again), trajectory)
    for cycle in range(15):
        assert names(bare, cycle) == names(twice, cycle)


def test_in_a_large_room_the_tracer_tells_less(rooms):
    """In a hall of 60 m surfaces 0.15 mm apart are one, and 0.25 mm apart two, in both channels."""
    hall = rooms.scene(rooms.box((0, 0, 0), (60, 50, 10)))
    limit = tracer_gap(hall.bounds)
    assert 1.5e-4 < limit < 2.5e-4
    trajectory = random_poses(hall, 10, rng=np.random.default_rng(4))
    for gap in (1.5e-4, 2.5e-4):
        poster = rooms.polygon("poster", [(gap, 5, 1), (gap, 45, 1), (gap, 45, 9), (gap, 5, 9)], DIM)
        scene = with_parts(hall, poster)
        assert (len(np.unique(build_walls(scene).plane)) == 6) == (gap < limit)
        paths_of(scene, trajectory)


def test_a_plate_of_small_triangles_reflects_like_one_of_two(rooms):
    """Triangles of 5 mm with corners in float32: one wall, its gains those of two triangles within 1e-4."""
    scene = rooms.paper()
    right = np.array([np.cos(0.3), 0.0, np.sin(0.3)])
    up = np.array([-0.1, 0.97, 0.1])
    up -= (up @ right) * right
    up /= np.linalg.norm(up)
    corner = np.array([3.1, 2.2, 1.3])
    before = corner + 0.3 * right + 0.2 * up + 0.8 * np.cross(right, up)
    trajectory = rooms.at(before + np.random.default_rng(3).uniform(-0.2, 0.2, (25, 3)))
    gains = []
    for steps in (np.array([1, 1]), np.array([120, 80])):
        a, b = np.meshgrid(*(np.linspace(0.0, s, n + 1) for s, n in zip((0.6, 0.4), steps, strict=True)))
        points = corner + a[..., None] * right + b[..., None] * up
        index = np.arange(a.size).reshape(a.shape)
        p, q, r, s = (i.ravel() for i in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
        faces = np.concatenate([np.stack([p, q, r], axis=-1), np.stack([p, r, s], axis=-1)])
        vertices = points.reshape(-1, 3).astype(np.float32).astype(np.float64)
        room = with_parts(scene, Reflector("plate", vertices, faces, DIM))
        assert build_walls(room).names[-1] == "plate"
        paths = paths_of(room, trajectory)
        label = [paths.label(p) for p in range(paths.num_paths)]
        gains.append({n: np.where(paths.valid[:, p], paths.gain[:, p], 0.0) for p, n in enumerate(label)})
    coarse, fine = gains
    assert coarse.keys() == fine.keys()
    about = [n for n in coarse if "plate" in n]
    assert sum(int((coarse[n] != 0.0).sum()) for n in about) > 30
    for name in about:
        np.testing.assert_allclose(np.abs(fine[name]), np.abs(coarse[name]), rtol=1e-4)
        # 5e-7 m of rounding on a length, twice, is 2e-4 rad at 10 GHz
        turn = np.angle(fine[name] * np.conj(coarse[name]))
        assert np.abs(turn).max() < 5e-4
