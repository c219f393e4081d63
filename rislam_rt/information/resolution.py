"""Resolution of two paths: the probability that a receiver resolves them, from their joint Cramér-Rao bound."""

from typing import Any

import numpy as np

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.model import RadioConfig, SensorModel, detection_probability

PHASES = 8
"""Number of relative phases of two paths that are averaged: half a turn covers them, as the other half is alike."""
BAND_NODES = 24
"""Number of Gauss-Legendre nodes over the band: exact to 1e-9 for delays up to 4 cells; beyond, nothing overlaps."""
FAR = 4.0
"""Delay difference [cells] beyond which two paths do not overlap."""
RIDGE = 1e-10
"""Added to a Gram matrix of unit diagonal, so that coinciding paths do not stop the solver."""


def resolved_probability(gap: Floats, snr: Floats, sensor: SensorModel) -> Floats:
    """Probability (...,) that the receiver resolves two paths, averaged over their relative phase.

    Parameters
    ----------
    gap
        (..., 3) difference of the two in delay [s] and cosines.
    snr
        (..., 2) expected SNR of each: linear, over all antennas.

    The weaker one needs an amplitude that passes the threshold when the parameters and amplitudes of both are unknown:
    its SNR times `certainty_share` takes the place of that of a lone path. A receiver that resolves by cells has
    another rule.
    """
    if sensor.resolution != "joint":
        return np.where(sensor.may_merge(gap), 0.0, 1.0)
    weaker = np.min(snr, axis=-1)
    share = certainty_share(gap, sensor.radio)
    return np.asarray(detection_probability(weaker[..., None] * share, sensor.threshold).mean(axis=-1))


def certainty_share(gap: Floats, radio: RadioConfig) -> Floats:
    """Ratio (..., `PHASES`) of a lone path's amplitude variance to that beside a second path, for resolution: 1 far
    from it.

    From the joint Cramer-Rao bound of two paths, complex amplitudes, delays and both cosines unknown: it
    depends on their gap (..., 3) and relative phase, not on how strong the other is.
    """
    inner = _inner_products(np.asarray(gap, dtype=np.float64), radio)
    turn = np.exp(1j * np.pi * (np.arange(PHASES) + 0.5) / PHASES)
    one, shares = np.ones(PHASES), []
    columns = [0, 0, 4, 4, 1, 2, 3, 5, 6, 7]
    weights = np.stack([one, 1j * one, one, 1j * one, turn, turn, turn, one, one, one], axis=-1)
    inner = inner[..., columns, :][..., columns]
    for weight in weights:
        information = np.real(weight.conj()[:, None] * weight * inner) + RIDGE * np.eye(len(columns))
        variance = np.linalg.inv(information)
        shares.append(2.0 / (variance[..., 0, 0] + variance[..., 1, 1]))
    return np.stack(shares, axis=-1)


def _inner_products(gap: Floats, radio: RadioConfig) -> Complexes:
    """Inner products (..., 8, 8) of the signals of two paths to resolve and of their derivatives, all of unit norm."""
    array = radio.array
    nodes, weight = np.polynomial.legendre.leggauss(BAND_NODES)
    rows, cols = ((np.arange(count) - (count - 1) / 2.0) * array.spacing for count in (array.rows, array.cols))
    axes = [(-nodes / 2.0, weight / 2.0), *((line, np.full(len(line), 1.0 / len(line))) for line in (rows, cols))]
    delay = np.clip(gap[..., 0] * radio.bandwidth, -FAR, FAR)
    apart = np.stack([delay, gap[..., 1], gap[..., 2]], axis=-1)
    own, cross = (_block(where, axes) for where in (np.zeros((1, 3)), apart))
    cross = np.where((np.abs(gap[..., 0]) * radio.bandwidth >= FAR)[..., None, None], 0.0, cross)
    own = np.broadcast_to(own[0], cross.shape)
    inner = np.concatenate(
        [np.concatenate([own, cross], -1), np.concatenate([np.swapaxes(cross, -1, -2).conj(), own], -1)], -2
    )
    size = np.sqrt(np.maximum(np.real(np.diagonal(inner, axis1=-2, axis2=-1)), RIDGE))
    return np.asarray(inner / size[..., :, None] / size[..., None, :])


def _block(gap: Floats, axes: list[tuple[Any, Any]]) -> Complexes:
    """Inner products (..., 4, 4), for resolution, of one path's signal and derivatives with those of another a `gap`
    (..., 3) away."""
    moments = []
    for axis, (place, weight) in enumerate(axes):
        wave = np.exp(2j * np.pi * np.multiply.outer(gap[..., axis], place)) * weight
        moments.append([wave @ (2j * np.pi * place) ** order for order in range(3)])
    block = np.empty((*gap.shape[:-1], 4, 4), dtype=np.complex128)
    for i in range(4):
        for j in range(4):
            orders = [int(i == axis + 1) + int(j == axis + 1) for axis in range(3)]
            sign = -1.0 if i else 1.0
            block[..., i, j] = sign * np.prod([moments[axis][order] for axis, order in enumerate(orders)], axis=0)
    return block
