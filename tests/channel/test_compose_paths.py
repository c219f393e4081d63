"""Legs joined to paths: counts, classes, reciprocal identities and re-phasing."""

from itertools import pairwise

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.specular_legs import SpecularLegs
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import GeometryError
from rislam_rt.model import PathKind, RadioConfig, RisCode

RADIO = RadioConfig()


@pytest.fixture(scope="module")
def paths(rooms):
    return ImageSourceChannel(rooms.paper(), RADIO, 2).paths(rooms.at([[1.13, 2.31, 1.2], [2.4, 4.73, 0.52]]))


@pytest.mark.parametrize("depth", [0, 1, 2, 3])
def test_counts_follow_from_the_counts_of_legs(rooms, depth):
    """A box has 1, 6, 18, 38 legs of 0 .. 3 bounces; a landmark's paths are all pairs of up to `depth` together."""
    paths = ImageSourceChannel(rooms.paper(), RADIO, depth).paths(rooms.at([1.13, 2.31, 1.2]))
    legs = [1, 6, 18, 38]
    pairs = sum(legs[i] * legs[j] for i in range(depth + 1) for j in range(depth + 1 - i))
    assert paths.valid.all()
    assert np.isin(paths.kind, (PathKind.LOS, PathKind.VT)).sum() == sum(legs[: depth + 1])
    assert np.isin(paths.kind, (PathKind.PS, PathKind.VS)).sum() == pairs
    assert (paths.kind == PathKind.LOS).sum() == (paths.kind == PathKind.PS).sum() == 1


def test_identities_are_unique_and_classes_consistent(paths):
    identities = [paths.identity(p) for p in range(paths.num_paths)]
    assert len(set(identities)) == paths.num_paths
    for p, (kind, landmark, tx, rx) in enumerate(identities):
        assert paths.num_vertices[p] == len(tx) + len(rx) + (landmark >= 0)
        assert (landmark < 0) == (kind in (PathKind.LOS, PathKind.VT))
        assert (len(tx) + len(rx) == 0) == (kind in (PathKind.LOS, PathKind.PS, PathKind.RIS))
        assert (landmark == 1) == (kind in (PathKind.RIS, PathKind.VRIS))
        assert all(a != b for walls in (tx, rx) for a, b in pairwise(walls))


def test_every_coupled_path_has_its_reciprocal_class(paths):
    identities = {paths.identity(p) for p in range(paths.num_paths)}
    for kind, landmark, tx, rx in identities:
        if landmark >= 0:
            assert (kind, landmark, rx[::-1], tx[::-1]) in identities


def test_delays_are_sums_of_legs_over_the_landmark(rooms, paths):
    point = rooms.paper().landmark_positions
    trajectory = rooms.at([[1.13, 2.31, 1.2], [2.4, 4.73, 0.52]])
    for cycle, p in np.argwhere(paths.valid):
        count = paths.num_vertices[p]
        points = np.vstack([trajectory.tx[cycle], paths.vertices[cycle, p, :count], trajectory.rx[cycle]])
        length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        assert paths.tau[cycle, p] * SPEED_OF_LIGHT == pytest.approx(length, abs=1e-12)
        if paths.landmark[p] >= 0:
            _, landmark, tx, _ = paths.identity(p)
            np.testing.assert_array_equal(points[1 + len(tx)], point[landmark])


def test_gains_carry_the_carrier_phase(paths):
    for p in np.flatnonzero(~np.isin(paths.kind, (PathKind.RIS, PathKind.VRIS))):
        turned = paths.gain[:, p] * np.exp(2j * np.pi * RADIO.carrier * paths.tau[:, p])
        # what is left of constant-R walls and point landmarks is real and positive; 1e-9: 2 pi f tau of 1000 turns
        np.testing.assert_allclose(turned, np.abs(turned), rtol=1e-9)


def test_a_new_code_needs_no_new_trace(rooms):
    trajectory = rooms.at([[1.13, 2.31, 1.2], [2.4, 4.73, 0.52]])
    channel = ImageSourceChannel(rooms.paper(), RADIO, 2)
    paths = channel.paths(trajectory)
    codes = RisCode(np.random.default_rng(0).integers(4, size=(2, 6, 6)), 4)
    both = channel.respond(paths, codes)
    panel = np.isin(paths.kind, (PathKind.RIS, PathKind.VRIS))
    np.testing.assert_array_equal(both.gain[:, ~panel], paths.gain[:, ~panel])
    for cycle in range(2):
        one = channel.respond(paths, RisCode(codes.index[cycle], 4))
        np.testing.assert_allclose(both.gain[cycle], one.gain[cycle], rtol=1e-12)
        for p in np.flatnonzero(panel):
            i, j = paths.ris.tx_leg[p], paths.ris.rx_leg[p]
            sum_nm = (paths.ris.tx[cycle, i] * paths.ris.rx[cycle, j] * np.exp(-1j * codes.xi[cycle])).sum()
            assert both.gain[cycle, p] == pytest.approx(sum_nm, rel=1e-9)
    back = channel.respond(both, RisCode(np.zeros((6, 6), dtype=int), 4))
    np.testing.assert_allclose(back.gain, paths.gain, rtol=1e-12)


def test_a_rooms_without_a_panel_ignores_codes(rooms):
    scene = rooms.scene(rooms.box((0, 0, 0), (6, 6, 3)))
    channel = ImageSourceChannel(scene, RADIO, 1)
    paths = channel.paths(rooms.at([1.13, 2.31, 1.2]))
    assert paths.ris is None
    assert channel.respond(paths, RisCode(np.zeros((2, 2), dtype=int), 4)) is paths


def test_a_panel_that_no_leg_reaches(rooms):
    """Everything stands behind it: no panel paths, and codes change nothing."""
    trajectory = rooms.at([1.13, 2.31, 4.0])
    channel = ImageSourceChannel(rooms.scene([], ris=rooms.panel()), RADIO, 1)
    paths = channel.paths(trajectory)
    assert paths.kind.tolist() == [PathKind.LOS, PathKind.PS]
    again = channel.respond(paths, RisCode(np.ones((6, 6), dtype=int), 4))
    np.testing.assert_array_equal(again.gain, paths.gain)


def test_what_is_not_valid_is_zero(rooms):
    paths = ImageSourceChannel(rooms.parted(), RADIO, 2).paths(rooms.at([[1.13, 2.31, 1.2], [5.4, 4.73, 0.52]]))
    assert not paths.valid.all()
    for field in (paths.gain, paths.tau, paths.departure, paths.arrival, paths.vertices):
        assert not field[~paths.valid].any()


def test_legs_check_their_shapes_and_mask_their_gains():
    one = np.ones((1, 2))
    ray, valid = np.ones((1, 2, 3)), np.array([[True, False]])
    legs = SpecularLegs(np.array([[-1], [0]]), valid, 2.0 * one, ray, ray, one, np.zeros((1, 2, 1, 3)))
    assert legs.num_bounces.tolist() == [0, 1]
    gain = legs.gain(0.03)
    assert gain[0, 0] == pytest.approx(0.03 / (8 * np.pi) * np.exp(-4j * np.pi / 0.03))
    assert gain[0, 1] == 0.0
    with pytest.raises(GeometryError, match=r"SpecularLegs\.length"):
        SpecularLegs(
            legs.walls, legs.valid, np.ones((2, 2)), legs.at_device, legs.at_far_end, legs.coefficient, legs.vertices
        )
