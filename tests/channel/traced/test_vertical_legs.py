"""Legs at and near the vertical, where a (theta, phi) basis has its pole, against image sources."""

import numpy as np
import pytest

from rislam_rt.channel.compare.path_matching import named_identity
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.traced import TracedChannel
from rislam_rt.model import Material, RadioConfig, Scatterer
from rislam_rt.model.slab import relative_permittivity, slab_coefficients

RADIO = RadioConfig()
SIZES = {"hall": (60.0, 50.0, 40.0), "room": (6.0, 6.0, 3.0)}
MATERIALS = {"constant": Material(reflection=0.85), "slab": Material(itu="concrete", thickness=0.2)}
BASELINES = (1e-6, 1e-4, 1e-3, 0.05)


def build(rooms, size, material):
    """A box of that size with the panel in the middle of its ceiling and a sphere."""
    size = np.array(size)
    sphere = Scatterer("sphere", size * [0.3, 0.2, 0.4], np.pi * 0.05**2, 0.05)
    panel = rooms.panel(center=tuple(size * [0.5, 0.5, 1.0]))
    return rooms.scene(rooms.box((0, 0, 0), tuple(size), material=material), (sphere,), panel)


def below_panel(rooms, scene, baseline, azimuth, level):
    """Tx or midpoint exactly below the panel's centre, or a millimetre off it."""
    nadir = scene.ris.center * [1.0, 1.0, 0.3]
    along = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    half = 0.5 * baseline * (along if level else np.array([0.0, 0.0, 1.0]))
    return rooms.at([nadir, nadir + half * level, nadir + 1e-3 * along], tx=tuple(-half), rx=tuple(half))


def relative_errors(traced, analytic):
    """Of the complex gains of all matched paths; panel paths against the sum of their elements' magnitudes."""
    columns = {named_identity(analytic, p): p for p in range(analytic.num_paths)}
    found = []
    for p in range(traced.num_paths):
        q = columns.get(named_identity(traced, p))
        rows = np.flatnonzero(traced.valid[:, p] & analytic.valid[:, q]) if q is not None else []
        scale = np.abs(analytic.gain[rows, q])
        if len(rows) and analytic.ris.tx_leg[q] >= 0:
            legs = analytic.ris.tx[rows, analytic.ris.tx_leg[q]] * analytic.ris.rx[rows, analytic.ris.rx_leg[q]]
            scale = np.abs(legs).sum(axis=(1, 2))
        found.append(np.abs(traced.gain[rows, p] - analytic.gain[rows, q]) / scale)
    return np.concatenate(found)


@pytest.mark.parametrize(
    ("name", "walls"),
    [
        ("hall", "slab"),
        ("room", "constant"),
        pytest.param("hall", "constant", marks=pytest.mark.slow),
        pytest.param("room", "slab", marks=pytest.mark.slow),
    ],
)
def test_gains_agree_with_image_sources(rooms, name, walls):
    scene = build(rooms, SIZES[name], MATERIALS[walls])
    channels = TracedChannel(scene, RADIO, 2), ImageSourceChannel(scene, RADIO, 2)
    errors = []
    for baseline in BASELINES:
        for azimuth, level in ((0.0, True), (0.5 * np.pi, True), (0.7, True), (2.4, True), (0.7, False)):
            motion = below_panel(rooms, scene, baseline, azimuth, level)
            errors.append(relative_errors(*(channel.paths(motion) for channel in channels)))
    errors = np.concatenate(errors)
    assert len(errors) > 3000
    # the materials' coefficients are float32: 6e-8 a bounce, times the phase across a slab (2 pi 0.2 m 2.3 / lambda)
    assert errors.max() < (1e-6 if walls == "constant" else 1e-4)


@pytest.mark.parametrize("channel", [TracedChannel, ImageSourceChannel])
def test_an_exactly_vertical_leg_is_the_limit_of_its_neighbours(rooms, channel):
    """Between floor and ceiling of concrete: the slab's coefficient at normal incidence, whatever the azimuth."""
    scene = build(rooms, SIZES["hall"], MATERIALS["slab"])
    permittivity = np.array(relative_permittivity("concrete", RADIO.carrier))
    te, tm = slab_coefficients(np.ones(()), permittivity, np.array(0.2), RADIO.carrier)
    assert te == pytest.approx(-tm)
    for shift in (0.0, 1e-9, 1e-6, 1e-4):
        for azimuth in (0.0, 0.4, 1.9, -2.2):
            half = 0.5 * shift * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]) + [0.0, 0.0, 2.0]
            motion = rooms.at([20.0, 31.0, 11.0], tx=tuple(-half), rx=tuple(half))
            paths = channel(scene, RADIO, 2).paths(motion)
            length = {"LOS": 4.0, "VT floor": 22.0, "VT ceiling": 58.0, "VT floor ceiling": 76.0}
            for number, label in enumerate(("LOS", "VT floor", "VT ceiling", "VT floor ceiling")):
                column = [paths.label(p) for p in range(paths.num_paths)].index(label)
                bare = RADIO.wavelength / (4.0 * np.pi * length[label])
                field = paths.gain[0, column] * np.exp(2j * np.pi * RADIO.carrier * paths.tau[0, column]) / bare
                # theta_hat seen from both ends points the other way after an odd number of bounces
                expected = (1.0, -te, -te, te**2)[number]
                assert field == pytest.approx(expected, rel=1e-4)


def test_sionnas_own_solver_on_our_walls(rooms):
    """A constant wall in Sionna's bases: R at 5e-4 rad from the vertical too, at every azimuth."""
    import sionna.rt as rt

    channel = TracedChannel(build(rooms, SIZES["room"], MATERIALS["constant"]), RADIO, 1)
    scene = channel.tracer_scene.scene
    scene.tx_array = scene.rx_array = rt.PlanarArray(num_rows=1, num_cols=1, pattern="iso", polarization="V")
    for azimuth in (0.3, 0.8, 1.6, 2.9):
        half = 5e-4 * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        scene.add([rt.Transmitter("tx", (-half).tolist()), rt.Receiver("rx", half.tolist())])
        paths = rt.PathSolver(deterministic=True)(scene, max_depth=1, samples_per_src=5000, los=False)
        scene.remove(["tx", "rx"])
        tau, gain = np.array(paths.tau).ravel(), np.hypot(*(np.array(part).ravel() for part in paths.a))
        vertical = np.isclose(tau, 3.0 / 299_792_458.0, rtol=1e-5)
        assert vertical.sum() == 2  # floor and ceiling, 1.5 m off
        np.testing.assert_allclose(gain[vertical], 0.85 * RADIO.wavelength / (4.0 * np.pi * 3.0), rtol=1e-4)
