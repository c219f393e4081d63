"""Cancelled returns: single returns of two walls that arrive together, are alike to the array, and cancel.

An array with antennas half a wavelength apart hears what comes along its line alike from both ends. In the middle
between two walls the two returns are in opposite phase where the number of antennas is even, and it hears neither, as
long as the agent keeps to the middle.
"""

from collections.abc import Iterator

import numpy as np

from rislam_rt.adviser.link_budget import Survey
from rislam_rt.arrays import Booleans, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.input_messages import share_text
from rislam_rt.model import PathKind, Paths
from rislam_rt.pipeline.scores.audible_paths import audible_paths
from rislam_rt.scene.findings import Finding, warning_at

LEFT = 0.1
"""Share of their energy, apart, that two cancelled returns leave at most: 10 dB are lost."""


def cancelled_return_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """Warning, one for a room, of cancelled returns: at two places along the way or more, one after the other, audible
    single returns of the same two walls leave less than `LEFT` of their energy; `file` is what it names as its place.

    At one place alone a way crosses the middle.
    """
    paths, settings = looked.paths, looked.settings
    if not settings.slam.use_vt:
        return
    single = single_returns(paths)
    audible = audible_paths(paths, settings, use_vt=True)[:, single]
    cancel = np.stack([_cancel(looked, cycle, single) & one[:, None] & one for cycle, one in enumerate(audible)])
    stays = np.zeros(cancel.shape, dtype=np.bool_)
    stays[1:] = cancel[1:] & cancel[:-1]
    stays[:-1] |= stays[1:]
    share = stays.any(axis=(1, 2)).mean()
    if not share:
        return
    pair = np.unravel_index(np.argmax(stays.sum(axis=0)), cancel.shape[1:])
    one, other = (paths.label(int(single[end])).split()[-1] for end in pair)
    apart = 0.25 * SPEED_OF_LIGHT / settings.radio.bandwidth
    yield warning_at(
        file, "agent.trajectory",
        f"at {share_text(share)} of the places along the way that were looked at two walls are equally far on either "
        f"side ('{one}' and '{other}'): their returns, alike to the array and in opposite phase, cancel, and the "
        "filter may take what else it hears for other walls",
        f"lead the way at least {apart:.2g} m off the middle, where they are told apart",
    )  # fmt: skip


def single_returns(paths: Paths) -> Integers:
    """Columns (N,) of the paths that are single returns of walls, for warnings of these."""
    lone = (paths.landmark < 0) & (np.sum(paths.tx_walls >= 0, axis=1) + np.sum(paths.rx_walls >= 0, axis=1) == 1)
    return np.flatnonzero(lone & (paths.kind == PathKind.VT))


def _cancel(looked: Survey, cycle: int, single: Integers) -> Booleans:
    """Which pairs (N, N) of single returns, columns of the paths, are cancelled in a cycle: together they have less
    than `LEFT` of the energy that they have apart, over all antennas and the band."""
    paths, radio = looked.paths, looked.settings.radio
    cosines = (paths.arrival[cycle, single] @ rotation_z(looked.scene.agent.heading[cycle]))[:, :2]
    waves = paths.gain[cycle, single] * np.exp(2j * np.pi * radio.array.positions(1.0)[:, :2] @ cosines.T)
    energy = np.vecdot(waves.T, waves.T).real
    apart = energy[:, None] + energy
    alike = np.sinc(radio.bandwidth * np.subtract.outer(paths.tau[cycle, single], paths.tau[cycle, single]))
    return np.asarray(apart + 2.0 * alike * (waves.conj().T @ waves).real < LEFT * apart)
