"""Signals of many paths in one or several captures, and their inner products, which are all real.

The signals are those of `atoms`. Tones and elements lie evenly about their middles, so that an inner product over one
axis is a sum of cosines: half the axis says all, and real matrices do. Paths of different captures have none.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.measurement.atoms import Sounding, tone_response


class Waves(NamedTuple):
    """Signals of P paths, products over tones, rows and columns."""

    parameters: Floats
    """(P, 3) of (B tau, u, v)."""
    capture: Integers
    """(P,)."""
    delay: Complexes
    """(M, P)."""
    row: Complexes
    """(R, P)."""
    col: Complexes
    """(C, P)."""

    def take(self, rows: Booleans | Integers) -> "Waves":
        """Some of the paths."""
        return Waves(
            self.parameters[rows], self.capture[rows], self.delay[:, rows], self.row[:, rows], self.col[:, rows]
        )

    def join(self, other: "Waves") -> "Waves":
        """These and more."""
        return Waves(
            np.concatenate([self.parameters, other.parameters]),
            np.concatenate([self.capture, other.capture]),
            np.concatenate([self.delay, other.delay], axis=1),
            np.concatenate([self.row, other.row], axis=1),
            np.concatenate([self.col, other.col], axis=1),
        )

    @property
    def antennas(self) -> Complexes:
        """(L, P)."""
        return (self.row[:, None] * self.col).reshape(len(self.row) * len(self.col), -1)

    def matched(self, samples: Complexes) -> Complexes:
        """`a^H y` (P,) of the capture of each in samples (C, L, M)."""
        return np.asarray(np.sum(self.antennas.conj() * self._beams(samples, self.delay), axis=0))

    def slopes(self, sounding: Sounding, samples: Complexes) -> Complexes:
        """`d^H y` (3, P) of the derivatives by the parameters, likewise."""
        antennas = self.antennas.conj()
        field = (antennas * self._beams(samples, self.delay)).reshape(len(self.row), len(self.col), -1)
        steep = self._beams(samples, sounding.frequency[:, None] * self.delay)
        by_row, by_col = sounding.row @ field.sum(axis=1), sounding.col @ field.sum(axis=0)
        return 2j * np.pi * np.stack([np.sum(antennas * steep, axis=0), -by_row, -by_col])

    def sum(self, amplitude: Complexes, captures: int) -> Complexes:
        """Samples (C, L, M) of all paths with amplitudes (P,)."""
        antennas = self.antennas * amplitude
        if captures == 1:
            return np.asarray(antennas @ self.delay.T)[None]
        mine = self.capture == np.arange(captures)[:, None]
        return np.asarray((antennas * mine[:, None]) @ self.delay.T)

    def _beams(self, samples: Complexes, delay: Complexes) -> Complexes:
        """(L, P) antennas' outputs matched to the delays, of the capture of each."""
        beams = samples @ delay.conj()
        if len(samples) == 1:
            return np.asarray(beams[0])
        return np.asarray(np.take_along_axis(beams, self.capture[None, None], axis=0)[0])


class Inner(NamedTuple):
    """Inner products of P signals `a` and their derivatives `d`."""

    signal: Floats
    """(P, P) `a_i^H a_j`."""
    mixed: Floats
    """(P, 3, P) `a_i^H d_j`."""
    slope: Floats
    """(3, P, 3, P) `d_i^H d_j`."""

    def take(self, keep: Booleans) -> "Inner":
        """Some of the paths."""
        rows = np.flatnonzero(keep)
        return Inner(
            self.signal[np.ix_(rows, rows)],
            self.mixed[rows][..., rows],
            self.slope[:, rows][..., rows],
        )


def waves_at(sounding: Sounding, parameters: Floats, capture: Integers) -> Waves:
    """Signals of paths at parameters (P, 3)."""
    return Waves(
        parameters,
        capture,
        tone_response(sounding.frequency, parameters[:, 0]),
        np.exp(2j * np.pi * np.multiply.outer(sounding.row, parameters[:, 1])),
        np.exp(2j * np.pi * np.multiply.outer(sounding.col, parameters[:, 2])),
    )


def signal_products(waves: Waves) -> Floats:
    """(P, P) inner products of the signals alone."""
    value = _real_gram(waves.delay) * _real_gram(waves.row) * _real_gram(waves.col)
    return _apart(value, waves.capture)


def inner_of(sounding: Sounding, waves: Waves) -> Inner:
    """All inner products, parameter by parameter."""
    (f0, f1, f2), (x0, x1, x2), (y0, y1, y2) = (
        _axis_products(wave, place)
        for wave, place in (
            (waves.delay, -sounding.frequency),
            (waves.row, sounding.row),
            (waves.col, sounding.col),
        )
    )
    count = len(f0)
    f0, f1, f2 = (_apart(value, waves.capture) for value in (f0, f1, f2))
    fx, fy, xy = f0 * x0, f0 * y0, x0 * y0
    mixed, slope = np.empty((count, 3, count)), np.empty((3, count, 3, count))
    mixed[:, 0], mixed[:, 1], mixed[:, 2] = f1 * xy, x1 * fy, y1 * fx
    slope[0, :, 0], slope[1, :, 1], slope[2, :, 2] = f2 * xy, x2 * fy, y2 * fx
    for a, b, value in ((0, 1, f1 * x1.T * y0), (0, 2, f1 * y1.T * x0), (1, 2, x1 * y1.T * f0)):
        slope[b, :, a], slope[a, :, b] = value, value.T
    return Inner(fx * y0, mixed, slope)


def _apart(value: Floats, capture: Integers) -> Floats:
    """Inner products (P, P), zero between captures."""
    if not len(capture) or (capture == capture[0]).all():
        return value
    return np.asarray(value * (capture[:, None] == capture))


def _axis_products(wave: Complexes, place: Floats) -> tuple[Floats, Floats, Floats]:
    """(P, P) along one axis of the signals (n, P), of signals and derivatives, and of derivatives."""
    count, size = wave.shape
    half = wave[: count // 2] if count % 2 == 0 else wave
    flat = np.concatenate([half, (2j * np.pi * place[: len(half)])[:, None] * half], axis=1)
    product = _real_gram(flat) * (1.0 if len(half) == count else 2.0)
    return product[:size, :size], product[:size, size:], product[size:, size:]


def _real_gram(wave: Complexes) -> Floats:
    """Real part (P, P) of the inner products of columns (n, P)."""
    stacked = np.concatenate([wave.real, wave.imag])
    return np.asarray(stacked.T @ stacked)
