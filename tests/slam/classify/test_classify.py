"""Features against exact geometry, the network against itself written out, files, and the two classes by hand."""

import io
from itertools import pairwise

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Body, RadioConfig
from rislam_rt.slam.classify import (
    FEATURES,
    Network,
    Sightings,
    classify,
    classify_geometric,
    fit_motion,
    load_classifier,
    network_arrays,
    read_network,
    track_features,
)
from rislam_rt.slam.classify.echo_misfit import FAR, echo_misfit
from rislam_rt.slam.classify.image_misfit import image_misfit

RADIO, BODY, WINDOW = RadioConfig(), Body(), 40
START, HEADING = np.array([1.0, 1.2, 0.5]), 0.4
POINT = np.array([3.1, 2.6, 1.9])
WALLS = {
    "x": (np.array([1.0, 0.0, 0.0]), 5.0),
    "y": (np.array([0.0, 1.0, 0.0]), 4.0),
    "z": (np.array([0.0, 0, 1]), 3.0),
}


def _walk():
    way = np.arange(WINDOW)[:, None] * 0.01 * np.array([np.cos(HEADING), np.sin(HEADING), 0.0])
    return START + way, np.full(WINDOW, HEADING)


def _mirror(points, *walls):
    for name in walls:
        normal, offset = WALLS[name]
        points = points + 2.0 * (offset - points @ normal)[:, None] * normal
    return points


def _seen(source, extra):
    """(W, 3) of a path that seems to come from `source` (W, 3), `extra` (W,) metres longer than from there."""
    position, heading = _walk()
    _, rx = BODY.ends(position, heading)
    way = source - rx
    reach = np.linalg.norm(way, axis=1)
    cosines = np.einsum("kji,kj->ki", rotation_z(heading), way / reach[:, None])[:, :2]
    return np.column_stack([reach + extra, cosines])


def _scatterer():
    tx, _ = BODY.ends(*_walk())
    return _seen(np.tile(POINT, (WINDOW, 1)), np.linalg.norm(POINT - tx, axis=1))


def _wall(*walls):
    tx, _ = BODY.ends(*_walk())
    return _seen(_mirror(tx, *walls), 0.0)


def _latest(tracks):
    """(T, 3) last lengths of tracks, and cosines in the room's axes."""
    seen = np.stack(tracks)[:, -1]
    turned = np.einsum("ij,tj->ti", rotation_z(np.array(HEADING))[:2, :2], seen[:, 1:])
    return np.column_stack([seen[:, 0], turned])


def _sightings(tracks, ratio):
    """Sightings of noise-free tracks whose amplitudes are `ratio` (T,) times free space."""
    seen = np.stack(tracks)
    free = RADIO.wavelength / (4.0 * np.pi * seen[..., 0])
    std = np.broadcast_to([1e-3, 1e-3, 1e-3], seen.shape)
    held = np.ones(seen.shape[:2], dtype=bool)
    return Sightings(seen, std, np.log(free * np.array(ratio)[:, None]), held, *_walk())


def test_turn_and_approach_of_the_simple_cases():
    """Noise-free. What is left: the priors' pull, the second order of 0.4 m of motion, and the baseline: a wall's
    return comes in 0.1 m / length away from where it goes out, which the motion's other component turns into 0.05."""
    fit = fit_motion(_sightings([_scatterer(), _wall("x"), _wall("y")], [0.02, 0.8, 0.8]))
    assert fit.approach == pytest.approx([2.0, 2.0, 2.0], abs=0.07)
    assert fit.turn == pytest.approx([1.0, 0.0, 0.0], abs=0.05)
    assert fit.misfit_static[0] < 0.1 < 0.5 < fit.misfit_moving[0]
    assert (fit.misfit_moving[1:] < 0.1).all()
    assert (fit.misfit_static[1:] > 3.0 * fit.misfit_moving[1:]).all()


