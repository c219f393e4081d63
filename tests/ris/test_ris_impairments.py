"""Imperfect panels: what is drawn, what it costs a focused panel, and damaged codes."""

import numpy as np
import pytest

from rislam_rt.errors import ConfigError, GeometryError
from rislam_rt.model import RisCode
from rislam_rt.ris import PanelErrors, PanelTolerance, draw_panel, flip_bits

ROUGH = PanelTolerance(amplitude_std=0.2, phase_std=0.5, dead=0.1, stuck=0.2)


def rng(seed=0):
    return np.random.default_rng(seed)


def test_a_perfect_panel_does_nothing_wrong(panels):
    code = RisCode(rng().integers(4, size=(2, 6, 6)), 4)
    errors = draw_panel(panels.spec(), PanelTolerance(), rng=rng())
    np.testing.assert_array_equal(errors.weight, np.ones((6, 6)))
    np.testing.assert_array_equal(errors.applied(code).index, code.index)


def test_the_same_seed_draws_the_same_panel_and_kinds_do_not_mix(panels):
    one, other = (draw_panel(panels.spec(), ROUGH, rng=rng(3)) for _ in range(2))
    np.testing.assert_array_equal(one.weight, other.weight)
    np.testing.assert_array_equal(one.stuck, other.stuck)
    more = draw_panel(panels.spec(), PanelTolerance(amplitude_std=0.2, phase_std=0.1, dead=0.5, stuck=0.2), rng=rng(3))
    np.testing.assert_array_equal(more.amplitude, one.amplitude)
    np.testing.assert_allclose(more.phase, one.phase / 5.0)
    np.testing.assert_array_equal(more.stuck, one.stuck)
    assert (more.dead | one.dead == more.dead).all()


def test_statistics_of_a_large_panel(panels):
    errors = draw_panel(panels.spec(200, 200), ROUGH, rng=rng(1))
    # 40 000 elements: standard errors of 0.2 / 200, 0.5 / 280, 0.0015, 0.002; four of each
    assert errors.amplitude.mean() == pytest.approx(1.0, abs=0.004)
    assert errors.phase.std() == pytest.approx(0.5, abs=0.008)
    assert errors.dead.mean() == pytest.approx(0.1, abs=0.006)
    assert (errors.stuck >= 0).mean() == pytest.approx(0.2, abs=0.008)
    assert set(np.unique(errors.stuck)) == {-1, 0, 1, 2, 3}


def test_amplitudes_never_turn_the_phase(panels):
    errors = draw_panel(panels.spec(50, 50), PanelTolerance(amplitude_std=2.0), rng=rng())
    assert errors.amplitude.min() == 0.0
    assert (errors.weight.real >= 0.0).all()


@pytest.mark.parametrize(
    "tolerance",
    [
        PanelTolerance(dead=0.3),
        PanelTolerance(phase_std=0.8),
        PanelTolerance(amplitude_std=0.3),
        PanelTolerance(stuck=0.4),
        PanelTolerance(amplitude_std=0.2, phase_std=0.4, dead=0.2, stuck=0.2),
    ],
    ids=["dead", "phase", "amplitude", "stuck", "all"],
)
def test_mean_gain_of_a_focused_panel(panels, tolerance):
    """Expected power of a sum of N independent weights, against drawn panels under codes that focus."""
    draws = rng(5).spawn(800)
    power = []
    for child in draws:
        errors = draw_panel(panels.spec(), tolerance, rng=child)
        code = RisCode(child.integers(4, size=(6, 6)), 4)
        field = np.exp(1j * code.xi)  # what the code was chosen for
        power.append(np.abs(np.mean(field * errors.weight * np.exp(-1j * errors.applied(code).xi))) ** 2)
    # Ruze: m^2 + (s - m^2) / N, m and s the mean and mean square of the weights; stuck elements add nothing to m
    alive = 1.0 - tolerance.dead
    coherent = (alive * (1.0 - tolerance.stuck)) ** 2 * np.exp(-(tolerance.phase_std**2))
    scattered = alive * (1.0 + tolerance.amplitude_std**2) - coherent
    error = np.std(power) / np.sqrt(len(power))
    assert np.mean(power) == pytest.approx(coherent + scattered / 36, abs=4 * error)
    assert error < 0.02


def test_bit_flips(panels):
    code = RisCode(rng().integers(8, size=(300, 6, 6)), 8)
    np.testing.assert_array_equal(flip_bits(code, 0.0, rng=rng()).index, code.index)
    np.testing.assert_array_equal(flip_bits(code, 1.0, rng=rng()).index, 7 - code.index)
    flipped = code.index ^ flip_bits(code, 0.1, rng=rng(2)).index
    for bit in range(3):
        # 10 800 bits: four standard errors of 0.0029
        assert ((flipped >> bit) & 1).mean() == pytest.approx(0.1, abs=0.012)
    both = ((flipped & 3) == 3).mean()
    assert both == pytest.approx(0.01, abs=0.004)  # bits flip independently; standard error 0.001


def test_stuck_elements_keep_their_level_in_every_cycle():
    stuck = np.array([[-1, 2], [0, -1]])
    errors = PanelErrors(np.ones((2, 2)), np.zeros((2, 2)), np.zeros((2, 2), dtype=bool), stuck)
    code = RisCode(np.full((5, 2, 2), 3), 4)
    np.testing.assert_array_equal(errors.applied(code).index, np.tile([[3, 2], [0, 3]], (5, 1, 1)))


def test_bad_tolerances_are_named():
    with pytest.raises(ConfigError, match=r"panel\.dead: 1\.5 received"):
        PanelTolerance(dead=1.5)
    with pytest.raises(ConfigError, match=r"panel\.phase_std: nan received"):
        PanelTolerance(phase_std=float("nan"))
    with pytest.raises(ConfigError, match="power of two"):
        flip_bits(RisCode(np.zeros((2, 2), dtype=int), 3), 0.1, rng=rng())
    with pytest.raises(ConfigError, match=r"panel\.bit_flip: -1 received"):
        flip_bits(RisCode(np.zeros((2, 2), dtype=int), 4), -1, rng=rng())
    with pytest.raises(ConfigError, match=r"panel\.amplitude: -1"):
        PanelErrors(-np.ones((1, 1)), np.zeros((1, 1)), np.zeros((1, 1), dtype=bool), -np.ones((1, 1), dtype=int))
    with pytest.raises(GeometryError, match=r"PanelErrors\.phase"):
        PanelErrors(np.ones((1, 1)), np.zeros((2, 2)), np.zeros((1, 1), dtype=bool), -np.ones((1, 1), dtype=int))
