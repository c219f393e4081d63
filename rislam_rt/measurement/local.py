"""Maximum likelihood on the samples, begun where the paths are instead of searched for.

A search over delay and sky takes nine tenths of the waveform estimator's time and ends where the paths are. This one
has the same samples with the same noise, and asks at the paths' own places alone whether the residual holds another
one. What decides is what decides there: all that were found are refined together, what is left passes the same
threshold or is not looked at, and what its neighbours can stand in for goes again. So merging, pulls, deviations and
failures come out as they are and follow no rule. The captures of a cycle are separate problems, solved side by side.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.measurement.atoms import Sounding
from rislam_rt.measurement.inner import Inner, Waves, inner_of, signal_products, waves_at
from rislam_rt.measurement.refine import LARGEST_STEP, PRIOR

COUPLED = 0.8
"""Correlation of two signals from which on the weaker waits until the stronger was refined."""
ROUNDS = 1
"""Rounds in which the residual is asked for more paths, after the first; each ends with a step of all."""
DAMPING = 1e-3
RIDGE = 1e-9
"""Share of the diagonal added to matrices, so that coinciding paths do not stop the solver."""
SLACK = 0.1
"""How far (B tau, u, v) a path may leave the window and the sky."""


class LocalFit(NamedTuple):
    """P paths fitted to the samples of all captures, whose noise has unit variance."""

    waves: Waves
    amplitude: Complexes
    """(P,)."""
    residual: Complexes
    """(C, L, M)."""
    inner: Inner
    inverse: Floats
    """(P, P) of the signals' inner products: the covariance of the amplitudes at known parameters."""


class LocalEstimate(NamedTuple):
    """What `estimate_local` found, with its joint bound."""

    parameters: Floats
    """(P, 3) of (B tau, u, v)."""
    capture: Integers
    """(P,)."""
    amplitude: Complexes
    """(P,)."""
    deviation: Floats
    """(P, 3)."""
    amplitude_std: Floats
    """(P,) of the complex amplitude."""
    inverse: Floats
    """(P, P) covariance of the complex amplitudes at known parameters."""


def estimate_local(
    sounding: Sounding, there: Waves, samples: Complexes, threshold: float, window: tuple[float, float]
) -> LocalEstimate:
    """All paths that samples (C, L, M) of unit noise show at or about the places of some waves."""
    beside = np.abs(signal_products(there)) > COUPLED * sounding.num_samples
    fit = _fit(sounding, there.take(_peaks(there, beside, samples, sounding.num_samples, threshold)), samples)
    fit = _without_idle(_step(sounding, fit, samples), samples, threshold, window)
    for _ in range(ROUNDS):
        rows = _peaks(there, beside, fit.residual, sounding.num_samples, threshold)
        if len(rows):
            fit = _fit(sounding, fit.waves.join(there.take(rows)), samples)
        fit = _without_idle(_step(sounding, fit, samples), samples, threshold, window)
    deviation, amplitude_std = _bound(fit)
    return LocalEstimate(fit.waves.parameters, fit.waves.capture, fit.amplitude, deviation, amplitude_std, fit.inverse)


def _fit(sounding: Sounding, waves: Waves, samples: Complexes) -> LocalFit:
    """Amplitudes, residual and inner products."""
    inner = inner_of(sounding, waves)
    inverse = _inverse(inner.signal)
    amplitude = inverse @ waves.matched(samples)
    return LocalFit(waves, amplitude, samples - waves.sum(amplitude, len(samples)), inner, inverse)


def _pick(fit: LocalFit, keep: Booleans, samples: Complexes) -> LocalFit:
    """Some of the paths, amplitudes fitted again."""
    waves, inner = fit.waves.take(keep), fit.inner.take(keep)
    inverse = _inverse(inner.signal)
    amplitude = inverse @ waves.matched(samples)
    return LocalFit(waves, amplitude, samples - waves.sum(amplitude, len(samples)), inner, inverse)


def _step(sounding: Sounding, fit: LocalFit, samples: Complexes) -> LocalFit:
    """One damped Gauss-Newton step of all parameters, the amplitudes eliminated; shorter where it went too far."""
    count = len(fit.amplitude)
    if not count:
        return fit
    information = _information(fit)
    gradient = np.real(fit.amplitude.conj() * fit.waves.slopes(sounding, fit.residual)).ravel()
    cost = np.vdot(fit.residual, fit.residual).real
    for damping in (DAMPING, 1.0):
        information.flat[:: 3 * count + 1] *= 1.0 + damping
        moves = np.clip(_solve(information, gradient).reshape(3, -1).T, -LARGEST_STEP, LARGEST_STEP)
        waves = waves_at(sounding, fit.waves.parameters + moves, fit.waves.capture)
        trial = _fit(sounding, waves, samples)
        if np.vdot(trial.residual, trial.residual).real <= cost:
            return trial
    return fit


