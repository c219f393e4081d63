"""Antennas in both channels: Sionna's patterns and materials against formulas, path by path."""

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.image_source.antennas import amplitude
from rislam_rt.channel.traced import TracedChannel
from rislam_rt.geometry.angles import unit
from rislam_rt.model import Antennas, Material, PathKind, RadioConfig

RADIO = RadioConfig()
WALLS = [Material(reflection=0.85), Material(itu="concrete", thickness=0.2)]
ENDS = [
    Antennas("dipole", "hw_dipole"),
    Antennas("tr38901", "tr38901"),
    Antennas("iso", "dipole", "H"),
    Antennas("tr38901", "iso", "V", "H"),
    Antennas("hw_dipole", "tr38901", "H", "V"),
]


@pytest.mark.parametrize(("antennas", "wall"), [*((ends, WALLS[1]) for ends in ENDS), (ENDS[1], WALLS[0])])
def test_both_channels_agree_path_by_path(rooms, antennas, wall):
    """All classes up to two bounces; float32 materials and patterns: 1e-4 of a path, and a null is one to 1e-6 of what
    isotropic antennas of one polarisation would hear on the same path.
    """
    scene = rooms.paper(material=wall)
    agent = rooms.at([[1.3, 2.1, 0.8], [4.1, 3.2, 1.7]], tx=(-0.05, 0.02, 0.03), rx=(0.04, -0.03, -0.02))
    object.__setattr__(agent, "heading", np.array([0.7, -2.3]))
    traced = TracedChannel(scene, RADIO, 2, antennas=antennas).paths(agent)
    exact = ImageSourceChannel(scene, RADIO, 2, antennas=antennas).paths(agent)
    plain = ImageSourceChannel(rooms.paper(), RADIO, 2).paths(agent)
    place = {exact.identity(p): p for p in range(exact.num_paths)}
    scale = {plain.identity(p): p for p in range(plain.num_paths)}
    assert traced.num_paths == exact.num_paths == len(place)
    assert {int(kind) for kind in traced.kind} == {int(kind) for kind in PathKind}
    for p in range(traced.num_paths):
        other, reference = place[traced.identity(p)], scale[traced.identity(p)]
        np.testing.assert_array_equal(traced.valid[:, p], exact.valid[:, other])
        error = np.abs(traced.gain[:, p] - exact.gain[:, other])
        # 8 dBi at either end; phase: 1e-9 m in 3 cm
        limit = 1e-4 * np.abs(exact.gain[:, other]) + 6.3e-5 * np.abs(plain.gain[:, reference]) + 1e-12
        assert (error <= limit).all(), traced.label(p)


def test_plain_antennas_are_those_that_nobody_names(rooms):
    agent = rooms.at([1.3, 2.1, 0.8])
    scene = rooms.paper(material=WALLS[1])
    named = ImageSourceChannel(scene, RADIO, 2, antennas=Antennas("iso", "iso", "V", "V")).paths(agent)
    np.testing.assert_array_equal(named.gain, ImageSourceChannel(scene, RADIO, 2).paths(agent).gain)


def test_a_crossed_link_hears_nothing_over_walls_that_keep_polarisation(rooms):
    """R times either component leaves vertical vertical; a slab hit aslant turns some of it."""
    agent, crossed = rooms.at([1.3, 2.1, 0.8]), Antennas("iso", "iso", "V", "H")
    kept = ImageSourceChannel(rooms.paper(), RADIO, 2, antennas=crossed).paths(agent)
    assert np.abs(kept.gain).max() < 1e-15
    turned = ImageSourceChannel(rooms.paper(material=WALLS[1]), RADIO, 2, antennas=crossed).paths(agent)
    assert np.abs(turned.gain).max() > 1e-6


@pytest.mark.parametrize(("pattern", "total"), [("iso", 1.0), ("dipole", 1.0), ("hw_dipole", 1.643 / 1.6409)])
def test_a_lossless_antenna_radiates_what_it_gets(pattern, total):
    """The mean of the gain over all directions; Balanis rounds the half-wave dipole's directivity up."""
    theta, weight = np.polynomial.legendre.leggauss(200)
    direction = np.column_stack([np.sqrt(1.0 - theta**2), np.zeros(200), theta])
    mean = 0.5 * np.sum(weight * amplitude(pattern, direction, np.zeros(200)) ** 2)
    assert mean == pytest.approx(total, rel=1e-4)


def test_a_sector_has_its_beam_ahead_and_half_its_power_at_the_edge():
    """TR 38.901: 8 dBi ahead, 3 dB less half a beam width aside in either plane, 30 dB less behind; it turns along."""
    half = np.radians(32.5)
    ways = np.array([[1, 0, 0], [np.cos(half), np.sin(half), 0], [np.cos(half), 0, np.sin(half)], [-1, 0, 0]])
    level = 20.0 * np.log10(amplitude("tr38901", unit(ways), np.zeros(4)))
    np.testing.assert_allclose(level, [8.0, 5.0, 5.0, -22.0], atol=1e-9)
    c, s = np.cos(2.0), np.sin(2.0)
    turned = ways @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(20.0 * np.log10(amplitude("tr38901", turned, np.full(4, 2.0))), level, atol=1e-9)
