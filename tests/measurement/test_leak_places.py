"""Places of leaks: an array that hears two cosines alike finds what leaks at either."""

import numpy as np
import pytest

from rislam_rt.measurement.components import ReportedComponents
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.panel_probability import BLUR, leak_factors, panel_probability
from rislam_rt.model import RadioConfig, RxArray

SPLIT = ReceiverConfig(alternation=True)
DELAY = 30e-9
DEVIATION = np.array([1e-11, 0.02, 0.02])
ALIKE = [
    (spacing, turns)
    for spacing in (0.5, 0.7, 1.0, 1.5)
    for turns in ((0, 0), (1, 0), (0, -1), (-1, 1), (2, 0))
    if max(np.abs(turns)) <= 2.0 * spacing
]
"""Spacings, and periods between two cosines of the disc that are alike."""


def told(array: RxArray, gap: list[float], sign: float) -> float:
    """Probability that a component is the panel's, which lies so far (delay in cells, cosines) from a source of 45 dB
    and has the gain of its leak at half the top speed, times a sign."""
    radio = RadioConfig(array=array)
    factor = leak_factors(radio, SPLIT)[96]
    gain = 10.0**2.25 * np.array([1.0, sign * factor])
    place = np.array([DELAY, *(-0.5 * np.array(gap[1:]))])
    found = ReportedComponents(
        np.zeros(2, dtype=np.int64), place + np.array([np.zeros(3), [gap[0] / radio.bandwidth, *gap[1:]]]),
        np.tile(DEVIATION, (2, 1)), gain, np.ones(2), np.arange(2),
    )  # fmt: skip
    return float(panel_probability(found, radio, SPLIT)[0][1])


@pytest.mark.parametrize(("rows", "cols"), [(4, 4), (4, 5), (5, 4), (5, 5)])
@pytest.mark.parametrize(("spacing", "turns"), ALIKE)
def test_a_leak_is_found_at_every_cosine_that_the_array_hears_alike(rows, cols, spacing, turns) -> None:
    """The gain is that of the middle of the array, and turns with each period along an even number of antennas."""
    array = RxArray(rows=rows, cols=cols, spacing=spacing)
    gap = np.array(turns) / spacing
    middle = array.positions(1.0)[:, :2].max(axis=0) + array.positions(1.0)[:, :2].min(axis=0)
    assert middle == pytest.approx(0.0)
    antenna = array.positions(1.0)[0, :2]  # the same sample at any antenna, so at the corner
    sign = float(np.real(np.exp(-2j * np.pi * gap @ antenna)))
    assert abs(sign) == pytest.approx(1.0)
    assert told(array, [0.0, *gap], sign) < 0.05
    assert told(array, [0.0, *gap], -sign) > 0.99
    assert told(array, [5.0, *gap], sign) > 0.99
    assert told(array, [0.0, *(gap + 0.5 / spacing)], sign) > 0.99


def test_along_an_axis_without_aperture_nothing_is_heard_elsewhere() -> None:
    """One row of antennas: the density there is that of the same place, by hand."""
    row = RxArray(rows=1, cols=8)
    odds = [1.0 / told(row, [0.0, gap, 0.0], 1.0) - 1.0 for gap in (0.0, 0.3)]
    variance = 2.0 * 0.02**2 + (BLUR / 0.5) ** 2  # an axis of one antenna has cells as wide as the disc
    assert odds[0] / odds[1] == pytest.approx(np.exp(0.5 * 0.3**2 / variance), rel=1e-6)
    assert told(row, [0.0, 1.9, 0.0], 1.0) > 0.99


def test_odds_of_a_leak_fall_with_its_distance_as_normal_densities_do() -> None:
    """By hand, for cells of different widths along each axis, small against the period."""
    array = RxArray(rows=8, cols=4)
    at = 1.0 / told(array, [0.0, 0.0, 0.0], 1.0) - 1.0
    for axis, width in ((0, 1.0), (1, 0.25), (2, 0.5)):
        gap = [0.0, 0.0, 0.0]
        gap[axis] = 0.3 * width
        deviation = (DEVIATION * [1e9, 1.0, 1.0])[axis]
        variance = 2.0 * deviation**2 + (BLUR * width) ** 2
        off = 1.0 / told(array, gap, 1.0) - 1.0
        assert off / at == pytest.approx(np.exp(-0.5 * gap[axis] ** 2 / variance), rel=1e-5)
