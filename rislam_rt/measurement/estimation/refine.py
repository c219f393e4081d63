"""Refine all path parameters jointly: least squares by Gauss-Newton steps with the amplitudes eliminated.

Separable least squares (Golub and Pereyra 1973, in Kaufman's form): the amplitudes follow from the parameters, so the
steps are in the 3 P real parameters alone. The matrix of a step is the Fisher information with the amplitudes as
nuisance, so the joint Cramer-Rao bound comes with it. What the samples enter are their products with P signals and
their derivatives; everything else, the residual's energy and slopes included, follows from small real matrices.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.measurement.estimation.path_signals import (
    InnerProducts,
    PathSignals,
    Sounding,
    correlate_waves,
    inner_of,
    wave_signals,
    waves_at,
)
from rislam_rt.measurement.estimation.positive_definite import RIDGE, inverse, solve, whitened

PRIOR = np.array([0.0, 2.0, 2.0])
"""Half the information that lying in the unit disc gives on a cosine (standard deviation 0.5): it matters only along an
axis on which the array has no aperture."""
LARGEST_STEP = np.array([0.3, 0.15, 0.15])
"""Largest change of (B tau, u, v) by one step: about a third of a cell, within which the error is nearly quadratic."""
SEARCH_TOLERANCE = 0.3
"""Noise energy that refinement may leave in each path while paths are still looked for."""
OVERLAP = 0.3
"""Correlation of two signals from which on one is refined along with the other."""
WORTHWHILE = 0.4
"""Share of moving paths up to which it saves time to refine them alone."""
FEW = 16
"""Number of paths above which moving ones are refined alone."""
HOPE = 2.0
"""Largest ratio of the cost that refinement gains in the end to what one step promises: of 411 trials in random rooms 4
gained more than 1.5 times as much, and none 2.5 times."""
DAMPING, LEAST_DAMPING = 1e-3, 1e-6
"""Share of its diagonal that is added to a step's matrix: at first, and at least."""


class LeastSquaresFit(NamedTuple):
    """Least-squares fit of P paths to samples of unit noise variance: parameters, amplitudes, residual energy."""

    waves: PathSignals
    """Plane-wave signals of the paths."""
    inner: InnerProducts
    """Inner products of these signals."""
    exact: Complexes | None
    """(L M, P) exact spherical-wave signals of the paths, where the sounding asks for them."""
    seen: Complexes
    """(4, P) `a^H y` and `d^H y` of the samples; where the signals are exact, of the residual."""
    covariance: Floats
    """(P, P) covariance of the complex amplitudes at known parameters."""
    amplitude: Complexes
    """(P,) complex amplitudes."""
    slopes: Complexes
    """(3, P) `d^H r` of the residual."""
    energy: float
    """Energy of the samples."""
    cost: float
    """Energy of the residual."""

    @property
    def parameters(self) -> Floats:
        """Parameters (P, 3) of the fitted paths, (B tau, u, v)."""
        return self.waves.parameters


class Accuracy(NamedTuple):
    """Standard deviations of P fitted paths by their joint Cramér-Rao bound."""

    parameters: Floats
    """(P, 3) standard deviations of (B tau, u, v)."""
    amplitude: Floats
    """(P,) standard deviation of the complex amplitude, the other paths' parameters unknown as well."""


def fit_amplitudes(sounding: Sounding, parameters: Floats, samples: Complexes) -> LeastSquaresFit:
    """Least-squares fit of the amplitudes of paths with given parameters (P, 3) to samples (L, M)."""
    waves = waves_at(sounding, parameters)
    inner, energy = inner_of(sounding, waves), float(np.vdot(samples, samples).real)
    if sounding.squint:
        return _exact_fit(sounding, waves, inner, samples, energy)
    return _fit(waves, inner, waves.correlate(sounding, samples), energy)


def _fit(waves: PathSignals, inner: InnerProducts, seen: Complexes, energy: float) -> LeastSquaresFit:
    """Least-squares amplitudes from the correlations (4, P) of signals and derivatives with samples of this energy."""
    count, matched = len(waves.parameters), seen[0]
    covariance = inverse(inner.signal)
    amplitude = _times(covariance, matched)
    cost = energy - np.vdot(amplitude, 2.0 * matched - _times(inner.signal, amplitude)).real
    slopes = seen[1:] - _times(inner.mixed.reshape(count, 3 * count).T, amplitude).reshape(3, count)
    return LeastSquaresFit(waves, inner, None, seen, covariance, amplitude, slopes, energy, float(cost))