def _information(fit: LocalFit) -> Floats:
    """Half the Fisher information (3P, 3P) on the parameters, the amplitudes unknown."""
    count = len(fit.amplitude)
    power = np.real(np.multiply.outer(fit.amplitude.conj(), fit.amplitude))
    mixed = fit.inner.mixed.reshape(count, 3 * count)
    shared = fit.inner.slope - (mixed.T @ (fit.inverse @ mixed)).reshape(3, count, 3, count)
    information = (shared * power[:, None]).reshape(3 * count, 3 * count)
    information.flat[:: 3 * count + 1] += np.repeat(PRIOR, count)
    return np.asarray(information)


def _bound(fit: LocalFit) -> tuple[Floats, Floats]:
    """Joint bound: deviations (P, 3) of the parameters and (P,) of the complex amplitudes, everything unknown."""
    count = len(fit.amplitude)
    covariance = 0.5 * _inverse(_information(fit))
    coupling = fit.inverse @ (fit.inner.mixed * fit.amplitude).reshape(count, 3 * count)
    real, imaginary = coupling.real, coupling.imag
    spread = np.diagonal(fit.inverse) + ((real @ covariance) * real + (imaginary @ covariance) * imaginary).sum(axis=1)
    deviation = np.sqrt(np.maximum(np.diagonal(covariance), 0.0)).reshape(3, -1).T
    return deviation, np.sqrt(np.maximum(spread, 0.0))


def _peaks(there: Waves, beside: Booleans, residual: Complexes, energy: int, threshold: float) -> Integers:
    """Rows of places at which the residual passes the threshold, none beside a stronger one."""
    snr = np.abs(there.matched(residual)) ** 2 / energy
    free = snr > threshold
    taken = []
    for row in np.argsort(-snr)[: np.count_nonzero(free)]:
        if free[row]:
            taken.append(row)
            free &= ~beside[row]
    return np.array(taken, dtype=np.int64)


def _without_idle(fit: LocalFit, samples: Complexes, threshold: float, window: tuple[float, float]) -> LocalFit:
    """Without paths outside window and sky, and without those whose loss costs less than the threshold."""
    delay, cosines = fit.waves.parameters[:, 0], fit.waves.parameters[:, 1:]
    keep = (delay >= window[0] - SLACK) & (delay <= window[1] + SLACK)
    keep &= np.sum(cosines**2, axis=1) <= (1.0 + SLACK) ** 2
    inverse, amplitude = fit.inverse, fit.amplitude
    while keep.any():
        loss = np.where(keep, np.abs(amplitude) ** 2 / np.maximum(np.diagonal(inverse), 1e-300), np.inf)
        idle = int(np.argmin(loss))
        if loss[idle] >= threshold:
            break
        keep[idle] = False
        share = inverse[:, idle] / inverse[idle, idle]
        amplitude = amplitude - share * amplitude[idle]
        inverse = inverse - np.outer(share, inverse[idle])
    return fit if keep.all() else _pick(fit, keep, samples)


def _inverse(matrix: Floats) -> Floats:
    """Inverse of a symmetric positive matrix, scaled to unit diagonal."""
    if not len(matrix):
        return matrix
    scale, factor = _factor(matrix)
    lower = lapack.dpotri(factor, lower=1)[0] * scale * scale[:, None]
    full = lower + lower.T
    full.flat[:: len(scale) + 1] *= 0.5
    return np.asarray(full)


def _solve(matrix: Floats, right: Floats) -> Floats:
    scale, factor = _factor(matrix)
    return np.asarray(scale * lapack.dpotrs(factor, scale * right, lower=1)[0])


def _factor(matrix: Floats) -> tuple[Floats, Floats]:
    """Scale (n,) and Cholesky factor, zero above, of the scaled matrix; the ridge grows until it is positive."""
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(matrix), np.finfo(np.float64).tiny))
    scaled, ridge = matrix * scale * scale[:, None], RIDGE
    while True:
        scaled.flat[:: len(scale) + 1] += ridge
        factor, failed = lapack.dpotrf(scaled, lower=1, clean=1)
        if not failed:
            return scale, factor
        ridge *= 100.0
