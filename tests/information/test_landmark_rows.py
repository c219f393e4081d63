"""Rows of a landmark model: which measurements count, in what order, and how much."""

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.walls import build_walls
from rislam_rt.information import LinearMeasurements, build_landmark_model, fewer_rows
from rislam_rt.information.accuracy import cosine_information, range_information
from rislam_rt.model import PathKind, RadioConfig
from rislam_rt.scene import load_scene

RADIO = RadioConfig(noise_psd=1e-14)


@pytest.fixture(scope="module")
def model():
    scene = load_scene("scenes/tilted_room")
    walls, motion = build_walls(scene), scene.agent[:4]
    paths = ImageSourceChannel(scene, RADIO, depth=1).paths(motion)
    return build_landmark_model(paths, motion, scene.landmark_positions, walls.normal, walls.offset, RADIO)


@pytest.mark.parametrize("use_vt", [False, True])
def test_delays_alone_are_the_first_of_three_rows_a_path(model, use_vt):
    both = zip(model.rows(angles=True, use_vt=use_vt), model.rows(angles=False, use_vt=use_vt), strict=True)
    for full, delays in both:
        np.testing.assert_array_equal(delays.agent, full.agent[::3])
        np.testing.assert_array_equal(delays.unknown, full.unknown[::3])
        np.testing.assert_array_equal(delays.information, full.information[::3])


@pytest.mark.parametrize("least_snr", [1e2, 1e5])
def test_a_path_counts_from_the_least_snr_on_with_its_own(model, least_snr):
    paths = model.paths
    for cycle, rows in enumerate(model.rows(least_snr, use_vt=True)):
        snr = RADIO.integrated_snr(paths.gain[cycle])
        heard = paths.valid[cycle] & (snr >= least_snr)
        order = np.concatenate(
            [np.flatnonzero(heard & (paths.landmark >= 0)), np.flatnonzero(heard & (paths.kind == PathKind.VT))]
        )
        assert 0 < len(order) < paths.valid[cycle].sum()
        information = rows.information.reshape(-1, 3)
        np.testing.assert_allclose(information[:, 0], range_information(snr[order], RADIO))
        per_antenna = snr[order] / RADIO.array.num_antennas
        np.testing.assert_allclose(information[:, 1:], cosine_information(per_antenna, RADIO))


def test_the_first_row_is_the_gradient_of_the_length(model):
    """Minus both directions from the agent's ends, whatever lies between."""
    for cycle, rows in enumerate(model.rows(0.0)):
        here = np.flatnonzero(model.paths.valid[cycle] & (model.paths.landmark >= 0))
        toward = model.paths.departure[cycle, here] + model.paths.arrival[cycle, here]
        np.testing.assert_allclose(rows.agent[::3], -toward, atol=1e-9)


def test_a_path_without_a_landmark_sees_no_point(model):
    direct = model.paths.landmark < 0
    assert (model.tx_point[direct] == -1).all()
    assert (model.rx_point[direct] == -1).all()
    assert (model.tx_point[~direct] >= 0).all()


def test_fewer_rows_hold_the_same_information():
    rng = np.random.default_rng(2)
    rows = LinearMeasurements(rng.standard_normal((50, 3)), rng.standard_normal((50, 4)), rng.uniform(0.1, 2.0, 50))
    short = fewer_rows(rows)
    assert len(short.information) == 7
    for first, second in ((rows, short), (rows, fewer_rows(short))):
        matrices = [
            (m := np.concatenate([r.agent, r.unknown], axis=1)).T @ (r.information[:, None] * m)
            for r in (first, second)
        ]
        np.testing.assert_allclose(*matrices, atol=1e-12)