def _times(matrix: Floats, vector: Complexes) -> Complexes:
    """Product of a real matrix (n, m) and complex amplitudes (m,) in the refinement, the matrix staying real."""
    parts = np.ascontiguousarray(vector).view(np.float64).reshape(-1, 2)
    return np.asarray((matrix @ parts).view(np.complex128)[:, 0])


def _exact_fit(
    sounding: Sounding, waves: PathSignals, inner: InnerProducts, samples: Complexes, energy: float
) -> LeastSquaresFit:
    """Least-squares fit of amplitudes to samples (L, M) with the paths' exact spherical-wave signals."""
    exact = wave_signals(sounding, waves.parameters)
    products = exact.conj().T @ exact + RIDGE * sounding.num_samples * np.eye(exact.shape[1])
    amplitude = np.asarray(np.linalg.solve(products, exact.conj().T @ samples.ravel()), dtype=np.complex128)
    rest = samples - (exact @ amplitude).reshape(samples.shape)
    matched, slopes = correlate_waves(sounding, exact, rest)
    cost, seen = float(np.vdot(rest, rest).real), np.asarray(np.concatenate([matched[None], slopes]))
    return LeastSquaresFit(waves, inner, exact, seen, inverse(inner.signal), amplitude, slopes, energy, cost)


def subset_fit(sounding: Sounding, fit: LeastSquaresFit, keep: Booleans, samples: Complexes) -> LeastSquaresFit:
    """Least-squares fit of some of a fit's paths alone."""
    if fit.exact is not None:
        return fit_amplitudes(sounding, fit.parameters[keep], samples)
    return _fit(fit.waves.take(keep), fit.inner.take(keep), fit.seen[:, keep], fit.energy)


def residual_fit(
    sounding: Sounding, fit: LeastSquaresFit, rows: Integers, samples: Complexes
) -> tuple[LeastSquaresFit, Complexes]:
    """Fit of some paths to the samples less all other paths, for refining them alone; and those samples (L, M)."""
    others = np.ones(len(fit.amplitude), dtype=bool)
    others[rows] = False
    local = samples - contribution(fit, others, samples)
    if fit.exact is not None:
        return fit_amplitudes(sounding, fit.parameters[rows], local), local
    inner, own = fit.inner.take(rows), fit.amplitude[rows]
    # what the residual shows of a path, and what the path itself does: `a^H r + a^H a alpha`
    rest = fit.seen[0] - _times(fit.inner.signal, fit.amplitude)
    seen = np.concatenate([rest[None], fit.slopes])[:, rows]
    seen[0] += _times(inner.signal, own)
    seen[1:] += _times(inner.mixed.reshape(len(rows), -1).T, own).reshape(3, -1)
    return _fit(fit.waves.take(rows), inner, seen, float(np.vdot(local, local).real)), local


def residual(fit: LeastSquaresFit, samples: Complexes) -> Complexes:
    """Residual (L, M) of the samples of a refinement, all fitted paths subtracted."""
    return samples - contribution(fit, np.arange(len(fit.amplitude)), samples)


def contribution(fit: LeastSquaresFit, rows: Integers | Booleans, samples: Complexes) -> Complexes:
    """Signal (L, M) that some of the refined paths contribute to the fit."""
    if fit.exact is not None:
        return np.asarray((fit.exact[:, rows] @ fit.amplitude[rows]).reshape(samples.shape))
    return fit.waves.take(rows).sum(fit.amplitude[rows])


def refine(
    sounding: Sounding, fit: LeastSquaresFit, samples: Complexes, *, steps: int, tolerance: float = SEARCH_TOLERANCE,
    enough: float = 0.0,
) -> LeastSquaresFit:  # fmt: skip
    """Refine path parameters by up to `steps` damped Gauss-Newton steps.

    They end when one promises less than `tolerance` of noise energy from every path; with `enough`, also when the cost
    has come below it, or will not: if every step left gained as much as the last, or twice what the next promises.
    Where most paths have come to rest, only the others go on, with those that overlap them.
    """
    damping, gained = DAMPING, np.inf
    for left in range(steps, 0, -1):
        if enough and not 0.0 < fit.cost - enough < left * gained:
            return fit
        information = information_matrix(fit.inner, fit.covariance, fit.amplitude)
        gradient = np.real(fit.amplitude.conj() * fit.slopes).ravel()
        diagonal = np.diagonal(information).copy()
        while damping < 1e3:
            np.fill_diagonal(information, (1.0 + damping) * diagonal)
            step = solve(information, gradient)
            if enough and fit.cost - HOPE * (gradient @ step) > enough:
                return fit
            restless = np.abs((gradient * step).reshape(3, -1)).sum(axis=0) > tolerance
            if not restless.any():
                return fit
            if len(restless) > FEW:
                overlap = np.abs(fit.inner.signal[:, restless]) > OVERLAP * sounding.num_samples
                rows = np.flatnonzero(overlap.any(axis=1))
                if len(rows) < WORTHWHILE * len(restless):
                    return refine_some(sounding, fit, samples, rows, steps=left, tolerance=tolerance)
            trial = fit_amplitudes(
                sounding, fit.parameters + np.clip(step.reshape(3, -1).T, -LARGEST_STEP, LARGEST_STEP), samples
            )
            if trial.cost < fit.cost:
                gained = fit.cost - trial.cost
                fit, damping = trial, max(0.1 * damping, LEAST_DAMPING)
                break
            damping *= 10.0
        else:
            return fit
    return fit


