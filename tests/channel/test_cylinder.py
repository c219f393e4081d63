"""Cylinder by physical optics: textbook value, the surface integral itself, mean over directions, and the channel."""

import numpy as np
import pytest

from rislam_rt.channel.cross_section import cross_section, cylinder_rcs
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import PathKind, RadioConfig, Scatterer

WAVELENGTH = 0.03
AXIS = np.array([0.0, 0.0, 1.0])


def direction(elevation, azimuth=0.0):
    return np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation) + 0.0 * azimuth],
        -1,
    )


def test_broadside_is_the_textbooks():
    side = direction(0.0)
    value = cylinder_rcs(0.1, 0.4, AXIS, WAVELENGTH, side, side)
    assert value == pytest.approx(2 * np.pi * 0.1 * 0.4**2 / WAVELENGTH, rel=1e-12)


def surface_integral(radius, height, toward_tx, toward_rx):
    """`4 pi / lambda^2 |integral of n . (s + r) / 2 exp(j q . x) dS|^2` over the side that q looks at, by sampling."""
    q = 2 * np.pi / WAVELENGTH * (toward_tx + toward_rx)
    half = np.pi / 2 * np.linspace(-1.0, 1.0, 8001)
    middle = np.arctan2(q[1], q[0])
    # the edges of the lit side add ripples that a smooth surface has not: taper them off
    taper = np.cos(half) ** 2
    normal = np.stack([np.cos(half + middle), np.sin(half + middle), 0.0 * half], axis=-1)
    ring = taper * (normal @ (toward_tx + toward_rx) / 2) * np.exp(1j * radius * (normal @ q))
    around = radius * np.sum(ring) * (half[1] - half[0])
    z = height * (np.arange(4000) + 0.5) / 4000 - height / 2
    along = np.sum(np.exp(1j * q[2] * z)) * height / 4000
    return 4 * np.pi / WAVELENGTH**2 * np.abs(around * along) ** 2


@pytest.mark.parametrize(
    ("toward_tx", "toward_rx"),
    [
        (direction(0.0), direction(0.0)),
        (direction(0.1, 0.3), direction(-0.07, 1.2)),
        (direction(0.4, 2.0), direction(-0.33, 2.9)),
        (direction(0.02, -1.0), direction(0.05, -0.4)),
    ],
)
def test_stationary_phase_against_the_integral(toward_tx, toward_rx):
    """The error of stationary phase falls with the girth in wavelengths: with |q| r = 200 to 400, below 2 %."""
    value = cylinder_rcs(1.0, 0.25, AXIS, WAVELENGTH, toward_tx, toward_rx)
    assert value == pytest.approx(surface_integral(1.0, 0.25, toward_tx, toward_rx), rel=0.02)


def test_mean_backscattering_is_the_nominal_value():
    """pi r h / 2 for cylinders of many wavelengths, whatever the wavelength; lobes end at the poles: 1 / (k h)."""
    elevation = np.arcsin(np.linspace(-1, 1, 40_001))
    value = cylinder_rcs(0.1, 1.0, AXIS, WAVELENGTH, direction(elevation), direction(elevation))
    assert value.mean() == pytest.approx(np.pi * 0.1 * 1.0 / 2, rel=0.01)


@pytest.mark.parametrize(("radius", "height", "distance"), [(0.1, 1.0, 2.0), (0.1, 1.0, 5.0), (0.05, 1.7, 2.0)])
def test_a_long_cylinder_nearby_has_pi_r_d(radius, height, distance):
    """What docs/scenes.md gives before the far field: geometrical optics, against the surface integral over spherical
    waves from one place and back. The ends leave ripples of Fresnel's integrals, -2.33 to 2.56 dB."""
    half, z = np.meshgrid(np.linspace(-1.5, 1.5, 501), height * np.linspace(-0.5, 0.5, 1001), indexing="ij")
    x, y = distance - radius * np.cos(half), -radius * np.sin(half)
    way = np.sqrt(x**2 + y**2 + z**2)
    lit = np.clip((np.cos(half) * x + np.sin(half) * y) / way, 0.0, None) * np.cos(half) ** 2
    field = np.mean(lit * np.exp(4j * np.pi / WAVELENGTH * way) * (distance / way) ** 2) * 3.0 * radius * height
    ratio = 4 * np.pi / WAVELENGTH**2 * np.abs(field) ** 2 / (np.pi * radius * distance)
    assert 10**-0.25 < ratio < 10**0.27
    assert np.pi * radius * (2 * height**2 / WAVELENGTH) == pytest.approx(
        cylinder_rcs(radius, height, AXIS, WAVELENGTH, direction(0.0), direction(0.0)), rel=1e-12
    )


def test_reciprocal_and_turned_with_its_axis():
    rng = np.random.default_rng(4)
    tx, rx = rng.normal(size=(2, 20, 3))
    tx, rx = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (tx, rx))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    value = cylinder_rcs(0.1, 0.4, AXIS, WAVELENGTH, tx, rx)
    np.testing.assert_allclose(cylinder_rcs(0.1, 0.4, AXIS, WAVELENGTH, rx, tx), value, rtol=1e-12)
    turned = cylinder_rcs(0.1, 0.4, turn @ AXIS, WAVELENGTH, tx @ turn.T, rx @ turn.T)
    np.testing.assert_allclose(turned, value, rtol=1e-9, atol=1e-15)


def test_the_channel_asks_for_each_pair_of_directions(rooms):
    """PS and VS gains against eq. `a2` with the cross-section between the path's own last directions."""
    post = Scatterer("post", np.array([2.0, 1.0, 1.0]), 0.01, 0.05, "cylinder", 0.3, np.array([0.6, 0.0, 0.8]))
    radio = RadioConfig()
    trajectory = rooms.at([[1.13, 2.31, 1.2], [4.2, 3.3, 0.7]])
    scene = rooms.scene(rooms.box((0, 0, 0), (6, 6, 3)), (post,))
    paths = ImageSourceChannel(scene, radio, 2).paths(trajectory)
    seen = 0
    for cycle, p in np.argwhere(paths.valid & np.isin(paths.kind, (PathKind.PS, PathKind.VS))):
        _, _, tx_walls, rx_walls = paths.identity(p)
        points = np.vstack([trajectory.tx[cycle], paths.vertices[cycle, p, : paths.num_vertices[p]],
                            trajectory.rx[cycle]])  # fmt: skip
        at = 1 + len(tx_walls)
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        toward = [(points[at + side] - points[at]) / np.linalg.norm(points[at + side] - points[at]) for side in (-1, 1)]
        sigma = cross_section(post, radio.wavelength, *toward)
        bounces = len(tx_walls) + len(rx_walls)
        amplitude = radio.wavelength * np.sqrt(sigma) / ((4 * np.pi) ** 1.5 * steps[:at].sum() * steps[at:].sum())
        # near a null of the pattern sigma goes with a small difference
        assert abs(paths.gain[cycle, p]) == pytest.approx(amplitude * 0.85**bounces, rel=1e-7, abs=1e-16)
        seen += 1
    assert seen > 100
