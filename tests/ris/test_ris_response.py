"""The panel: patterns, eq. single term by term, far field against near field, and re-phasing."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.model import RisCode
from rislam_rt.ris import element_gain_area, element_pattern, far_field_response, leg_response, panel_gain, zero_code


def responses(panels, data, tx, rx, form=leg_response):
    one = np.array(1.0)
    return form(data, panels.center, tx, one, panels.wavelength), form(data, panels.center, rx, one, panels.wavelength)


@pytest.mark.parametrize(("element", "power"), [("tang", 3), ("energy", 1)])
def test_patterns(panels, element, power):
    cosine = np.array([1.0, 0.5, 0.0, -0.3])
    np.testing.assert_allclose(element_pattern(panels.spec(element=element), cosine), [1.0, 0.5**power, 0.0, 0.0])


def test_tang_element_reflects_4_db_more_than_a_plate_of_its_area(panels):
    tang, energy = (element_gain_area(panels.spec(element=e), panels.wavelength) for e in ("tang", "energy"))
    assert tang == 8 * 0.015**2
    # amplitude at normal incidence goes with the square root; at lambda/2 spacing the excess is 8 / pi, 4.06 dB
    assert 10 * np.log10(tang / energy) == pytest.approx(4.06, abs=0.01)


def test_tang_gain_makes_its_pattern_a_lossless_antenna(panels):
    """Integral of G F over the half sphere is 4 pi for G = 2 (q + 1)."""
    theta = np.linspace(0.0, np.pi / 2, 20_001)
    pattern = element_pattern(panels.spec(), np.cos(theta)) * np.sin(theta)
    integral = 2 * np.pi * np.sum((pattern[1:] + pattern[:-1]) / 2) * (theta[1] - theta[0])
    assert 8.0 * integral == pytest.approx(4 * np.pi, rel=1e-6)


@pytest.mark.parametrize("element", ["tang", "energy"])
def test_a_panel_is_the_sum_of_its_elements_by_eq_single(panels, element):
    """Second way: loop over elements, each a point of cross-section G F F dx dy A^2 with two Friis legs."""
    data = replace(panels.spec(3, 5, element=element, amplitude=0.8), spacing=np.array([0.013, 0.016]))
    tx, rx = np.array([1.1, 2.0, 0.6]), np.array([4.2, 2.7, 1.4])
    code = RisCode(np.random.default_rng(1).integers(4, size=(3, 5)), 4)
    total = 0.0
    for n in range(3):
        for m in range(5):
            right = np.cross(data.up, data.normal)
            place = panels.center + (n - 1) * 0.016 * data.up + (m - 2) * 0.013 * right
            legs = [device - place for device in (tx, rx)]
            distances = [np.linalg.norm(leg) for leg in legs]
            pattern = [element_pattern(data, leg @ data.normal / d) for leg, d in zip(legs, distances, strict=True)]
            sigma = element_gain_area(data, panels.wavelength) * pattern[0] * pattern[1] * 0.8**2
            amplitude = panels.wavelength * np.sqrt(sigma) / ((4 * np.pi) ** 1.5 * distances[0] * distances[1])
            phase = -2 * np.pi * sum(distances) / panels.wavelength - code.xi[n, m]
            total += amplitude * np.exp(1j * phase)
    assert panel_gain(*responses(panels, data, tx, rx), code) == pytest.approx(total, rel=1e-11)


def test_nothing_comes_from_behind(panels):
    tx, rx = np.array([1.1, 2.0, 3.5]), np.array([4.2, 2.7, 1.4])
    assert panel_gain(*responses(panels, panels.spec(), tx, rx), zero_code(panels.spec())) == 0.0


def far_field_error(panels, side, distance):
    """Largest relative error of the far-field gain of a square panel focused by the element-wise phases."""
    data = panels.spec(side, side)
    direction = np.array([0.3, 0.2, -0.93]) / np.linalg.norm([0.3, 0.2, -0.93])
    device = panels.center + distance * direction
    near, far = (responses(panels, data, device, device, form) for form in (leg_response, far_field_response))
    focus = np.exp(-1j * np.angle(near[0] * near[1]))
    exact, approximate = ((pair[0] * pair[1] * focus).sum() for pair in (near, far))
    return abs(approximate / exact - 1.0)


@pytest.mark.parametrize("side", [6, 10, 16])
def test_far_field_form_converges_beyond_its_limit(panels, side):
    limit = 2.0 * panels.spec(side, side).diagonal ** 2 / panels.wavelength
    errors = [far_field_error(panels, side, factor * limit) for factor in (1.0, 4.0, 16.0, 64.0)]
    # two-way phase error over the panel at 2 D^2 / lambda is at most 2 x pi / 8, on average a third of it and less
    assert errors[0] < 2 * np.pi / 8
    # the error falls with distance: first order in D / d
    assert all(b < a / 2.5 for a, b in itertools.pairwise(errors))
    assert far_field_error(panels, side, limit / 8) > 4 * errors[0]


@pytest.mark.parametrize(("side", "limit"), [(6, 1.08), (10, 3.0)])
def test_far_field_limit_of_the_papers_panels(panels, side, limit):
    assert 2.0 * panels.spec(side, side).diagonal ** 2 / panels.wavelength == pytest.approx(limit, abs=0.005)


def test_responses_are_vectorised_and_linear_in_the_coefficient(panels):
    devices = np.random.default_rng(0).uniform(0.5, 2.5, (4, 5, 3))
    coefficient = np.random.default_rng(1).normal(size=(4, 5)) + 0.3j
    for form in (leg_response, far_field_response):
        whole = form(panels.spec(), panels.center, devices, coefficient, panels.wavelength)
        assert whole.shape == (4, 5, 6, 6)
        single = form(panels.spec(), panels.center, devices[2, 3], np.array(1.0), panels.wavelength)
        np.testing.assert_allclose(whole[2, 3], coefficient[2, 3] * single, rtol=1e-12)


def test_all_levels_shifted_turn_the_gain(panels):
    tx, rx = np.array([1.1, 2.0, 0.6]), np.array([4.2, 2.7, 1.4])
    pair = responses(panels, panels.spec(), tx, rx)
    index = np.random.default_rng(5).integers(4, size=(6, 6))
    gains = [panel_gain(*pair, RisCode((index + shift) % 4, 4)) for shift in range(4)]
    np.testing.assert_allclose(gains, gains[0] * np.exp(-0.5j * np.pi * np.arange(4)), rtol=1e-10)
