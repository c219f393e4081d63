"""Limits of the panel's formulas: far field and delay spread, with the warnings that name them."""

import numpy as np
import pytest

from rislam_rt.model.delay_spread import band_loss_db
from rislam_rt.ris import delay_spread, delay_spread_warnings

BELOW = np.array([0.0, 0.0, -1.0])


def test_delay_spread_of_a_grazing_ray_is_the_panels_length(panels):
    """Both ends far away in the panel's plane: the spread is twice its extent between element centres."""
    far = panels.center + np.array([1e6, 0.0, 0.0])
    spread = delay_spread(panels.spec(), panels.center, far, far)
    assert spread * 299_792_458.0 == pytest.approx(2 * 5 * 0.015, rel=1e-6)
    # opposite ways: what one end gains the other loses
    assert delay_spread(panels.spec(), panels.center, far, 2 * panels.center - far) < 1e-6 * spread


def test_delay_spread_warning_follows_the_bandwidth(panels):
    spec, center = panels.spec(), panels.center
    tx, rx = center + np.array([[2.0, 0.1, -1.5], [0.0, 0.1, -1.5]]), center + np.array([2.1, 0.0, -1.5])
    spread = delay_spread(spec, center, tx, rx).max()
    assert delay_spread_warnings(spec, center, tx, rx, 0.999 / spread) == ()
    (line,) = delay_spread_warnings(spec, center, tx, rx, 1.001 / spread)
    assert f"{spread * 1e9:.3g} ns" in line
    assert "loses up to 1.2 dB of an aimed code's gain" in line


def test_twice_the_side_of_a_panel_gains_more_than_the_band_takes():
    """Sixteen times the power; the band's loss is 8.34 dB at most for twice x."""
    spread = np.linspace(0.1, 20.0, 200)
    taken = [band_loss_db(2.0 * cells) - band_loss_db(cells) for cells in spread]
    assert max(taken) == pytest.approx(8.34, abs=0.01)
    # elements in a row, each at its own delay, tone by tone
    delay, tone = ((np.arange(1000) + 0.5) / 1000 - 0.5) * 1.7, (np.arange(400) + 0.5) / 400 - 0.5
    gain = np.mean(np.exp(-2j * np.pi * np.outer(tone, delay)))
    assert band_loss_db(1.7) == pytest.approx(-20.0 * np.log10(abs(gain)), abs=0.01)
