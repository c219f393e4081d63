"""Mie series of a conducting sphere against its limits and conservation laws."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.cross_section import cross_section, mie_amplitudes, mie_coefficients, sphere_rcs
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import RadioConfig


def with_exact_spheres(scene):
    return replace(scene, scatterers=tuple(replace(one, law="mie") for one in scene.scatterers))


BACK = np.array(np.pi)
WAVELENGTH = 299_792_458.0 / 10e9


def test_rayleigh_limit():
    """A small sphere: sigma = 9 pi r^2 (k r)^4 backwards; next order of relative size (k r)^2."""
    radius = 0.01 / (2 * np.pi)
    across, within = sphere_rcs(radius, 1.0, BACK)
    assert across == pytest.approx(9 * np.pi * radius**2 * 0.01**4, rel=1e-3)
    assert within == pytest.approx(across, rel=1e-12)


def test_optical_limit():
    """A large sphere: sigma swings about pi r^2 by a creeping wave that dies out."""
    ratios = np.array(
        [sphere_rcs(x / (2 * np.pi), 1.0, BACK)[0] / (np.pi * (x / (2 * np.pi)) ** 2) for x in range(60, 80)]
    )
    np.testing.assert_allclose(ratios, 1.0, atol=0.02)


def test_resonance_peak():
    """The first and highest peak of the textbook curve: 3.65 pi r^2 at k r = 1.03."""
    sizes = np.linspace(0.8, 1.3, 501)
    ratios = [sphere_rcs(x / (2 * np.pi), 1.0, BACK)[0] / (np.pi * (x / (2 * np.pi)) ** 2) for x in sizes]
    assert max(ratios) == pytest.approx(3.65, abs=0.05)
    assert sizes[np.argmax(ratios)] == pytest.approx(1.03, abs=0.03)


@pytest.mark.parametrize("size", [0.3, 2.0, 10.48, 40.0])
def test_energy_and_the_optical_theorem(size):
    """A conductor absorbs nothing: what is scattered over all angles is what the forward amplitude takes out."""
    a, b = mie_coefficients(size)
    n = np.arange(1, len(a) + 1)
    extinct = 2 / size**2 * np.sum((2 * n + 1) * (a + b).real)
    cosine, weight = np.polynomial.legendre.leggauss(400)
    s1, s2 = mie_amplitudes(size, cosine)
    scattered = np.sum(weight * (np.abs(s1) ** 2 + np.abs(s2) ** 2)) / size**2
    assert scattered == pytest.approx(extinct, rel=1e-9)
    forward = mie_amplitudes(size, np.array(1.0))[0]
    assert 4 / size**2 * forward.real == pytest.approx(extinct, rel=1e-12)


def test_the_papers_sphere_is_within_half_a_decibel_of_physical_optics(rooms):
    scene = with_exact_spheres(rooms.paper())
    exact = cross_section(scene.scatterers[0], WAVELENGTH, np.eye(3)[0], np.eye(3)[1])
    assert exact == sphere_rcs(0.05, WAVELENGTH, BACK)[0]
    assert exact != np.pi * 0.05**2
    assert 10 * np.log10(exact / (np.pi * 0.05**2)) == pytest.approx(0.0, abs=0.5)


def test_the_scene_decides_which_law_the_channel_takes(rooms):
    """Gain over that of the nominal cross-section: the square root of the ratio, for every path of the sphere."""
    room, poses, radio = rooms.paper(), rooms.at([1.13, 2.31, 1.2]), RadioConfig()
    plain, exact = (ImageSourceChannel(s, radio, 1).paths(poses) for s in (room, with_exact_spheres(room)))
    sphere = plain.landmark == 0
    ratio = np.sqrt(sphere_rcs(0.05, radio.wavelength, BACK)[0] / (np.pi * 0.05**2))
    np.testing.assert_allclose(exact.gain[:, sphere], ratio * plain.gain[:, sphere], rtol=1e-12)
    np.testing.assert_array_equal(exact.gain[:, ~sphere], plain.gain[:, ~sphere])
