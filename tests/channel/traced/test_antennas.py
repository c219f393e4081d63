"""Antenna patterns and polarisation on both legs: closed forms, and Sionna's own solver with turned devices."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.traced import Antennas, TracedChannel
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import ConfigError
from rislam_rt.model import Material, PathKind, RadioConfig

RADIO = RadioConfig()


def gains(scene, trajectory, **antennas):
    """Complex gains of the first cycle, and the paths."""
    paths = TracedChannel(scene, RADIO, 1, antennas=Antennas(**antennas)).paths(trajectory)
    return paths.gain[0], paths


def sines(direction):
    """Sine of the zenith angle."""
    return np.hypot(direction[..., 0], direction[..., 1])


def test_short_dipoles_on_every_class(rooms):
    """sqrt(3/2) sin(theta) at either device, nothing at the landmark, on every class of path."""
    scene, trajectory = rooms.paper(), rooms.at([1.3, 2.1, 0.8], tx=(-0.05, 0.02, 0.03), rx=(0.04, -0.03, -0.02))
    plain, paths = gains(scene, trajectory)
    both, _ = gains(scene, trajectory, tx="dipole", rx="dipole")
    only_rx, _ = gains(scene, trajectory, rx="dipole")
    assert set(paths.kind) == set(PathKind)
    at_tx, at_rx = (np.sqrt(1.5) * sines(d[0]) for d in (paths.departure, paths.arrival))
    # float32 fields; the panel's sums near a null magnify them, hence the absolute part
    np.testing.assert_allclose(both, plain * at_tx * at_rx, rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(only_rx, plain * at_rx, rtol=1e-4, atol=1e-9)


def test_horizontal_waves_keep_constant_walls(rooms):
    """Magnitudes as with vertical ones; phi_hat turns round between the two ends of a leg, which is a sign a leg."""
    scene, trajectory = rooms.paper(), rooms.at([1.3, 2.1, 0.8])
    vertical, paths = gains(scene, trajectory)
    horizontal, _ = gains(scene, trajectory, polarization="H")
    sign = np.where(paths.landmark < 0, -1.0, 1.0)
    np.testing.assert_allclose(horizontal, sign * vertical, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("polarization", ["V", "H"])
def test_against_sionna_with_turned_sectors_and_slabs(rooms, polarization):
    """TR 38.901 sectors turned with the heading in a room of concrete: direct path and wall returns."""
    import sionna.rt as rt

    scene = rooms.paper(material=Material(itu="concrete", thickness=0.2))
    trajectory = replace(rooms.at([4.05, 4.0, 0.9], tx=(-0.05, 0.01, -0.02), rx=(0.05, -0.03, 0.02)), heading=[0.7])
    channel = TracedChannel(scene, RADIO, 1, antennas=Antennas("tr38901", "dipole", polarization))
    paths = channel.paths(trajectory)
    stage, origin = channel.tracer_scene.scene, channel.tracer_scene.origin
    array = {"num_rows": 1, "num_cols": 1, "polarization": polarization}
    stage.tx_array, stage.rx_array = (
        rt.PlanarArray(**array, pattern="tr38901"),
        rt.PlanarArray(**array, pattern="dipole"),
    )
    tx, rx = (p[0] - origin for p in (trajectory.tx, trajectory.rx))
    stage.add(rt.Transmitter("tx", tx.tolist(), orientation=[0.7, 0.0, 0.0]))
    stage.add(rt.Receiver("rx", rx.tolist(), orientation=[0.7, 0.0, 0.0]))
    solved = rt.PathSolver(deterministic=True)(stage, max_depth=1, samples_per_src=5000, refraction=False)
    tau, gain = np.array(solved.tau).ravel(), np.array(solved.a[0]).ravel() + 1j * np.array(solved.a[1]).ravel()
    keep = np.flatnonzero(np.isin(paths.kind, [PathKind.LOS, PathKind.VT]))
    keep = keep[np.argsort(paths.tau[0, keep])]
    order = np.argsort(tau)
    assert len(order) == len(keep) == 7
    np.testing.assert_allclose(paths.tau[0, keep], tau[order], atol=1e-5 / SPEED_OF_LIGHT)
    ours = paths.gain[0, keep] * np.exp(2j * np.pi * RADIO.carrier * paths.tau[0, keep])
    # 30 dB below the strongest a sector's far side is reached, whose float32 angles decide the last digits
    np.testing.assert_allclose(ours, gain[order], rtol=1e-3, atol=1e-6 * np.abs(gain).max())


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"tx": "yagi"}, r"antennas\.tx: 'yagi' received"),
        ({"rx": ""}, r"antennas\.rx: '' received"),
        ({"polarization": "X"}, r"antennas\.polarization: 'X' received"),
    ],
)
def test_bad_antennas(setting, message):
    with pytest.raises(ConfigError, match=message):
        Antennas(**setting)
