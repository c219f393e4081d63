"""When two paths come out as two: against the joint bound of the estimator's own signals, and against its limits."""

import numpy as np
import pytest

from rislam_rt.information import certainty_share, resolved_probability
from rislam_rt.information.resolution import PHASES
from rislam_rt.measurement.estimation.path_signals import build_sounding, inner_of, waves_at
from rislam_rt.measurement.estimation.refine import joint_bound
from rislam_rt.model import RadioConfig, RxArray, SensorModel

SENSOR = SensorModel(RadioConfig(), resolution="joint")


@pytest.mark.parametrize("array", [RxArray(), RxArray(3, 5, spacing=0.4)])
def test_share_is_that_of_the_joint_bound(array: RxArray) -> None:
    """The bound over 512 tones in place of a band: 1 / 512^2 off in its second derivatives."""
    radio = RadioConfig(array=array)
    sounding, rng = build_sounding(512, radio), np.random.default_rng(4)
    for gap in rng.uniform(0.4, 1.2, (10, 3)) * np.array([1.0, 0.3, 0.3]):
        share = certainty_share(gap * np.array([1.0 / radio.bandwidth, 1.0, 1.0]), radio)
        for number in range(PHASES):
            turn = np.exp(1j * np.pi * (number + 0.5) / PHASES)
            # the second is strong, so that the prior on its cosines tells nothing; the first stands at the origin
            amplitude = np.array([1e3 * turn, 1e3])
            inner = inner_of(sounding, waves_at(sounding, np.stack([np.zeros(3), gap])))
            _, variance = joint_bound(inner, amplitude)
            assert 1.0 / (variance[0] * sounding.num_samples) == pytest.approx(share[number], rel=1e-3)


def test_resolution_grows_with_gap_and_strength() -> None:
    gaps = np.linspace(0.05, 3.5, 40)[:, None] * np.array([1e-9, 0.0, 0.0])
    weak, strong = (resolved_probability(gaps, np.full((40, 2), snr), SENSOR) for snr in (30.0, 1e4))
    assert (strong >= weak - 1e-9).all()
    assert strong[0] < 0.01
    # a path far from any other comes out when it is detected
    far = resolved_probability(np.array([20e-9, 0.0, 0.0]), np.full(2, 30.0), SENSOR)
    assert far == pytest.approx(float(SENSOR.detection_probability(30.0)), abs=1e-6)


def test_by_cell_and_by_nothing() -> None:
    gap = np.array([[0.9e-9, 0.4, 0.4], [1.1e-9, 0.0, 0.0], [0.0, 0.51, 0.0]])
    snr = np.full((3, 2), 100.0)
    np.testing.assert_array_equal(resolved_probability(gap, snr, SensorModel(RadioConfig())), [0.0, 1.0, 1.0])
