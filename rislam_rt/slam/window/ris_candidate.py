"""RIS candidates: tracks weighed as panels that the map does not hold yet, and the best one, at which the phase design
aims."""

import numpy as np
import scipy

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import DataSheet, PanelCandidate, RisCode, SensorModel
from rislam_rt.slam.arrival_rays import scatterer_positions
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD, Observations
from rislam_rt.slam.predicted_returns import Poses, reflect
from rislam_rt.slam.sampling import even_draws
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.landmarks.ris_identification import PanelObservation, gains, log_silence, weigh
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.solver_limits import CERTAIN, DRAWS
from rislam_rt.slam.window.tracks import WindowTracks, share

DEEP = 0.5
"""Distance [m] behind a wall beyond which a track counts as a mirror image; the panel itself hangs on a wall."""


def false_density(observed: Observations, scene: KnownEnvironment) -> tuple[Floats, Floats]:
    """Density (M,) of components as loud as each of those observed that are no RIS candidate, per metre, unit of each
    cosine and e-fold of amplitude, and the log odds (M,) that each is one, seen for the first time.

    That a code lights the panel is as rare as anything (`rare`, once in a sweep), and so is what else a receiver may
    report; noise is as frequent as it is told, and where panels are told apart there is as much for each of them.
    """
    sensor, sides = scene.sensor, np.where(observed.sides == UNTOLD, 1, scene.num_panels + 1)
    snr = np.maximum(sensor.radio.integrated_snr(np.exp(observed.log_amplitude)), sensor.threshold)
    noise = sensor.false_alarms / sides * 2.0 * snr * sensor.false_alarm_snr_density(snr)
    other, room = CONSTANTS.rare + noise, np.pi * SPEED_OF_LIGHT * (sensor.window[1] - sensor.window[0])
    return np.maximum(other / room, 1e-300), np.log(CONSTANTS.rare / other)


def weigh_tracks(
    tracks: WindowTracks, cycle: int, poses: Poses, scene: KnownEnvironment, codes: tuple[RisCode | None, ...]
) -> WindowTracks:
    """Update of RIS candidates by this cycle's amplitude or missed detection under the phase codes (K,) up to now: each
    track's odds of being a panel, were it a point heard over no wall, of being real, of being over no wall, and of
    being a leak.

    The direct path over a panel is lit by what sends its place's direction back. A path over panel and walls is known
    to be lit by the code that lit it alone, and by others as far as they are like that. A leak is heard under any code,
    as often as it was before: what lights the panel tells nothing of it.
    """
    code, rows = codes[-1], (tracks.side != OTHER).nonzero()[0]
    if scene.ris is None or not len(rows):
        return tracks
    count = len(rows)
    sight = PanelObservation(
        _places(tracks, rows, poses), poses.tx[None].repeat(count, axis=0), poses.rx[None].repeat(count, axis=0),
        np.ones(count), np.exp(tracks.log_amplitude[rows]), tracks.side[rows], tracks.last[rows] == cycle,
    )  # fmt: skip
    gain, before = gains(sight, scene.ris, code, scene.radio), tracks.identity.take(rows)
    fresh = weigh(before, sight, gain, scene.sensor)
    after = tracks._replace(**tracks.identity.put(rows, fresh.clipped())._asdict())
    if gain is None or code is None:
        return after
    real, direct, leak = tracks.log_real.copy(), tracks.log_direct.copy(), tracks.log_leak.copy()
    may_be = (sight.side[:, None] == PANEL + np.arange(scene.num_panels)) | (sight.side[:, None] == UNTOLD)
    ago, inverse = np.unique(cycle - np.where(sight.seen, tracks.earlier[rows], tracks.last[rows]), return_inverse=True)
    then = np.where(sight.seen, tracks.earlier_log_amplitude[rows], tracks.log_amplitude[rows])[:, None]
    before_now = [_code_then(codes, int(each)) for each in ago]
    known = np.array([each is not None for each in before_now])[inverse]
    likeness = np.stack([_likeness(code, each, scene.ris) for each in before_now])[inverse]
    often = share(tracks._replace(hits=tracks.hits - (tracks.last == cycle)), cycle)[rows, None]
    always = np.maximum(often * _again(then, scene.sensor), CONSTANTS.rare)
    again = np.maximum(_again(then + np.log(np.maximum(likeness, 1e-9)), scene.sensor), CONSTANTS.rare)
    lit = np.maximum(-np.expm1(log_silence(gain, before.hidden, scene.sensor)), again)
    for odds, one, other in ((direct, lit, again), (leak, always, np.maximum(often * lit, CONSTANTS.rare))):
        tells = np.where(sight.seen[:, None], np.log(one / other), np.log1p(-one) - np.log1p(-other))
        odds[rows] = np.clip(odds[rows] + np.where(known[:, None], tells, 0.0), -CERTAIN, CERTAIN)
    real[rows] += np.where(sight.seen, 0.0, np.log1p(-np.where(may_be, again, 1.0).min(axis=1)))
    return after._replace(log_real=real, log_direct=direct, log_leak=leak)


