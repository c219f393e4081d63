"""Published and closed-form figures from the analytic channel: Friis, eq. a2, and the panel's gains."""

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.design import exact_code
from rislam_rt.model import PathKind, RadioConfig, RisCode, Scatterer
from rislam_rt.ris import panel_gain

RADIO = RadioConfig()


def db(gain):
    return 20.0 * np.log10(np.abs(gain))


def pair(rooms, position):
    """The agent's midpoint with Tx and Rx 0.05 m to either side along x."""
    return rooms.at(position, tx=(-0.05, 0.0, 0.0), rx=(0.05, 0.0, 0.0))


def column(paths, kind, tx_walls=(), rx_walls=()):
    """The column of a path class over walls given by name."""
    names = [([paths.walls[w] for w in paths.identity(p)[2]], [paths.walls[w] for w in paths.identity(p)[3]])
             for p in range(paths.num_paths)]  # fmt: skip
    (found,) = [p for p, n in enumerate(names) if paths.kind[p] == kind and n == (list(tx_walls), list(rx_walls))]
    return found


# Exact discrete, continuous, random (rms), all zero, from the method's reference table for the panel of the paper.
PANEL = {
    0.5: (-98.63, -97.76, -113.32, -135.44),
    1.5: (-88.51, -87.65, -103.21, -118.25),
    3.0: (-78.87, -78.86, -94.42, -78.87),
}


@pytest.mark.parametrize("x", PANEL)
def test_panel_gains(rooms, x):
    channel = ImageSourceChannel(rooms.paper(), RADIO, 0)
    # The table's agent is on the floor; there the floor itself plays no part in the direct path.
    paths = channel.paths(pair(rooms, [x, x, 0.0]))
    p = column(paths, PathKind.RIS)
    products = paths.ris.tx[0, paths.ris.tx_leg[p]] * paths.ris.rx[0, paths.ris.rx_leg[p]]
    discrete = db(exact_code(products.ravel(), 4)[1])
    continuous = db(np.abs(products).sum())
    random = db(np.sqrt((np.abs(products) ** 2).sum()))
    # 0.005: the table has two decimals
    np.testing.assert_allclose([discrete, continuous, random, db(paths.gain[0, p])], PANEL[x], atol=0.006)


def test_a_random_code_has_the_rms_gain_on_average(rooms):
    rng = np.random.default_rng(3)
    channel = ImageSourceChannel(rooms.paper(), RADIO, 0)
    paths = channel.paths(pair(rooms, [1.5, 1.5, 0.0]))
    p = column(paths, PathKind.RIS)
    codes = RisCode(rng.integers(4, size=(4000, 6, 6)), 4)
    tx, rx = paths.ris.tx[0, paths.ris.tx_leg[p]], paths.ris.rx[0, paths.ris.rx_leg[p]]
    rms = np.sqrt(np.mean(np.abs(panel_gain(tx, rx, codes)) ** 2))
    # |gain|^2 is about exponential: relative error of the mean of 4000 is 1.6 %, 0.07 dB; three of those
    assert db(rms) == pytest.approx(-103.21, abs=0.21)
    one = channel.respond(paths, RisCode(codes.index[0], 4))
    assert one.gain[0, p] == pytest.approx(panel_gain(tx, rx, RisCode(codes.index[0], 4)), rel=1e-12)


def test_leakage_and_ceiling(rooms):
    paths = ImageSourceChannel(rooms.paper(), RADIO, 1).paths(pair(rooms, [3.0, 3.0, 1e-3]))
    assert db(paths.gain[0, column(paths, PathKind.LOS)]) == pytest.approx(-32.45, abs=0.01)
    # at normal incidence from the floor, 3 m up and down
    assert db(paths.gain[0, column(paths, PathKind.VT, ["ceiling"])]) == pytest.approx(-69.4, abs=0.05)


def test_scatterers(rooms):
    trajectory = rooms.at([4.05, 4.0, 0.5], tx=(-0.05, 0.0, 0.0), rx=(0.05, 0.0, 0.0))
    paths = ImageSourceChannel(rooms.paper(), RADIO, 0).paths(trajectory)
    assert np.abs(paths.gain[0, column(paths, PathKind.PS)]) == pytest.approx(4.4332e-6, rel=2e-5)
    # a sphere as wide as the panel (0.09 m), where the panel is, seen from below
    sphere = Scatterer("twin", np.array([3.0, 3.0, 3.0]), np.pi * 0.045**2, 0.045)
    room = rooms.scene(rooms.box((0, 0, 0), (6, 6, 3)), [sphere])
    twin = ImageSourceChannel(room, RADIO, 0).paths(pair(rooms, [3.0, 3.0, 0.0]))
    assert db(twin.gain[0, column(twin, PathKind.PS)]) == pytest.approx(-104.5, abs=0.05)


def test_wall_coupled_paths_multiply_their_legs(rooms):
    """Eq. a2 with a specular leg: the gain is that of two Friis legs, one of them from the mirrored device."""
    scene = rooms.paper()
    trajectory = rooms.at([4.0, 4.2, 1.1])
    paths = ImageSourceChannel(scene, RADIO, 2).paths(trajectory)
    tx, rx, point = trajectory.tx[0], trajectory.rx[0], scene.scatterers[0].position
    image = rx * [-1.0, 1.0, 1.0]
    lam = RADIO.wavelength
    out, back = np.linalg.norm(tx - point), np.linalg.norm(image - point)
    want = np.sqrt(scene.scatterers[0].rcs) * lam * 0.85 / ((4 * np.pi) ** 1.5 * out * back)
    want *= np.exp(-2j * np.pi / lam * (out + back))
    p = column(paths, PathKind.VS, [], ["wall_x0"])
    assert paths.gain[0, p] == pytest.approx(want, rel=1e-9)


def test_antenna_gains_scale_every_path(rooms):
    loud = RadioConfig(tx_gain=4.0, rx_gain=2.5)
    trajectory = rooms.at([1.4, 2.2, 1.1])
    plain, more = (ImageSourceChannel(rooms.paper(), radio, 2).paths(trajectory) for radio in (RADIO, loud))
    np.testing.assert_allclose(more.gain, plain.gain * np.sqrt(10.0), rtol=1e-12)
