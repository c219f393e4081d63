"""Wall returns told from landmark paths among the filter's own tracks, by the classifier that the settings name."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import Body, RadioConfig
from rislam_rt.slam.classify import (
    blend,
    classify_geometric,
    load_classifier,
    log_odds,
    sightings_of,
    track_features,
)
from rislam_rt.slam.nested.tracks import LandmarkTracks

LOOK_EVERY = 4
"""Cycles between looks; until its first one a track is judged by its amplitude."""


def classify_tracks(
    tracks: LandmarkTracks,
    position: Floats,
    heading: Floats,
    cycle: int,
    body: Body,
    radio: RadioConfig,
    classifier: str,
) -> LandmarkTracks:
    """Tracks with the classifier's odds; unchanged between its looks and by the rule `amplitude`.

    `position` (W, 3) [m] and `heading` (W,) [rad] of the agent as it believes, cycle k at row k % W.
    """
    if classifier == "amplitude" or cycle % LOOK_EVERY or not len(tracks.misses):
        return tracks
    shown = sightings_of(tracks.seen, tracks.std, tracks.cycle, tracks.level, position, heading, cycle)
    features = track_features(shown, body, radio)
    if classifier == "network":
        fresh = log_odds(features, load_classifier())
    else:
        keep = np.clip(classify_geometric(features), 1e-6, 1.0 - 1e-6)
        fresh = np.log(keep / (1.0 - keep))
    here = tracks.misses == 0
    odds = np.where(here, blend(tracks.odds, tracks.looks, fresh), tracks.odds)
    return tracks._replace(odds=odds, looks=tracks.looks + here)