def _places(tracks: WindowTracks, rows: Integers, poses: Poses) -> Floats:
    """Equally likely samples (R, S, 3) of the places of RIS candidates in `rows` (R,) of the tracks."""
    spread = np.sqrt(tracks.covariance[rows][..., 0, 0])
    return scatterer_positions(tracks.mean[rows, None, :, 0] + even_draws(DRAWS, 3) * spread[:, None], poses)[0]


def _code_then(codes: tuple[RisCode | None, ...], since: int) -> RisCode | None:
    """Code of the cycle so long ago that a RIS candidate was last heard in; None before the window."""
    return codes[-1 - since] if since < len(codes) else None


def _likeness(one: RisCode, other: RisCode | None, ris: DataSheet) -> Floats:
    """How much of the amplitude (Q,) of a path over each panel that a code sends one way another one does; 0 where that
    is not known."""
    if other is None:
        return np.zeros(len(ris.panels))
    pairs = zip(ris.parts(one), ris.parts(other), strict=True)
    return np.abs([np.exp(2j * np.pi / one.levels * (a.index - b.index)).mean() for a, b in pairs])


def _again(log_amplitude: Floats, sensor: SensorModel) -> Floats:
    """Probability (...,) that RIS candidates of log amplitudes (...,) are heard again."""
    return CONSTANTS.shown * sensor.detection_probability(sensor.radio.integrated_snr(np.exp(log_amplitude)))


def find_candidate(
    tracks: WindowTracks, landmarks: WindowTable, mean: Floats, cycle: int, poses: Poses,
    codes: tuple[RisCode | None, ...], sensor: SensorModel, panel: int = 0,
) -> PanelCandidate | None:  # fmt: skip
    """Point or track that is the likeliest to be RIS panel number `panel`, or None if there is none.

    A track has to be real, over the panel, over no wall besides, and no leak. One that seems to come from behind a wall
    may be the panel over that wall, or the wall ends before. What is told to be over the panel counts there by the
    share of power that a wall leaves (`wall_ratio`), what is not by how rare any new feature behind a wall that is
    heard is (`hypothesis_evidence.log_opacity`).
    """
    features, walls = mean[HEAD:].reshape(-1, 3), landmarks.walls
    points = landmarks.points[~np.isin(landmarks.points, landmarks.panels)]  # what is another panel is not this one
    rows = np.isin(tracks.side, (UNTOLD, PANEL + panel)).nonzero()[0]
    samples = _places(tracks, rows, poses)
    places, _ = scatterer_positions(tracks.mean[rows, :, 0], poses)
    out = features[walls] - mean[:3]
    image = reflect(np.broadcast_to(mean[:3], out.shape), features[walls], landmarks.anchor[walls])
    gap = np.linalg.norm(places[:, None] - image, axis=-1) - np.linalg.norm(places - mean[:3], axis=1)[:, None]
    behind = (gap < -DEEP).sum(axis=1)
    places = np.concatenate([features[points], places])
    over_panel = _against_all(np.concatenate([landmarks.log_ris[points], tracks.log_ris[rows]]), panel)
    direct = np.append(np.full(len(points), CERTAIN), tracks.log_direct[rows, panel])
    told = np.append(np.zeros(len(points), dtype=np.bool_), tracks.side[rows] == PANEL + panel)
    leak = np.where(told, np.append(np.zeros(len(points)), tracks.log_leak[rows, panel]), -np.inf)
    is_panel = -np.logaddexp.reduce([-over_panel, -direct, leak])
    in_front = np.where(told, 2.0 * CONSTANTS.wall_ratio, CONSTANTS.log_rare)[len(points) :]
    is_panel[len(points) :] += behind * in_front
    real = np.append(np.full(len(points), CERTAIN), tracks.log_real[rows])
    if not len(real):
        return None
    hidden = tracks.hidden[rows, panel]
    clear = np.append(np.ones(len(points)), CONSTANTS.cleared * hidden + (1.0 - CONSTANTS.rare) * (1.0 - hidden))
    best = int(np.argmax(_log_both(is_panel, real) + np.log(clear)))
    again, code, asked = 0.0, None, True
    samples = np.concatenate([np.repeat(features[points][:, None], DRAWS, axis=1), samples])
    if best >= len(points):
        row = rows[best - len(points)]
        asked = bool(0 < tracks.looked[row] <= tracks.hits[row])
        code = _code_then(codes, int(cycle - tracks.last[row]))
        again = float(_again(tracks.log_amplitude[row], sensor))
    one, other = float(scipy.special.expit(real[best])), float(scipy.special.expit(is_panel[best]))
    return PanelCandidate(
        places[best], samples[best], one, other, again, code, bool(told[best]), asked, panel, float(clear[best])
    )  # fmt: skip


def _against_all(log_ris: Floats, panel: int) -> Floats:
    """Log odds (N,) that RIS candidates are one panel, against all else, from those (N, Q) of each panel against
    scatterer."""
    others = np.delete(log_ris, panel, axis=1)
    return np.asarray(log_ris[:, panel] - np.logaddexp.reduce(others, axis=1, initial=0.0))


def _log_both(one: Floats, other: Floats) -> Floats:
    """Log odds (N,) that a RIS candidate is both of two things, from the log odds (N,) of each."""
    return one + other - np.logaddexp(0.0, np.logaddexp(one, other))
