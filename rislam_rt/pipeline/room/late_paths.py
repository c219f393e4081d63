"""Late paths of a room: heard paths that come in beyond the receiver's window of delays, or a direct path that a clock
brings in outside of it, and the setting that mends it.

No measurement tells of them: what the window cuts off is not reported, and what is later than the period of the
sounding is reported as if it were shorter.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.input_messages import share_text
from rislam_rt.measurement import ReceiverConfig
from rislam_rt.measurement.config import EARLIEST, MOST_TONES
from rislam_rt.measurement.received_signal import SPARE, num_tones
from rislam_rt.model import PathKind, Paths, RadioConfig
from rislam_rt.pipeline.assumed_model import clock_lateness
from rislam_rt.pipeline.scores.audible_paths import audible_paths
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, Settings
from rislam_rt.scene.findings import Finding, warning_at

STEP = 1e-8
"""[s] To a multiple of which the proposed delay is rounded up: 3 m of path, more than a way goes between two places."""
SELDOM = 0.05
"""Largest share of the loud paths that may be late without a warning."""
MOST_NAMES = 4
"""Largest number of walls that a warning names."""


def late_path_warnings(paths: Paths, settings: Settings, file: str) -> Iterator[Finding]:
    """Warning, one for a room, of late paths: more than `SELDOM` of those loud enough to be heard along the way come in
    after `receiver.max_delay`; `file` is what it names as its place."""
    sensor = replace(settings.sensor, window=(settings.sensor.window[0], np.inf))
    loud = audible_paths(paths, settings._replace(sensor=sensor), use_vt=settings.slam.use_vt)
    late = loud & (paths.tau > settings.receiver.max_delay)
    if late.sum() <= SELDOM * loud.sum():
        return
    end, latest = settings.receiver.max_delay, float(paths.tau[loud].max())
    message = (
        f"{share_text(late.sum() / loud.sum())} of the paths loud enough to be heard come in after {1e9 * end:g} ns "
        f"({SPEED_OF_LIGHT * end:.3g} m of path), the latest after {1e9 * latest:.0f} ns, and are not reported"
    )
    if settings.receiver.estimator == "waveform" and latest > sensor.period:
        message += f", or, after {1e9 * sensor.period:.0f} ns, as if they were shorter"
    walls = _walls(paths, late)
    if walls:
        message += f"; returns of {', '.join(walls[:MOST_NAMES])}{' and more' if len(walls) > MOST_NAMES else ''} are "
        message += "among them"
    yield warning_at(file, "receiver.max_delay", message, _mend(settings.radio, settings.receiver, latest))


def direct_path_warnings(paths: Paths, time: Floats, spec: PipelineSpec, file: str) -> Iterator[Finding]:
    """Warning, one for a run of cycles at `time` (K,) [s], of a direct path that the told error of the clocks brings in
    before the late paths' window begins, or after it ends: from there on nobody can tell how far they are apart."""
    direct, late = paths.valid & (paths.kind == PathKind.LOS), clock_lateness(time, spec.told)
    if not late.any() or not direct.any():
        return
    rows, (begin, end) = direct.any(axis=1), (spec.receiver.min_delay, spec.receiver.max_delay)
    when, arrival = time[rows] - time[0], np.where(direct, paths.tau, np.inf).min(axis=1)[rows] + late[rows]
    message = (
        "s on the direct path comes in {} {:g} ns, as [told] has the clocks of Tx and Rx run: the receiver does not "
    )
    message += "hear it there, and no estimator can count lengths from it"
    if arrival.min() < begin:
        first, delay = when[np.argmax(arrival < begin)], STEP * float(np.floor(arrival.min() / STEP))
        mend = f"give receiver.min_delay = {delay:.9g}" if delay >= EARLIEST else "tell clocks less far apart"
        yield warning_at(file, "receiver.min_delay", f"from {first:.3g} {message.format('before', 1e9 * begin)}", mend)
    if arrival.max() > end:
        first, delay = when[np.argmax(arrival > end)], STEP * float(np.ceil(arrival.max() / STEP))
        more = f"give receiver.max_delay = {delay + end - max(begin, 0.0):.9g}, or tell clocks less far apart"
        yield warning_at(file, "receiver.max_delay", f"from {first:.3g} {message.format('after', 1e9 * end)}", more)


def _walls(paths: Paths, late: Booleans) -> list[str]:
    """Walls whose own returns, over no other wall, are late paths, those first for which that is so at most places."""
    places: Counter[str] = Counter()
    for path in np.flatnonzero(late.any(axis=0)):
        kind, _, tx, rx = paths.identity(int(path))
        if kind == PathKind.VT and len(tx) + len(rx) == 1:
            places[f"'{paths.walls[(*tx, *rx)[0]]}'"] += int(late[:, path].sum())
    return [wall for wall, _ in places.most_common()]


def _mend(radio: RadioConfig, receiver: ReceiverConfig, latest: float) -> str:
    """Setting under which late paths, up to the `latest` [s], are heard, and what it costs."""
    delay = STEP * float(np.ceil(latest / STEP))
    if receiver.estimator == "bound":
        return f"give receiver.max_delay = {delay:.9g}"
    if SPARE * radio.bandwidth * delay > MOST_TONES:
        return "lead the way nearer to what is far, or take less bandwidth: no sounding has a tone for each such delay"
    told, count = f"give receiver.max_delay = {delay:.9g}", receiver.num_subcarriers
    if count and count < SPARE * radio.bandwidth * delay:
        told += " and receiver.num_subcarriers = 0"
        count = 0
    before, after = (
        num_tones(radio, one) for one in (receiver, replace(receiver, max_delay=delay, num_subcarriers=count))
    )
    tones = f"{after} tones" if after == before else f"{after} tones in place of {before}"
    cost = f"{tones}, a sounding that repeats after {1e9 * after / radio.bandwidth:.0f} ns, "
    more = (delay - receiver.min_delay) / (receiver.max_delay - receiver.min_delay)
    return f"{told} (it costs {cost}{more:.2g} times as many false components, and time)"
