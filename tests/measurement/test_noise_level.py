"""Noise stated through a reference path, and through the paper's SNR."""

import numpy as np
import pytest

from rislam_rt.measurement import ReceiverConfig, paper_snr_db, reference_gain, with_reference_snr
from rislam_rt.model import PathKind, RadioConfig

RADIO = RadioConfig()
UP = (0.3, -0.2, 0.9)


def test_default_noise_gives_the_reference_sphere_13_db():
    assert 10.0 * np.log10(RADIO.integrated_snr(reference_gain(RADIO))) == pytest.approx(13.0, abs=0.01)


def test_reference_gain_is_the_radar_equation():
    received_over_sent = 0.03**2 * np.pi * 0.05**2 / ((4.0 * np.pi) ** 3 * 3.0**4)
    # 0.03 m is the wavelength at 10 GHz to 7e-4
    assert reference_gain(RADIO) ** 2 == pytest.approx(received_over_sent, rel=2e-3)


@pytest.mark.parametrize("snr_db", [-10.0, 30.0])
def test_reference_snr_is_what_was_asked(snr_db):
    radio = with_reference_snr(RADIO, snr_db)
    assert 10.0 * np.log10(radio.integrated_snr(reference_gain(radio))) == pytest.approx(snr_db, abs=1e-9)


def test_paper_snr_of_one_path_is_the_integrated_one_over_all_samples(make_paths, make_gain):
    """||Y||^2 = L B E |alpha|^2, so that the paper's SNR is the integrated one less 10 lg(L U)."""
    paths = make_paths([(PathKind.PS, 4.0, UP, make_gain(20.0, RADIO))])
    for samples in (64, 256):
        expected = 20.0 - 10.0 * np.log10(16 * samples)
        assert paper_snr_db(paths, RADIO, num_samples=samples)[0] == pytest.approx(expected, abs=1e-9)


def test_paper_snr_counts_the_leakage_unless_it_is_cancelled(make_paths, make_gain):
    sphere, leakage = make_gain(20.0, RADIO), make_gain(80.0, RADIO)
    both = make_paths([(PathKind.LOS, 0.1, (1.0, 0.0, 0.0), leakage), (PathKind.PS, 4.0, UP, sphere)])
    alone = make_paths([(PathKind.PS, 4.0, UP, sphere)])
    # the cross term of two paths 60 dB apart is below 0.01 dB
    assert paper_snr_db(both, RADIO)[0] - paper_snr_db(alone, RADIO)[0] == pytest.approx(60.0, abs=0.02)
    cancelled = ReceiverConfig(leakage_cancellation_db=120.0)
    assert paper_snr_db(both, RADIO, cancelled)[0] == pytest.approx(paper_snr_db(alone, RADIO)[0], abs=0.02)
