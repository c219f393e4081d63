"""Diffuse scattering against its integral over the wall, diffraction against the shortest way over an edge."""

import numpy as np
import pytest

from rislam_rt.channel.traced import DiffuseConfig, DiffuseKind
from rislam_rt.channel.traced.diffuse_paths import trace_diffuse_paths
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import ConfigError
from rislam_rt.model import Material, RadioConfig

RADIO = RadioConfig()


def test_switches_off_add_nothing(rooms):
    extras = trace_diffuse_paths(rooms.paper(), RADIO, rooms.at([1.3, 2.1, 0.8]), DiffuseConfig())
    assert len(extras) == 0
    assert extras.source == "traced, no analytic twin"


@pytest.mark.parametrize("scattering", [0.4, pytest.param(0.8, marks=pytest.mark.slow)])
def test_scattered_power_is_the_lambertian_integral(rooms, scattering):
    """(lambda / 4 pi)^2 S^2 R^2 / pi times the integral of cos cos / (d1^2 d2^2) over a wall of 40 m."""
    side = 20.0
    floor = rooms.polygon("floor", [(-side, -side, 0), (side, -side, 0), (side, side, 0), (-side, side, 0)])
    trajectory = rooms.at([0.0, 0.0, 2.0], tx=(-0.5, 0.2, 0.1), rx=(0.4, -0.3, -0.3))
    extras = trace_diffuse_paths(
        rooms.scene([floor], ()), RADIO, trajectory, DiffuseConfig(scattering=scattering, samples=100_000)
    )
    assert set(extras.kind) == {DiffuseKind.DIFFUSE}
    cells = 1000
    line = ((np.arange(cells) + 0.5) / cells * 2.0 - 1.0) * side
    x, y = np.meshgrid(line, line)
    points = np.stack([x, y, np.zeros_like(x)], axis=-1)
    tx, rx = trajectory.tx[0], trajectory.rx[0]
    a, b = (np.linalg.norm(points - end, axis=-1) for end in (tx, rx))
    integral = np.sum(tx[2] * rx[2] / (a**3 * b**3)) * (2.0 * side / cells) ** 2
    expected = (RADIO.wavelength / (4.0 * np.pi)) ** 2 * (scattering * 0.85) ** 2 / np.pi * integral
    # about 50 000 S^2 rays fall on the floor and scatter, with weights that vary by about their mean: 1 in sqrt(n)
    power = np.sum(np.abs(extras.gain) ** 2)
    assert power == pytest.approx(expected, rel=4.0 / np.sqrt(len(extras)))
    np.testing.assert_allclose(extras.vertices[:, 0, 2], 0.0, atol=1e-5)


def test_scattered_paths_run_over_their_vertices(rooms):
    trajectory = rooms.at([[1.3, 2.1, 0.8], [4.4, 0.9, 2.2]])
    scene = rooms.paper(material=Material(itu="concrete", thickness=0.2))
    extras = trace_diffuse_paths(scene, RADIO, trajectory, DiffuseConfig(scattering=0.5, samples=2000))
    assert set(extras.cycle) == {0, 1}
    tx, rx = trajectory.tx[extras.cycle], trajectory.rx[extras.cycle]
    out, back = extras.vertices[:, 0] - tx, extras.vertices[:, 0] - rx
    length = np.linalg.norm(out, axis=1) + np.linalg.norm(back, axis=1)
    np.testing.assert_allclose(SPEED_OF_LIGHT * extras.tau, length, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(np.cross(out, extras.departure), axis=1), 0.0, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(np.cross(back, extras.arrival), axis=1), 0.0, atol=1e-5)


def test_diffraction_over_a_board_takes_the_shortest_way(rooms):
    """Fermat over each of the four edges, and a knife edge's loss over the highest."""
    board = rooms.polygon("board", [(3, -2, 0), (3, 2, 0), (3, 2, 2), (3, -2, 2)])
    trajectory = rooms.at([3.0, 0.0, 1.5], tx=(-2.0, 0.1, 0.0), rx=(2.0, -0.2, -0.2))
    extras = trace_diffuse_paths(
        rooms.scene([board], ()), RADIO, trajectory, DiffuseConfig(diffraction=True, samples=4_000)
    )
    assert extras.kind.tolist() == [DiffuseKind.DIFFRACTED] * 4
    tx, rx = trajectory.tx[0], trajectory.rx[0]
    corners = board.vertices
    expected = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge = start + np.linspace(0.0, 1.0, 20001)[:, None] * (end - start)
        expected.append((np.linalg.norm(edge - tx, axis=1) + np.linalg.norm(edge - rx, axis=1)).min())
    length = SPEED_OF_LIGHT * extras.tau
    np.testing.assert_allclose(np.sort(length), np.sort(expected), atol=1e-5)
    top = int(np.argmin(length))
    height = 2.0 - 0.5 * (tx[2] + rx[2])
    fresnel = height * np.sqrt(2.0 * 4.0 / (RADIO.wavelength * 2.0 * 2.0))
    knife_edge = 6.9 + 20.0 * np.log10(np.hypot(fresnel - 0.1, 1.0) + fresnel - 0.1)  # ITU-R P.526
    free = 20.0 * np.log10(RADIO.wavelength / (4.0 * np.pi * 4.0))
    # a board that reflects 0.85 is not the absorbing screen of the knife edge; the two differ by some dB in the shadow
    assert 20.0 * np.log10(np.abs(extras.gain[top])) == pytest.approx(free - knife_edge, abs=5.0)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"scattering": 1.5}, r"extras\.scattering: 1\.5 received"),
        ({"depth": 0}, r"extras\.depth: 0 received"),
        ({"samples": 0}, r"extras\.samples: 0 received"),
    ],
)
def test_bad_switches(setting, message):
    with pytest.raises(ConfigError, match=message):
        DiffuseConfig(**setting)
