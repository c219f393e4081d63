"""Limits of the panel's formulas: far field and delay spread, with the warnings that name them."""

import numpy as np
import pytest

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
