"""Rephase panel paths: their gains under a new phase code, linear in exp(-j xi), so that nothing is traced again."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Integers, phasor
from rislam_rt.errors import ConfigError
from rislam_rt.model.paths import Paths
from rislam_rt.model.ris import RisCode


class Block(NamedTuple):
    """Block of panel paths (I J,) that join each of the Tx legs (I,) with each of the Rx legs (J,), Tx legs first."""

    tx: Integers
    rx: Integers
    path: Integers


def panel_gain(tx: Complexes, rx: Complexes, code: RisCode, weight: Complexes | float = 1.0) -> Complexes:
    """Gain (...,) of panel paths under a new code (..., N, M), from the element responses (..., N, M) of their two
    legs.

    `weight` (..., N, M): the elements' true factor relative to the commanded one (`PanelErrors.weight`).
    """
    return np.einsum("...nm,...nm,...nm->...", tx, rx, weight * phasor(-code.xi))


def rephase(paths: Paths, code: RisCode, weight: Complexes | float = 1.0) -> Paths:
    """The same paths with their gains under another panel code, (N, M) or one a cycle (K, N, M), without a new trace.

    `weight` (N, M) or (K, N, M): the elements' true factor relative to the commanded one (`PanelErrors.weight`).

    Raises
    ------
    ConfigError
        The code is not of this panel, or of other cycles.
    """
    if paths.ris is None:
        return paths
    cycles, _, rows, cols = paths.ris.tx.shape
    if code.index.shape not in ((rows, cols), (cycles, rows, cols)):
        raise ConfigError(
            f"code: shape {code.index.shape} received; give ({rows}, {cols}), or one a cycle: ({cycles}, ...)"
        )
    factor = np.broadcast_to(weight * phasor(-code.xi), (cycles, rows, cols)).reshape(cycles, 1, rows * cols)
    tx, rx = (legs.reshape(*legs.shape[:2], rows * cols) for legs in (paths.ris.tx, paths.ris.rx))
    gain = np.array(paths.gain)
    for block in _blocks(paths.ris.tx_leg, paths.ris.rx_leg):
        one, other = tx[:, _span(block.tx)], rx[:, _span(block.rx)]
        # the shorter side takes the factor: half of all legs of a deep trace meet the bare leg alone
        one, other = (one * factor, other) if len(block.tx) <= len(block.rx) else (one, other * factor)
        pairs = (one @ other.swapaxes(1, 2)).reshape(cycles, -1)
        gain[:, block.path] = np.where(paths.valid[:, block.path], pairs, 0.0)
    gain.flags.writeable = False  # so that it is taken as it is
    return paths.with_gain(gain)


def _blocks(tx_leg: Integers, rx_leg: Integers) -> Iterator[Block]:
    """Sort panel paths to rephase into blocks of Tx legs that all join the same Rx legs."""
    # With `depth` bounces for both legs together, most pairs of legs are no path; these blocks hold none of them.
    path_of = {(int(tx_leg[p]), int(rx_leg[p])): int(p) for p in np.flatnonzero(tx_leg >= 0)}
    partners: dict[int, list[int]] = {}
    for i, j in sorted(path_of):
        partners.setdefault(i, []).append(j)
    groups: dict[tuple[int, ...], list[int]] = {}
    for i, js in partners.items():
        groups.setdefault(tuple(js), []).append(i)
    for rx, tx in groups.items():
        yield Block(np.array(tx), np.array(rx), np.array([path_of[i, j] for i in tx for j in rx]))


def _span(legs: Integers) -> Integers | slice:
    """Numbers (I,) of legs to rephase as a slice if they are consecutive, which numpy reads without a copy."""
    first, last = int(legs[0]), int(legs[-1])
    return slice(first, last + 1) if last - first + 1 == len(legs) else legs
