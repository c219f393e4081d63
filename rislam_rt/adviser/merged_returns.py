"""Merged returns: single returns of walls that come in so near to others that the receiver cannot tell them apart.

Which components come out is the receiver's own model: by default the joint bound of all paths, in which paths are one
where their amplitudes cannot be shared out. Where most returns of walls have something else in them, delay and
direction of a component are those of no wall.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rislam_rt.adviser.link_budget import Survey
from rislam_rt.arrays import take_rows
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import ConfigError
from rislam_rt.input_messages import share_text
from rislam_rt.measurement import Received, build_sensor, receive
from rislam_rt.measurement.components import NoiselessComponents, merge, single
from rislam_rt.measurement.joint_bound import joint_errors
from rislam_rt.measurement.slot_motion import split_by_code
from rislam_rt.model import PathKind
from rislam_rt.pipeline.scores.audible_paths import audible_paths
from rislam_rt.pipeline.specification.pipeline_spec import Settings
from rislam_rt.scene.findings import Finding, warning_at

MOST = 0.5
"""Share of the walls' returns that must come in alone: with fewer, most of what is heard of walls is of several."""
WIDEST = 10
"""Times the bandwidth up to which one that parts the returns is looked for."""


def merged_return_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """Warning, one for a room, of merged returns: fewer than `MOST` of the walls' returns come in alone along the way;
    `file` is what it names as its place."""
    settings = looked.settings
    share = lone_share(looked, settings) if settings.slam.use_vt else 1.0
    if share >= MOST:
        return
    bandwidth = settings.radio.bandwidth
    message = (
        f"of the walls' returns loud enough to be heard along the way only {share_text(share)} come in alone; the "
        f"others cannot be told from what comes in beside them (1 / B is {SPEED_OF_LIGHT / bandwidth:.2g} m of path), "
        "and the filter takes several for one wall"
    )
    wider = _bandwidth_from_which(looked)
    mend = "take more antennas (radio.array.rows, radio.array.cols)"
    if wider:
        mend = f"give radio.bandwidth_ghz = {1e-9 * wider:.1g}, from which on most come in alone, or {mend}"
    yield warning_at(file, "radio.bandwidth_ghz", message, mend)


def lone_share(looked: Survey, settings: Settings) -> float:
    """Share of the audible single returns of walls, over all places surveyed, that come out as components of their own,
    with no other audible path merged in; one where there are none."""
    paths, radio, receiver = looked.paths, settings.radio, settings.receiver
    walls = np.sum(paths.tx_walls >= 0, axis=1) + np.sum(paths.rx_walls >= 0, axis=1)
    audible = audible_paths(paths, settings, use_vt=True) & (paths.kind == PathKind.VT) & (walls == 1)
    alone = 0
    for cycle, heading in enumerate(looked.scene.agent.heading):
        heard = split_by_code(receive(paths, cycle, float(heading), radio, receiver), receiver)[0]
        heard = take_rows(heard, radio.integrated_snr(heard.gain) >= settings.sensor.threshold)
        parts = _resolved(heard, settings, paths.num_paths)
        own = parts.gain == heard.gain[np.searchsorted(heard.path, parts.path)]  # nothing was added to the path's own
        alone += int(audible[cycle, parts.path[own]].sum())
    return alone / audible.sum() if audible.any() else 1.0


def _resolved(heard: Received, settings: Settings, num_paths: int) -> NoiselessComponents:
    """Components that the receiver of these settings resolves, of which some are merged."""
    sensor = build_sensor(settings.radio, settings.receiver)
    if sensor.resolution == "joint":
        return joint_errors(heard, settings.radio, settings.receiver, np.zeros((num_paths, 5)))[0]
    return merge(heard, sensor) if sensor.resolution == "cell" else single(heard)


def _bandwidth_from_which(looked: Survey) -> float:
    """Least bandwidth [Hz] of one digit, up to `WIDEST` times the one that was surveyed and twice the carrier, with
    which most of the merged returns come in alone; 0 if none does. More is taken to part more: it is bisected for."""
    radio = looked.settings.radio
    power = 10.0 ** np.floor(np.log10(radio.bandwidth))
    tried = [digit * power * times for times in (1, 10) for digit in range(1, 10)]
    tried = [one for one in tried if radio.bandwidth < one <= WIDEST * radio.bandwidth and one < 2.0 * radio.carrier]
    low, high = 0, len(tried)
    while low < high:
        middle = (low + high) // 2
        wider = looked.settings._replace(radio=replace(radio, bandwidth=tried[middle]))
        try:
            share = lone_share(looked, wider)
        except ConfigError:  # more tones than the receiver may have
            share = 0.0
        low, high = (low, middle) if share >= MOST else (middle + 1, high)
    return tried[low] if low < len(tried) else 0.0