def test_a_corner_moves_as_a_point_does():
    """Two upright walls at right angles: the image turns about the corner, which lies in the agent's own height."""
    fit = fit_motion(_sightings([_wall("x", "y")], [0.6]))
    assert fit.turn[0] == pytest.approx(1.0, abs=0.1)
    assert fit.approach[0] == pytest.approx(2.0, abs=0.07)
    assert fit.height[0] < 0.02


def test_an_echo_is_where_both_walls_say():
    """Exact for walls at right angles, for any baseline; the scatterer is no echo of theirs."""
    tracks = [_wall("x"), _wall("y"), _wall("z"), _wall("x", "y"), _wall("x", "z"), _scatterer()]
    seen = _latest(tracks)
    offset = rotation_z(np.array(HEADING)) @ (BODY.tx_offset - BODY.rx_offset)
    strength = np.log([0.8, 0.7, 0.6, 0.56, 0.48, 0.02])
    std = np.full(seen.shape, 1e-9)
    echo = echo_misfit(seen, std, strength, offset)
    assert echo.misfit[3:5] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert echo.strength[3:5] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert echo.misfit[5] > 10.0
    assert echo.misfit[0] == FAR
    empty = echo_misfit(seen[:1], std[:1], strength[:1], offset)
    assert empty.misfit.tolist() == [FAR]


@pytest.mark.parametrize("mirrors", [("", "x"), ("x", ""), ("x", "x"), ("x", "y"), ("", "xy")])
def test_an_image_is_where_point_and_walls_say(mirrors):
    """Exact for any walls and baseline: over walls on the Tx leg, the Rx leg, both. Strengths follow from both legs."""
    to_tx, to_rx = mirrors
    tx, rx = BODY.ends(*_walk())
    legs = [_mirror(POINT[None], *names)[0] for names in (to_tx, to_rx)]
    path = _seen(np.tile(legs[1], (WINDOW, 1)), np.linalg.norm(legs[0] - tx, axis=1))
    tracks = [_wall("x"), _wall("y"), _wall("z"), _scatterer(), path]
    seen = _latest(tracks)
    ratio = {"x": 0.8, "y": 0.7}
    gain = [0.05 / (np.linalg.norm(p - tx[-1]) * np.linalg.norm(q - rx[-1])) for p, q in ((POINT, POINT), legs)]
    gain[1] *= np.prod([ratio[name] for name in to_tx + to_rx])
    strength = np.log([0.8, 0.7, 0.6, gain[0] * seen[3, 0], gain[1] * seen[4, 0]])
    offset = rotation_z(np.array(HEADING)) @ (BODY.tx_offset - BODY.rx_offset)
    still, echo = np.array([0.0, 0.0, 0.0, 1.0, 1.0]), np.full(5, FAR)
    image = image_misfit(seen, np.full(seen.shape, 1e-9), strength, offset, still, echo)
    # doubts: a parent of probability 1 costs nothing but what echoes leave, 6 / (1 + 1e4 / 4) each
    assert image.misfit[4] == pytest.approx(0.0, abs=0.02)
    assert image.strength[4] == pytest.approx(0.0, abs=1e-9)
    assert image.mirror[3] > 0.5
    if to_rx and to_rx == to_tx:
        assert image.mirror[4] < -0.5


def test_features_do_not_depend_on_the_order_of_tracks_nor_on_the_rooms_axes():
    tracks = [_scatterer(), _wall("x"), _wall("y"), _wall("x", "y")]
    whole = _sightings(tracks, [0.02, 0.8, 0.7, 0.56])
    features = track_features(whole, BODY, RADIO)
    order = [2, 0, 3, 1]
    mixed = Sightings(*(field[order] for field in whole[:4]), *whole[4:])
    assert track_features(mixed, BODY, RADIO) == pytest.approx(features[order], abs=1e-9)
    turn = rotation_z(np.array(1.1))
    turned = whole._replace(position=whole.position @ turn.T, heading=whole.heading + 1.1)
    assert track_features(turned, BODY, RADIO) == pytest.approx(features, abs=1e-6)


