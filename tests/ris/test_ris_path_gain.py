"""Amplitudes of believed points: the radar equation, free space, and a panel summed element by element."""

import numpy as np
import pytest

from rislam_rt.model import RadioConfig, RisCode, RisSpec
from rislam_rt.ris import leg_response, panel_gain
from rislam_rt.ris.path_gain import image_amplitude, panel_path_gain, point_amplitude

RADIO = RadioConfig(tx_gain=2.0, rx_gain=3.0)
PANEL = RisSpec(3, 4, np.array([0.013, 0.016]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))


def test_a_point_returns_what_the_radar_equation_says():
    """Power: Pt Gt / (4 pi d1^2) on the point, times its cross-section / (4 pi d2^2), into Gr lambda^2 / (4 pi)."""
    area, first, second = 0.02, 2.5, 4.0
    flux = RADIO.tx_gain / (4.0 * np.pi * first**2) * area / (4.0 * np.pi * second**2)
    power = flux * RADIO.rx_gain * RADIO.wavelength**2 / (4.0 * np.pi)
    found = point_amplitude(np.array(np.sqrt(area)), np.array(first), np.array(second), RADIO)
    assert found**2 == pytest.approx(power, rel=1e-14)


def test_an_image_is_heard_by_the_law_of_friis():
    power = RADIO.tx_gain * RADIO.rx_gain * (RADIO.wavelength / (4.0 * np.pi * 7.0)) ** 2
    assert image_amplitude(np.array(7.0), RADIO) ** 2 == pytest.approx(power, rel=1e-14)


def test_a_panel_reflects_what_its_elements_do():
    """Responses of both legs under the code (`tests/ris/test_ris_response.py`), and `ratio` of the walls on them."""
    center, tx, rx, ratio = np.array([3.0, 3.0, 3.0]), np.array([2.0, 2.6, 0.5]), np.array([4.2, 1.7, 0.9]), 0.6
    code = RisCode(np.arange(12).reshape(3, 4) % 4, 4)
    found = panel_path_gain(PANEL, code, center, tx, rx, np.array(ratio), RADIO)
    ends = (tx, np.sqrt(RADIO.tx_gain)), (rx, np.sqrt(RADIO.rx_gain))
    legs = [leg_response(PANEL, center, end, np.array(gain), RADIO.wavelength) for end, gain in ends]
    # angles of up to pi in single precision, and their cosines: 2e-7 each
    assert abs(found - ratio * panel_gain(*legs, code)) < 4e-7 * ratio * np.abs(legs[0] * legs[1]).sum()
