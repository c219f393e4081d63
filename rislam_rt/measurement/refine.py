"""Joint refinement of all paths: least squares by Gauss-Newton with the amplitudes eliminated.

Separable least squares (Golub and Pereyra 1973, in Kaufman's form): the amplitudes follow from the parameters, so the
steps are in the 3 P real parameters alone. The matrix of a step is the Fisher information with the amplitudes as
nuisance, so the joint Cramer-Rao bound comes with it.
"""

from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.measurement.atoms import Factors, Grams, Sounding, correlate, factors, inner_products, synthesise
from rislam_rt.measurement.waves import correlate_waves, wave_signals

RIDGE = 1e-9
"""Added to the diagonal of matrices of unit diagonal, so that coinciding paths do not stop the solver."""
PRIOR = np.array([0.0, 2.0, 2.0])
"""Half the information that lying in the unit disc gives on a cosine (standard deviation 0.5): it matters only along an
axis on which the array has no aperture."""
LARGEST_STEP = np.array([0.3, 0.15, 0.15])
"""Most that one step may change (B tau, u, v): about a third of a cell, within which the error is nearly quadratic."""


class Fit(NamedTuple):
    """P paths fitted to samples whose noise has unit variance."""

    parameters: Floats
    """(P, 3) of (B tau, u, v)."""
    parts: Factors
    """Their signals."""
    inner: Grams
    """Inner products of those."""
    waves: Complexes | None
    """(L M, P) their signals without approximations, where the sounding asks for it."""
    amplitude: Complexes
    """(P,)."""
    residual: Complexes
    """(L, M) samples less the fitted paths."""
    cost: float
    """Energy of the residual."""


class Accuracy(NamedTuple):
    """Joint bound at a fit."""

    parameters: Floats
    """(P, 3) standard deviations."""
    amplitude: Floats
    """(P,) standard deviation of the complex amplitude, the other paths' parameters unknown as well."""


def fit_amplitudes(sounding: Sounding, parameters: Floats, samples: Complexes) -> Fit:
    """The fit with these parameters (P, 3) and the amplitudes that suit them best."""
    parts = factors(sounding, parameters)
    inner = inner_products(parts)
    waves = None
    if sounding.squint:
        waves = wave_signals(sounding, parameters)
        amplitude = _solve(waves.conj().T @ waves, waves.conj().T @ samples.ravel())
        residual = samples - (waves @ amplitude).reshape(samples.shape)
    else:
        amplitude = _solve(inner.signal, correlate(parts, samples)[0])
        residual = samples - synthesise(parts, amplitude)
    return Fit(parameters, parts, inner, waves, amplitude, residual, float(np.vdot(residual, residual).real))


def refine(
    sounding: Sounding, fit: Fit, samples: Complexes, *, steps: int, tolerance: float = 0.1, enough: float = 0.0
) -> Fit:
    """Up to so many damped Gauss-Newton steps.

    They end when one promises less than `tolerance` of noise energy; with `enough`, also when the cost has come below
    it, or would not if every step left gained as much as the last.
    """
    damping, gained = 1e-3, np.inf
    for left in range(steps, 0, -1):
        if enough and not 0.0 < fit.cost - enough < left * gained:
            return fit
        information, _ = information_matrix(fit.inner, fit.amplitude)
        gradient = np.real(fit.amplitude.conj() * _slopes(sounding, fit)).ravel()
        while damping < 1e3:
            step = _solve(information + damping * np.diag(np.diagonal(information)), gradient)
            if gradient @ step < tolerance:
                return fit
            trial = fit_amplitudes(sounding, fit.parameters + _limited(step), samples)
            if trial.cost < fit.cost:
                gained = fit.cost - trial.cost
                fit, damping = trial, max(0.1 * damping, 1e-6)
                break
            damping *= 10.0
        else:
            return fit
    return fit


def contribution(fit: Fit, rows: Integers) -> Complexes:
    """What some of the fitted paths add to the samples (L, M)."""
    if fit.waves is not None:
        return (fit.waves[:, rows] @ fit.amplitude[rows]).reshape(fit.residual.shape)
    return synthesise(Factors(*(part[..., rows] for part in fit.parts)), fit.amplitude[rows])


def _slopes(sounding: Sounding, fit: Fit) -> Complexes:
    """`d^H r` (3, P) of the residual."""
    if fit.waves is None:
        return correlate(fit.parts, fit.residual)[1]
    return correlate_waves(sounding, fit.waves, fit.residual)[1]


def accuracy(fit: Fit) -> Accuracy:
    """Joint bound of parameters and amplitudes; enormous where paths cannot be told apart."""
    covariance, variance = joint_bound(fit.inner, fit.amplitude)
    deviations = np.sqrt(np.maximum(np.diagonal(covariance), 0.0)).reshape(3, -1).T
    return Accuracy(deviations, np.sqrt(variance))