def test_strength_and_age_are_what_they_say():
    sightings = _sightings([_scatterer(), _wall("x")], [0.02, 0.8])
    held = sightings.held.copy()
    held[0, :30] = False
    features = track_features(sightings._replace(held=held), BODY, RADIO)
    # the mean power of a path whose length changes by a few percent, against its mean length
    assert features[:, FEATURES.index("strength")] == pytest.approx(np.log([0.02, 0.8]), abs=0.01)
    assert np.exp(features[:, FEATURES.index("age")]) == pytest.approx([10.0, 40.0])


@pytest.mark.parametrize("held", [1, 2, 40])
def test_features_are_finite_whatever_the_measurements(held):
    rng = np.random.default_rng(held)
    seen = np.concatenate([rng.uniform(0.0, 30.0, (50, WINDOW, 1)), rng.uniform(-1, 1, (50, WINDOW, 2))], axis=2)
    seen[:3] = 0.0
    std = 10.0 ** rng.uniform(-9.0, 1.0, seen.shape)
    flags = np.zeros((50, WINDOW), dtype=bool)
    flags[:, -held:] = True
    level = rng.uniform(-60.0, 0.0, (50, WINDOW))
    features = track_features(Sightings(seen, std, level, flags, *_walk()), BODY, RADIO)
    assert np.isfinite(features).all()
    assert np.isfinite(classify(features, load_classifier())).all()
    none = Sightings(seen[:0], std[:0], level[:0], flags[:0], *_walk())
    assert track_features(none, BODY, RADIO).shape == (0, len(FEATURES))


def test_both_classifiers_settle_the_plain_cases():
    """An ordinary sphere among ordinary walls; the corner fools the baseline, which is what it is there to show."""
    tracks = [_scatterer(), _wall("x"), _wall("y"), _wall("z"), _wall("x", "y")]
    features = track_features(_sightings(tracks, [0.02, 0.85, 0.85, 0.85, 0.72]), BODY, RADIO)
    assert (classify(features, load_classifier()) > 0.5).tolist() == [True, False, False, False, False]
    assert (classify_geometric(features) > 0.5)[[0, 1, 2, 4]].tolist() == [True, False, False, True]


def test_network_is_three_layers_of_tanh():
    rng = np.random.default_rng(1)
    sizes = [len(FEATURES), 5, 5, 1]
    weight = tuple(rng.standard_normal((a, b)) for a, b in pairwise(sizes))
    bias = tuple(rng.standard_normal(b) for b in sizes[1:])
    network = Network(rng.standard_normal(sizes[0]), rng.uniform(0.5, 2.0, sizes[0]), weight, bias)
    x = rng.standard_normal(sizes[0])
    value = [(x[i] - network.mean[i]) / network.scale[i] for i in range(sizes[0])]
    for w, b, last in zip(weight, bias, (False, False, True), strict=True):
        value = [sum(v * w[i, j] for i, v in enumerate(value)) + b[j] for j in range(len(b))]
        value = value if last else [np.tanh(v) for v in value]
    assert classify(x[None], network)[0] == pytest.approx(1.0 / (1.0 + np.exp(-value[0])), rel=1e-12)

    file = io.BytesIO()
    np.savez(file, **network_arrays(network))
    file.seek(0)
    again = read_network(file)
    assert (classify(x[None], again) == classify(x[None], network)).all()


def test_a_file_for_other_features_is_refused():
    arrays = network_arrays(load_classifier())
    for change in ({"features": np.array(["a"])}, {"weight1": np.zeros((2, 3))}, {"bias0": arrays["bias0"] * np.nan}):
        file = io.BytesIO()
        np.savez(file, **(arrays | change))
        file.seek(0)
        with pytest.raises(ConfigError, match="train it anew"):
            read_network(file)
