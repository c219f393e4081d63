"""GDOP maps of the paper's room: what the panel adds, and the blind spot below it."""

import numpy as np
import pytest
from known_paths import position_error_map

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.information import Outcome, position_bound, position_information, vertex_gradient
from rislam_rt.model import Body, PathKind, RadioConfig, Trajectory
from rislam_rt.scene import load_scene

RADIO = RadioConfig()


def at(positions, body=None):
    count = len(positions)
    return Trajectory(
        np.arange(float(count)), positions, np.zeros((count, 3)), np.zeros(count), body if body is not None else Body()
    )


@pytest.fixture(scope="module")
def scene():
    return load_scene("scenes/paper_room")


def test_map_equals_the_closed_form_place_by_place(scene):
    motion = at(np.array([[1.0, 2.0, 0.5], [4.0, 3.3, 0.8]]))
    paths = ImageSourceChannel(scene, RADIO, 1).paths(motion)
    prior = 100.0 * np.eye(2)
    whole = position_error_map(paths, motion.tx, motion.rx, RADIO, prior=prior)
    for k in range(2):
        use = paths.valid[k] & (paths.kind >= PathKind.PS)
        gradient = vertex_gradient(motion.tx[k], motion.rx[k], paths.vertices[k, use], paths.num_vertices[use])[:, :2]
        single = position_bound(
            position_information(gradient, RADIO.integrated_snr(paths.gain[k, use]), RADIO), prior
        )  # fmt: skip
        assert whole.variance[k] == pytest.approx(float(single.variance), rel=1e-12)


def test_right_under_the_panel_it_does_not_help(scene):
    """Tx and Rx symmetric about the nadir: the panel's horizontal gradient is exactly zero."""
    motion = at(np.array([[3.0, 3.0, 0.5], [2.0, 3.0, 0.5]]))
    paths = ImageSourceChannel(scene, RADIO, 0).paths(motion)
    gradient = vertex_gradient(motion.tx, motion.rx, paths.vertices, paths.num_vertices)
    direct = int(np.flatnonzero(paths.kind == PathKind.RIS)[0])
    np.testing.assert_allclose(gradient[0, direct, :2], 0.0, atol=1e-12)
    assert np.abs(gradient[1, direct, :2]).max() > 0.7
    bound = position_error_map(paths, motion.tx, motion.rx, RADIO)
    assert bound.outcome.tolist() == [Outcome.UNOBSERVABLE, Outcome.OK]


def test_options_of_the_map(scene):
    motion = at(np.array([[1.0, 2.0, 0.5], [4.0, 3.3, 0.8]]))
    paths = ImageSourceChannel(scene, RADIO, 1).paths(motion)
    plain = position_error_map(paths, motion.tx, motion.rx, RADIO).variance
    assert (position_error_map(paths, motion.tx, motion.rx, RADIO, use_vt=True).variance < plain).all()
    assert (position_error_map(paths, motion.tx, motion.rx, RADIO, least_snr=10.0).variance > plain).all()
    deaf = position_error_map(paths, motion.tx, motion.rx, RADIO, least_snr=np.inf)
    assert (deaf.outcome == Outcome.NO_PATHS).all()
    # the paper's gradient all but cancels for a small baseline: it promises far less
    paper = position_error_map(paths, motion.tx, motion.rx, RADIO, mode="paper").variance
    assert (paper > plain).all()
