"""Cancelled returns: single returns of two walls that arrive together, are alike to the array, and cancel.

An array with antennas half a wavelength apart hears what comes along its line alike from both ends, but for a sign if
their number is even. In the middle between two walls it hears neither, as long as the agent keeps to the middle.
"""

from collections import Counter
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from rislam_rt.adviser.link_budget import Survey
from rislam_rt.adviser.remedies import SELDOM
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.input_messages import share_text
from rislam_rt.model import PathKind
from rislam_rt.pipeline.scores.audible_paths import audible_paths
from rislam_rt.scene.findings import Finding, warning_at

LEFT = 0.1
"""Share of their energy, apart, that two cancelled returns leave at most: 10 dB are lost."""


def cancelled_return_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """Warning, one for a room, of cancelled returns: at more than `SELDOM` of the places along the way audible single
    returns of two walls leave less than `LEFT` of their energy; `file` is what it names as its place."""
    if not looked.settings.slam.use_vt:
        return
    audible, pairs, places = audible_paths(looked.paths, looked.settings, use_vt=True), Counter[str](), set[int]()
    for cycle, heading in enumerate(looked.scene.agent.heading):
        single = [path for path in np.flatnonzero(audible[cycle]).tolist() if _wall(looked, path)]
        for one, other in combinations(single, 2):
            if _energy_left(looked, cycle, float(heading), [one, other]) < LEFT:
                pairs[f"'{_wall(looked, one)}' and '{_wall(looked, other)}'"] += 1
                places.add(cycle)
    if len(places) <= SELDOM * len(audible):
        return
    apart = 0.25 * SPEED_OF_LIGHT / looked.settings.radio.bandwidth
    yield warning_at(
        file, "agent.trajectory",
        f"at {share_text(len(places) / len(audible))} of the places along the way two walls are equally far on either "
        f"side ({pairs.most_common(1)[0][0]}): their returns, alike to the array but for the sign, cancel, and the "
        "filter may take what else it hears for other walls",
        f"lead the way at least {apart:.2g} m off the middle, where they are told apart",
    )  # fmt: skip


def _wall(looked: Survey, path: int) -> str:
    """Wall of a path that is a single return; empty for others, which are not asked whether they are cancelled."""
    kind, _, tx, rx = looked.paths.identity(path)
    return looked.paths.walls[(*tx, *rx)[0]] if kind == PathKind.VT and len(tx) + len(rx) == 1 else ""


def _energy_left(looked: Survey, cycle: int, heading: float, pair: list[int]) -> float:
    """Share of their energy that two returns, perhaps cancelled, have together: over all antennas and the band."""
    paths, radio = looked.paths, looked.settings.radio
    cosines = (paths.arrival[cycle, pair] @ rotation_z(np.array(heading)))[:, :2]
    waves = np.exp(2j * np.pi * radio.array.positions(1.0)[:, :2] @ cosines.T)
    together = np.sinc(radio.bandwidth * float(np.diff(paths.tau[cycle, pair])[0]))
    one, other = (paths.gain[cycle, path] * wave for path, wave in zip(pair, waves.T, strict=True))
    apart = np.vdot(one, one).real + np.vdot(other, other).real
    return float(1.0 + 2.0 * together * np.vdot(one, other).real / apart)
