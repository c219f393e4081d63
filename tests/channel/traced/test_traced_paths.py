"""The traced channel against image sources, and what it does near walls and corners."""

import numpy as np
import pytest

from rislam_rt.channel.compare import compare_paths
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.traced import TracedChannel, shortest_segment, trace_small_box
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import ConfigError, SceneError
from rislam_rt.model import Material, PathKind, RadioConfig

RADIO = RadioConfig()


def column(paths, kind, *walls):
    """The column of a kind whose walls on the Tx leg have these names."""
    for path in range(paths.num_paths):
        identity = paths.identity(path)
        if identity[0] == kind and [paths.walls[w] for w in identity[2]] == list(walls) and not identity[3]:
            return path
    raise AssertionError(f"no {kind.name} over {walls}")


@pytest.mark.parametrize("room", ["paper", "l_shape", "parted"])
def test_same_paths_as_the_image_source_channel(rooms, room):
    """Two independent finders, identity by identity; the committed comparison covers every room at length."""
    scene = getattr(rooms, room)()
    rng = np.random.default_rng(11)
    trajectory = rooms.at(rng.uniform([0.3, 0.3, 0.3], [2.7, 2.7, 2.7], size=(25, 3)))
    traced, analytic = (channel(scene, RADIO, 2).paths(trajectory) for channel in (TracedChannel, ImageSourceChannel))
    report = compare_paths(traced, analytic, scene, trajectory, shortest_segment=shortest_segment(scene))
    assert report.matched > 2000
    assert report.unexplained == 0
    assert len(report.one_sided) < 1e-3 * report.matched
    assert report.length_error.max() < 1e-12
    assert report.gain_error_db.max() < 1e-3  # float32 field; nulls of the panel's sum magnify it


def test_unrefined_paths_are_the_tracers_own_float32(rooms):
    scene = rooms.paper()
    trajectory = rooms.at([[1.3, 2.1, 0.8], [4.4, 0.9, 2.2]])
    refined, plain = (TracedChannel(scene, RADIO, 2, refine=refine).paths(trajectory) for refine in (True, False))
    searched = "all wall sequences"
    assert (refined.source, plain.source) == (f"traced, refined, {searched}", f"traced, {searched}")
    np.testing.assert_array_equal(refined.valid, plain.valid)
    error = SPEED_OF_LIGHT * np.abs(refined.tau - plain.tau)[refined.valid]
    # Three segments of vertices at +-3 m about the room's centre, float32 spacing 2.4e-7, plus the panel's lift of 2e-6
    # on both legs: 2e-5 is the bound that the comparison of the channels is held to.
    assert 0.0 < error.max() < 2e-5


def test_panel_keeps_real_bounces_and_drops_those_on_its_host(rooms):
    """Ceiling, floor, RIS is a path; floor, ceiling, RIS would bounce on the wall that the panel hangs on."""
    paths = TracedChannel(rooms.paper(), RADIO, 2).paths(rooms.at([1.3, 2.1, 0.8]))
    legs = {
        tuple(paths.walls[w] for w in paths.identity(p)[2])
        for p in range(paths.num_paths)
        if paths.kind[p] == PathKind.VRIS and not paths.identity(p)[3]
    }
    assert ("ceiling", "floor") in legs
    assert ("floor", "ceiling") not in legs
    assert not any(walls[-1] == "ceiling" for walls in legs)


@pytest.mark.parametrize("height", [0.0, 1e-7, 1e-3])
def test_devices_on_and_near_a_wall(rooms, height):
    """On the floor its own bounces vanish (they are degenerate), a millimetre above they are there; the rest stays."""
    rng = np.random.default_rng(5)
    position = np.column_stack([rng.uniform(1.0, 5.0, (6, 2)), np.full(6, height)])
    trajectory = rooms.at(position, tx=(-0.04, -0.03, 0.0), rx=(0.04, 0.03, 0.0))
    traced, analytic = (
        channel(rooms.paper(), RADIO, 1).paths(trajectory) for channel in (TracedChannel, ImageSourceChannel)
    )
    np.testing.assert_array_equal(traced.valid.sum(axis=1), analytic.valid.sum(axis=1))
    floor = [p for p in range(traced.num_paths) if "floor" in traced.label(p)]
    assert bool(floor) == (height == 1e-3)