def refine_some(
    sounding: Sounding, fit: LeastSquaresFit, samples: Complexes, rows: Integers, *, steps: int,
    tolerance: float = SEARCH_TOLERANCE,
) -> LeastSquaresFit:  # fmt: skip
    """Refine the parameters of some paths by Gauss-Newton steps, the other paths held."""
    begun, local = residual_fit(sounding, fit, rows, samples)
    some = refine(sounding, begun, local, steps=steps, tolerance=tolerance)
    parameters = fit.parameters.copy()
    parameters[rows] = some.parameters
    return fit_amplitudes(sounding, parameters, samples)


def accuracy(fit: LeastSquaresFit) -> Accuracy:
    """Standard deviations of a fit's parameters and amplitudes by their joint bound; enormous where not resolved."""
    information = 2.0 * information_matrix(fit.inner, fit.covariance, fit.amplitude)
    deviations = np.sqrt((whitened(information, np.eye(len(information))) ** 2).sum(axis=0)).reshape(3, -1).T
    return Accuracy(deviations, np.sqrt(amplitude_variance(fit.inner, fit.covariance, fit.amplitude, information)))


def amplitude_variance(inner: InnerProducts, known: Floats, amplitude: Complexes, information: Floats) -> Floats:
    """Variance (P,) of complex amplitudes when the parameters are unknown as well, of Fisher information (3P, 3P).

    `known` (P, P) is the amplitudes' covariance at given parameters.
    """
    count = len(amplitude)
    follow = (known @ inner.mixed.reshape(count, 3 * count)).reshape(count, 3, count)
    parts = np.concatenate([follow * amplitude.real, follow * amplitude.imag]).reshape(2 * count, 3 * count)
    return np.asarray(np.diagonal(known) + (whitened(information, parts.T) ** 2).sum(axis=0).reshape(2, -1).sum(axis=0))


def without_idle(fit: LeastSquaresFit, threshold: float) -> Booleans:
    """Which refined paths (P,) to keep when those are dropped, one by one, that lower the cost by less than the
    threshold.

    The others' amplitudes are fitted again after each, by a rank-one change of their covariance.
    """
    amplitude, covariance = fit.amplitude, fit.covariance
    keep = np.ones(len(amplitude), dtype=bool)
    while keep.any():
        loss = np.where(keep, np.abs(amplitude) ** 2 / np.maximum(np.diagonal(covariance), 1e-300), np.inf)
        idle = int(np.argmin(loss))
        if loss[idle] >= threshold:
            break
        keep[idle] = False
        share = covariance[:, idle] / covariance[idle, idle]
        amplitude = amplitude - share * amplitude[idle]
        covariance = covariance - np.outer(share, covariance[idle])
    return keep


def information_matrix(inner: InnerProducts, covariance: Floats, amplitude: Complexes) -> Floats:
    """Half the Fisher information (3P, 3P) on the parameters at unit noise, parameter by parameter, then path by path.

    With the amplitudes unknown; `covariance` (P, P) is theirs at known parameters.
    """
    count = len(amplitude)
    mixed = inner.mixed.reshape(count, 3 * count)
    shared = (mixed.T @ (covariance @ mixed)).reshape(3, count, 3, count)
    np.subtract(inner.slope, shared, out=shared)
    shared *= np.real(np.multiply.outer(amplitude.conj(), amplitude))[:, None]
    information = shared.reshape(3 * count, 3 * count)
    information.flat[:: 3 * count + 1] += np.repeat(PRIOR, count)
    return information
