"""What must not change the traced paths: moving or turning the whole room, and how its meshes happen to be written."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.compare.path_matching import named_identity
from rislam_rt.channel.traced import TracedChannel
from rislam_rt.model import RadioConfig, RisPanel

RADIO = RadioConfig()
POSES = [[1.3, 2.1, 0.8], [0.9, 4.6, 2.2], [2.4, 0.6, 1.7]]


def traced(scene, trajectory):
    """Delay and gain of every path by cycle and identity in names."""
    paths = TracedChannel(scene, RADIO, 2).paths(trajectory)
    return {
        (int(k), *named_identity(paths, p)): (paths.tau[k, p], paths.gain[k, p]) for k, p in np.argwhere(paths.valid)
    }


def assert_same(before, after):
    assert set(before) == set(after)
    first, second = (np.array([paths[key] for key in before]) for paths in (before, after))
    np.testing.assert_allclose(first[:, 0].real, second[:, 0].real, rtol=1e-12)
    np.testing.assert_allclose(np.abs(first[:, 1]), np.abs(second[:, 1]), rtol=1e-5)  # the field is float32


@pytest.fixture(scope="module", params=["paper", "parted"])
def original(request, rooms):
    scene = getattr(rooms, request.param)()
    return scene, traced(scene, rooms.at(POSES))


def with_meshes(scene, change):
    """The scene with every mesh changed."""
    return replace(scene, reflectors=tuple(change(reflector) for reflector in scene.reflectors))


def test_flipped_normals(original, rooms):
    scene, before = original
    flipped = with_meshes(scene, lambda r: replace(r, faces=r.faces[:, ::-1]))
    assert_same(before, traced(flipped, rooms.at(POSES)))


def test_subdivided_meshes(original, rooms):
    def subdivide(reflector):
        a, b, c = np.moveaxis(reflector.triangles, 1, 0)
        middle = (a + 2.0 * b + 3.0 * c) / 6.0  # off every median, so that seams cross the bounces' neighbourhoods anew
        parts = np.concatenate([np.stack(t, axis=1) for t in ((a, b, middle), (b, c, middle), (c, a, middle))])
        return replace(reflector, vertices=parts.reshape(-1, 3), faces=np.arange(3 * len(parts)).reshape(-1, 3))

    scene, before = original
    assert_same(before, traced(with_meshes(scene, subdivide), rooms.at(POSES)))


def test_room_turned_and_moved(original, rooms):
    """A rotation about no axis in particular and a shift, of walls, landmarks, panel and agent alike."""
    scene, before = original
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    shift = np.array([3.0, -7.0, 1.5])
    moved = with_meshes(scene, lambda r: replace(r, vertices=r.vertices @ turn.T + shift))
    spec = replace(scene.ris.spec, normal=turn @ scene.ris.spec.normal, up=turn @ scene.ris.spec.up)
    panel = RisPanel(spec, turn @ scene.ris.center + shift, scene.ris.host)
    scatterers = tuple(replace(s, position=turn @ s.position + shift) for s in scene.scatterers)
    moved = replace(moved, ris=panel, scatterers=scatterers)
    tx, rx = (turn @ np.array(offset) for offset in ((-0.04, -0.03, 0.01), (0.04, 0.03, -0.01)))
    trajectory = rooms.at(np.array(POSES) @ turn.T + shift, tx=tx, rx=rx)
    assert_same(before, traced(moved, trajectory))


def test_a_wall_in_the_way_takes_its_paths_and_no_others(rooms):
    """A board between agent and sphere: the paths it crosses go, those over it come, all others stay as they were."""
    scene = rooms.paper()
    before = traced(scene, rooms.at(POSES[:1]))
    board = rooms.polygon("board", [(1.5, 1.2, 0.7), (1.9, 1.5, 0.7), (1.9, 1.5, 1.2), (1.5, 1.2, 1.2)])
    after = traced(replace(scene, reflectors=(*scene.reflectors, board)), rooms.at(POSES[:1]))
    old = {key for key in after if "board" not in key[3] + key[4]}
    assert old < set(before)
    assert not any(key[1] == 2 for key in old)  # PS: the board stands in the straight line from the agent to the sphere
    assert all(after[key] == pytest.approx(before[key], rel=1e-5) for key in old)