def test_a_bounce_names_the_wall_that_was_hit(rooms):
    """Walls in one plane: a partition's two leaves are two walls, and each bounce lies on the one it names."""
    scene = rooms.parted()
    rng = np.random.default_rng(2)
    paths = TracedChannel(scene, RADIO, 1).paths(rooms.at(rng.uniform([0.5, 0.5, 0.9], [2.5, 5.5, 2.0], size=(40, 3))))
    for name, low, high in (("left", 0.0, 2.5), ("right", 3.5, 6.0)):
        path = column(paths, PathKind.VT, name)
        y = paths.vertices[paths.valid[:, path], path, 0, 1]
        assert len(y) > 5
        assert ((y > low) & (y < high)).all()


def test_same_bits_every_time(rooms):
    scene, trajectory = rooms.paper(), rooms.at([[1.3, 2.1, 0.8], [4.4, 0.9, 2.2]])
    first, second = (TracedChannel(scene, RADIO, 2, refine=False).paths(trajectory) for _ in range(2))
    for name in ("valid", "tau", "gain", "vertices", "departure"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_blocks_change_nothing(rooms, monkeypatch):
    scene, trajectory = rooms.paper(), rooms.at([[1.3, 2.1, 0.8], [4.4, 0.9, 2.2]])
    channel = TracedChannel(scene, RADIO, 2)
    whole = channel.paths(trajectory)
    monkeypatch.setattr("rislam_rt.channel.traced.channel.BLOCK_ROWS", 37)
    parts = channel.paths(trajectory)
    np.testing.assert_array_equal(whole.gain, parts.gain)
    np.testing.assert_array_equal(whole.tx_walls, parts.tx_walls)


def test_an_empty_trajectory_and_a_room_without_walls(rooms):
    nothing = TracedChannel(rooms.paper(), RADIO, 2).paths(rooms.at(np.zeros((0, 3))))
    assert (nothing.num_cycles, nothing.num_paths) == (0, 0)
    open_air = TracedChannel(rooms.scene((), ris=None), RADIO, 2).paths(rooms.at([1.0, 1.0, 1.0]))
    assert sorted(open_air.kind.tolist()) == [PathKind.LOS, PathKind.PS]


def test_short_segments_next_to_a_corner_are_kept(rooms):
    """Sionna's own limit of 1 cm would lose the double bounces whose middle segment is 2 mm long."""
    scene = rooms.scene(rooms.box((0, 0, 0), (6, 6, 3)), scatterers=())
    assert shortest_segment(scene) < 2e-4
    # seen from the corner, Tx and Rx lie 1e-3 rad apart
    trajectory = rooms.at([1.0, 1.0, 1.5], tx=(-0.001, 0.0, 0.0), rx=(0.001, 0.0, 0.05))
    paths = TracedChannel(scene, RADIO, 2).paths(trajectory)
    assert paths.valid.sum() == 25
    segment = np.linalg.norm(np.diff(paths.vertices[0, paths.num_vertices == 2], axis=1), axis=-1)
    assert 1e-3 < segment.min() < 1e-2


def test_small_box_proves_the_machine():
    proof = trace_small_box()
    assert proof.ok
    assert proof.num_paths == 25


def test_bad_settings(rooms):
    with pytest.raises(ConfigError, match="depth: -1 received"):
        TracedChannel(rooms.paper(), RADIO, -1)
    with pytest.raises(SceneError, match="'cheese' received"):
        TracedChannel(rooms.paper(material=Material(itu="cheese")), RADIO, 1)
    with pytest.raises(SceneError, match="material"):
        TracedChannel(rooms.paper(material=Material(itu="very_dry_ground")), RadioConfig(carrier=60e9), 1)
