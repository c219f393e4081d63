"""Candidates: what is not asked of the tracer cannot exist."""

import itertools

import numpy as np
import pytest

from rislam_rt.channel.specular_legs import NO_WALL, turned_round
from rislam_rt.channel.traced import TracedChannel, wall_sequences
from rislam_rt.channel.traced.wall_sequences import (
    BACK,
    FRONT,
    CandidateIndices,
    in_blocks,
    point_sides,
    possible_sequences,
    wall_sides,
)
from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import ConfigError
from rislam_rt.model import RadioConfig


def test_sides_of_a_box(rooms):
    """Every face sees the five others on its inner side, whichever way its normal points."""
    walls = build_walls(rooms.paper())
    sides = wall_sides(walls)
    inner = point_sides(walls, np.array([[3.0, 3.0, 1.5]]))[0]
    assert set(inner) <= {FRONT, BACK}
    np.testing.assert_array_equal(sides, np.where(np.eye(6, dtype=bool), 0, inner[:, None]))


@pytest.mark.parametrize(("depth", "count"), [(0, 1), (1, 7), (2, 37), (3, 187)])
def test_all_sequences_of_a_box(rooms, depth, count):
    walls = build_walls(rooms.paper())
    inner = point_sides(walls, np.array([[3.0, 3.0, 1.5]]))[0]
    table, every = possible_sequences(wall_sides(walls), inner, inner, depth)
    assert every
    assert table.shape == (count, depth)
    assert len(np.unique(table, axis=0)) == count
    if depth > 1:
        hosted, _ = possible_sequences(wall_sides(walls), inner, inner, depth, walls.beside(walls.hosts[0]))
        assert walls.hosts[0] not in turned_round(hosted)[:, 0]
        assert walls.hosts[0] in hosted


def test_turning_round_keeps_padding_last():
    table = np.array([[1, 2, 3], [4, 5, NO_WALL], [6, NO_WALL, NO_WALL], [NO_WALL] * 3])
    expected = [[3, 2, 1], [5, 4, NO_WALL], [6, NO_WALL, NO_WALL], [NO_WALL] * 3]
    np.testing.assert_array_equal(turned_round(table), expected)


@pytest.mark.parametrize("room", ["l_shape", "parted"])
@pytest.mark.parametrize("paired", [True, False])
def test_nothing_that_the_tracer_would_confirm_is_left_out(rooms, room, paired):
    """Ask the tracer about every sequence of two walls at every pose, and compare with what survives the sieve."""
    scene = getattr(rooms, room)()
    channel = TracedChannel(scene, RadioConfig(), 2)
    from rislam_rt.channel.traced.culling import cull_candidates
    from rislam_rt.channel.traced.visibility import visible_rows

    rng = np.random.default_rng(8)
    device = rng.uniform([0.2, 0.2, 0.2], [2.8, 5.8, 2.8], size=(15, 3))
    far = device + np.array([0.03, -0.05, 0.04]) if paired else np.array([[1.2, 0.7, 1.9]])
    count = len(channel.walls)
    everything = np.array([(a, b) for a, b in itertools.product(range(count), repeat=2) if a != b])
    everything = np.concatenate([np.full((1, 2), NO_WALL), [[a, NO_WALL] for a in range(count)], everything])
    row, column = (index.ravel() for index in np.indices((len(device), len(everything))))
    rows = CandidateIndices(row if paired else np.zeros_like(row), row, column)
    confirmed, _ = visible_rows(channel.tracer_scene, everything, far, device, rows)
    exists = {(int(d), tuple(everything[s])) for d, s in zip(confirmed.device, confirmed.sequence, strict=True)}
    assert len(exists) > 150

    ends = (np.bitwise_or.reduce(point_sides(channel.walls, points)) for points in (device, far))
    table, _ = possible_sequences(wall_sides(channel.walls), *ends, 2)
    asked = {
        (int(d), tuple(table[s]))
        for devices, chosen in cull_candidates(channel.tracer_scene, table, device, far)
        for d, s in zip(devices, chosen, strict=True)
    }
    assert exists <= asked
    assert len(asked) < 4 * len(exists)


def test_sieve_in_blocks(rooms, monkeypatch):
    channel = TracedChannel(rooms.paper(), RadioConfig(), 2)
    trajectory = rooms.at([[1.3, 2.1, 0.8], [4.4, 0.9, 2.2]])
    whole = channel.paths(trajectory)
    monkeypatch.setattr("rislam_rt.channel.traced.culling.BLOCK", 11)
    np.testing.assert_array_equal(whole.gain, channel.paths(trajectory).gain)


def test_rows_in_blocks():
    parts = [CandidateIndices(*(np.arange(a, b) for _ in range(3))) for a, b in ((0, 5), (5, 5), (5, 7), (7, 20))]
    blocks = list(in_blocks(parts, 6))
    assert [len(block.far) for block in blocks] == [6, 6, 6, 2]
    np.testing.assert_array_equal(np.concatenate([block.device for block in blocks]), np.arange(20))


def test_too_many_sequences_are_refused_in_one_line(rooms, monkeypatch):
    monkeypatch.setattr(wall_sequences, "MOST_LOOKS", 20)
    channel = TracedChannel(rooms.paper(), RadioConfig(), 2)
    with pytest.raises(ConfigError, match="depth: 2 received; 6 walls allow 30 sequences"):
        channel.paths(rooms.at([1.3, 2.1, 0.8]))
