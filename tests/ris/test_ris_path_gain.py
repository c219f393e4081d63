"""Amplitudes of believed points: the radar equation, free space, and a panel summed element by element."""

import numpy as np
import pytest

from rislam_rt.model import RadioConfig, RisCode, RisSpec
from rislam_rt.ris import element_gain_area, element_pattern
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


def test_a_panel_is_the_sum_over_its_elements():
    """Eq. `single` by hand for every element, its own distance and angle, and `ratio` of the walls on both legs."""
    center, tx, rx, ratio = np.array([3.0, 3.0, 3.0]), np.array([2.0, 2.6, 0.5]), np.array([4.2, 1.7, 0.9]), 0.6
    code = RisCode(np.arange(12).reshape(3, 4) % 4, 4)
    found = panel_path_gain(PANEL, code, center, tx, rx, np.array(ratio), RADIO)
    total, loudest = 0.0, 0.0
    right = np.cross(PANEL.up, PANEL.normal)
    area = element_gain_area(PANEL, RADIO.wavelength)
    for n in range(3):
        for m in range(4):
            at = center + (n - 1.0) * PANEL.spacing[1] * PANEL.up + (m - 1.5) * PANEL.spacing[0] * right
            lengths = [np.linalg.norm(end - at) for end in (tx, rx)]
            cosines = [(end - at) @ PANEL.normal / d for end, d in zip((tx, rx), lengths, strict=True)]
            shape = np.prod([element_pattern(PANEL, np.array(c)) for c in cosines])
            power = RADIO.tx_gain * RADIO.rx_gain * area * RADIO.wavelength**2 * shape
            amplitude = np.sqrt(power / (64.0 * np.pi**3)) / (lengths[0] * lengths[1])
            phase = 2.0 * np.pi * sum(lengths) / RADIO.wavelength + code.xi[n, m]
            total += ratio * amplitude * np.exp(-1j * phase)
            loudest += ratio * amplitude
    # angles of up to pi in single precision, and their cosines: 2e-7 each
    assert abs(found - total) < 4e-7 * loudest
