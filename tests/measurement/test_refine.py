"""Joint refinement: what is reused of a fit is what a fit from the samples gives; shortcuts change no result."""

import numpy as np
import pytest

from rislam_rt.measurement.estimation import refine as refinement
from rislam_rt.measurement.estimation.path_signals import Sounding, build_sounding, waves_at
from rislam_rt.measurement.estimation.positive_definite import inverse, solve
from rislam_rt.measurement.estimation.refine import (
    LeastSquaresFit,
    accuracy,
    contribution,
    fit_amplitudes,
    refine,
    residual,
    residual_fit,
    subset_fit,
)
from rislam_rt.measurement.received_signal import add_noise
from rislam_rt.model import RadioConfig

PLANE = build_sounding(128, RadioConfig())
EXACT = build_sounding(128, RadioConfig(), element_exact=True)


def crowd(sounding: Sounding, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Places of paths of 8 to 40 dB within ten cells of delay, many closer than a cell; samples of unit noise."""
    places = np.column_stack([rng.uniform(5.0, 15.0, count), rng.uniform(-0.7, 0.7, (count, 2))])
    amplitude = np.sqrt(10.0 ** rng.uniform(0.8, 4.0, count) / sounding.num_samples)
    clean = waves_at(sounding, places).sum(amplitude * np.exp(2j * np.pi * rng.uniform(size=count)))
    return places, add_noise(clean, 1.0, rng=rng)


def same(found: LeastSquaresFit, wanted: LeastSquaresFit) -> None:
    """To rounding: energies are up to 1e5."""
    np.testing.assert_allclose(found.amplitude, wanted.amplitude, atol=1e-8)
    np.testing.assert_allclose(found.slopes, wanted.slopes, atol=1e-5)
    np.testing.assert_allclose(found.covariance, wanted.covariance, rtol=1e-9)
    assert found.cost == pytest.approx(wanted.cost, abs=1e-6)


@pytest.mark.parametrize("sounding", [PLANE, EXACT])
def test_parts_of_a_fit_are_fits_of_parts(sounding: Sounding) -> None:
    rng = np.random.default_rng(1)
    places, samples = crowd(sounding, 12, rng)
    fit = fit_amplitudes(sounding, places, samples)
    keep = rng.uniform(size=12) < 0.6
    same(subset_fit(sounding, fit, keep, samples), fit_amplitudes(sounding, places[keep], samples))
    rows = np.flatnonzero(keep)
    some, local = residual_fit(sounding, fit, rows, samples)
    np.testing.assert_allclose(local, residual(fit, samples) + contribution(fit, rows, samples), atol=1e-9)
    same(some, fit_amplitudes(sounding, places[rows], local))


def test_cost_and_slopes_are_those_of_the_residual() -> None:
    """Both follow from small matrices; here from the samples."""
    places, samples = crowd(PLANE, 10, np.random.default_rng(2))
    fit = fit_amplitudes(PLANE, places, samples)
    left = residual(fit, samples)
    assert fit.cost == pytest.approx(np.vdot(left, left).real, rel=1e-9)
    np.testing.assert_allclose(fit.slopes, fit.waves.correlate(PLANE, left)[1:], atol=1e-6)
    np.testing.assert_allclose(fit.waves.correlate(PLANE, left)[0], 0.0, atol=1e-5)  # nothing left to fit


def test_who_rests_may_be_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refining only the restless ends within a fraction of a standard deviation of refining all paths to the end."""
    rng, worst = np.random.default_rng(3), []
    for _ in range(8):
        places, samples = crowd(PLANE, 16, rng)
        begun = fit_amplitudes(PLANE, places, samples)
        found = refine(PLANE, begun, samples, steps=12, tolerance=0.02)
        with monkeypatch.context() as patch:
            patch.setattr(refinement, "WORTHWHILE", 0.0)
            wanted = refine(PLANE, begun, samples, steps=30, tolerance=1e-6)
        assert found.cost < begun.cost
        gap = np.abs(found.parameters - wanted.parameters) / accuracy(wanted).parameters
        worst += gap.max(axis=1).tolist()
    # the last step promised less than a fifth of a deviation; steps shrink slowly where paths hardly part
    assert np.quantile(worst, 0.9) < 0.4


def test_hopeless_trials_stop_before_they_fit() -> None:
    """A cost that no step can reach is given up without another fit."""
    places, samples = crowd(PLANE, 4, np.random.default_rng(4))
    fit = fit_amplitudes(PLANE, places[:3], samples)
    assert refine(PLANE, fit, samples, steps=6, enough=1.0) is fit


def test_positive_matrices() -> None:
    rng = np.random.default_rng(5)
    root = rng.standard_normal((40, 9)) * 10.0 ** rng.uniform(-4.0, 4.0, 9)
    matrix, right = root.T @ root, rng.standard_normal(9)
    scale = np.sqrt(np.diag(matrix))
    # off by the ridge of 1e-9 times the condition of the matrix at unit diagonal, about ten
    np.testing.assert_allclose(inverse(matrix) * np.outer(scale, scale) @ (matrix / np.outer(scale, scale)), np.eye(9),
                               atol=1e-7)  # fmt: skip
    np.testing.assert_allclose(solve(matrix, right), np.linalg.solve(matrix, right), rtol=1e-6)
    assert np.isfinite(inverse(np.ones((3, 3)))).all()  # coinciding paths
    assert inverse(np.zeros((0, 0))).shape == (0, 0)
    assert solve(np.zeros((0, 0)), np.zeros(0)).shape == (0,)
