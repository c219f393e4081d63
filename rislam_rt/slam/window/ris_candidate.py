"""RIS candidates: tracks weighed as panels that the map does not hold yet, and the best one, at which the phase design
aims."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import PanelCandidate, RisCode
from rislam_rt.slam.arrival_rays import scatterer_positions
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import OTHER
from rislam_rt.slam.predicted_returns import Poses, reflect
from rislam_rt.slam.sampling import even_draws
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.landmarks.ris_identification import PanelObservation, gains, weigh
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.solver_limits import DRAWS
from rislam_rt.slam.window.tracks import WindowTracks

DISMISSAL = -2.0
"""Log odds of panel against scatterer below which a point or track is no RIS candidate: under one code they tell
little."""
DEEP = 0.5
"""Distance [m] behind a wall beyond which a track counts as a mirror image; the panel itself hangs on a wall."""
PATIENCE = 2
"""Cycles for which an undetected track remains a RIS candidate, if it was detected more often than that."""


def weigh_tracks(
    tracks: WindowTracks, cycle: int, poses: Poses, scene: KnownEnvironment, code: RisCode | None
) -> WindowTracks:
    """Update of RIS candidates: each track's odds of being a panel, were it a point heard over no wall, by this cycle's
    amplitude or missed detection under the phase code."""
    rows = (tracks.side != OTHER).nonzero()[0]
    if scene.ris is None or not len(rows):
        return tracks
    spread = np.sqrt(tracks.covariance[rows][..., 0, 0])
    looks = tracks.mean[rows, None, :, 0] + even_draws(DRAWS, 3) * spread[:, None]
    place, _ = scatterer_positions(looks, poses)
    count = len(rows)
    sight = PanelObservation(
        place, poses.tx[None].repeat(count, axis=0), poses.rx[None].repeat(count, axis=0), np.ones(count),
        np.exp(tracks.log_amplitude[rows]), tracks.side[rows], tracks.last[rows] == cycle,
    )  # fmt: skip
    gain = gains(sight, scene.ris, code, scene.radio)
    fresh = weigh(tracks.identity.take(rows), sight, gain, scene.sensor).clipped()
    return tracks._replace(**tracks.identity.put(rows, fresh)._asdict())


def find_candidate(
    tracks: WindowTracks, landmarks: WindowTable, mean: Floats, cycle: int, poses: Poses, panel: int = 0
) -> PanelCandidate | None:
    """Point or track that is the likeliest to be RIS panel number `panel`, or None if none is likely enough
    (`DISMISSAL`).

    A track that seems to come from behind a wall may be the panel over that wall, or the wall ends before: the panel
    is there as rarely as any new feature behind a wall that is heard (`hypothesis_evidence.log_opacity`).
    """
    features, walls = mean[HEAD:].reshape(-1, 3), landmarks.walls
    points = landmarks.points[~np.isin(landmarks.points, landmarks.panels)]  # what is another panel is not this one
    patience = np.where(tracks.hits > 3, np.inf, np.minimum(tracks.hits - 1, PATIENCE))
    least = np.where(tracks.hits > 1, DISMISSAL, 0.0)
    few = np.log(CONSTANTS.panels)  # the design asks what was measured, not how many panels there are
    told = tracks.log_ris[:, panel] - few
    rows = ((tracks.side != OTHER) & (cycle - tracks.last <= patience) & (told > least)).nonzero()[0]
    places, _ = scatterer_positions(tracks.mean[rows, :, 0], poses)
    out = features[walls] - mean[:3]
    image = reflect(np.broadcast_to(mean[:3], out.shape), features[walls], landmarks.anchor[walls])
    gap = np.linalg.norm(places[:, None] - image, axis=-1) - np.linalg.norm(places - mean[:3], axis=1)[:, None]
    behind = (gap < -DEEP).sum(axis=1)
    places = np.concatenate([features[points], places])
    hits = np.append(landmarks.hits[points], tracks.hits[rows])
    odds = np.append(landmarks.log_ris[points, panel] - few, told[rows] + CONSTANTS.log_rare * behind)
    # one measurement may be a false alarm: it has no images, and is none
    odds += log_images(np.linalg.norm(places - mean[:3], axis=1), np.where(hits > 1, odds, -np.inf))
    if not len(odds) or odds.max() <= DISMISSAL:
        return None
    best = int(np.argmax(odds))
    return PanelCandidate(places[best], int(hits[best]), panel)


def log_images(reach: Floats, log_odds: Floats) -> Floats:
    """Gain (N,) in the log odds of N panel candidates at distances `reach` (N,) [m] with `log_odds` (N,): those farther
    off may be images of it in walls, as paths over a panel and a wall are longer than that over the panel."""
    image = np.logaddexp(0.0, 2.0 * CONSTANTS.wall_ratio + log_odds)
    return np.where(np.isfinite(log_odds), (image * (reach > reach[:, None])).sum(axis=1), 0.0)