def joint_bound(inner: Grams, amplitude: Complexes) -> tuple[Floats, Floats]:
    """Covariance (3P, 3P) of the parameters, parameter by parameter, and variance (P,) of the complex amplitudes.

    At unit noise, everything unknown.
    """
    information, (inverse, coupling) = information_matrix(inner, amplitude)
    covariance = _inverse(2.0 * information)
    spread = np.real(np.diagonal(inverse)) + np.sum(np.real(coupling @ covariance * coupling.conj()), axis=1)
    return covariance, np.maximum(spread, 0.0)


def without_idle(fit: Fit, threshold: float) -> Booleans:
    """(P,) which paths are left when those go, the most idle first, without which the cost grows by less than that.

    The others' amplitudes are fitted again after each, by a rank-one change of their covariance.
    """
    amplitude, covariance = fit.amplitude.copy(), amplitude_covariance(fit)
    keep = np.ones(len(amplitude), dtype=bool)
    while keep.any():
        variance = np.real(np.diagonal(covariance))
        loss = np.where(keep, np.abs(amplitude) ** 2 / np.where(keep, variance, 1.0), np.inf)
        idle = int(np.argmin(loss))
        if loss[idle] >= threshold:
            break
        keep[idle] = False
        share = covariance[:, idle] / variance[idle]
        amplitude -= share * amplitude[idle]
        covariance = covariance - np.outer(share, covariance[idle])
    return keep


def amplitude_covariance(fit: Fit) -> Complexes:
    """(P, P) covariance of the complex amplitudes at known parameters."""
    return _inverse(fit.inner.signal)


def information_matrix(inner: Grams, amplitude: Complexes) -> tuple[Floats, tuple[Complexes, Complexes]]:
    """Half the Fisher information (3P, 3P) on the parameters at unit noise, parameter by parameter, then path by path.

    Also returns the inverse (P, P) of `a^H a`, and the coupling (P, 3P) `(a^H a)^-1 a^H d alpha` of amplitudes to
    parameters.
    """
    count = len(amplitude)
    inverse = _inverse(inner.signal)
    mixed = (inner.mixed * amplitude).transpose(1, 0, 2).reshape(count, 3 * count)
    coupling = inverse @ mixed
    slope = np.real(inner.slope * (amplitude.conj()[:, None] * amplitude))
    shared = np.concatenate([mixed.real, mixed.imag]).T @ np.concatenate([coupling.real, coupling.imag])
    information = slope.transpose(0, 2, 1, 3).reshape(3 * count, 3 * count) - 0.5 * (shared + shared.T)
    information[np.diag_indices(3 * count)] += np.repeat(PRIOR, count)
    return information, (inverse, coupling)


def _limited(step: Floats) -> Floats:
    """A step (3P,) as (P, 3), no path moving further than the model holds."""
    moves = step.reshape(3, -1).T
    return np.clip(moves, -LARGEST_STEP, LARGEST_STEP)


def _solve(matrix: NDArray[Any], right: NDArray[Any]) -> NDArray[Any]:
    """Solution for a Hermitian positive matrix, scaled to unit diagonal."""
    scale, factor = _factor(matrix)
    if not len(scale):
        return right
    solve = scipy.linalg.lapack.zpotrs if np.iscomplexobj(factor) else scipy.linalg.lapack.dpotrs
    return scale * solve(factor, scale * right, lower=1)[0]


def _inverse(matrix: NDArray[Any]) -> NDArray[Any]:
    """Inverse of a Hermitian positive matrix, likewise."""
    scale, factor = _factor(matrix)
    if not len(scale):
        return matrix
    invert = scipy.linalg.lapack.zpotri if np.iscomplexobj(factor) else scipy.linalg.lapack.dpotri
    lower = np.tril(invert(factor, lower=1)[0])
    full = lower + np.tril(lower, -1).conj().T
    return scale[:, None] * full * scale


def _factor(matrix: NDArray[Any]) -> tuple[Floats, NDArray[Any]]:
    """Scale (n,) and Cholesky factor of the scaled matrix; the ridge grows until it is positive."""
    diagonal = np.real(np.diagonal(matrix))
    scale = 1.0 / np.sqrt(np.maximum(diagonal, np.finfo(np.float64).tiny))
    scaled = matrix * scale[:, None] * scale
    decompose = scipy.linalg.lapack.zpotrf if np.iscomplexobj(matrix) else scipy.linalg.lapack.dpotrf
    ridge = RIDGE
    while len(scale):
        scaled[np.diag_indices(len(scale))] += ridge
        factor, failed = decompose(scaled, lower=1)
        if not failed:
            return scale, factor
        ridge *= 100.0
    return scale, scaled
