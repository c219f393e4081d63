"""Removal of wall returns, as in the paper: tracks that a classifier takes for wall returns become no landmark."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.model import Body, RadioConfig
from rislam_rt.slam.classify import Sightings, classify, classify_geometric, load_classifier, track_features
from rislam_rt.slam.nested_config import NestedConfig
from rislam_rt.slam.observations import PANEL, free_space
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.tracks import WindowTracks


def wall_returns(
    tracks: WindowTracks, log: Log, cycle: int, poses: Floats, body: Body, radio: RadioConfig, config: NestedConfig
) -> Booleans:
    """Whether each track (T,) is a wall return, by the classifier, from K estimated poses (K, 4) [m, rad].

    What the receiver says ran over the panel is none, however it looks to a classifier.
    """
    count, window = len(tracks.ident), len(poses)
    if not count:
        return np.zeros(0, dtype=np.bool_)
    row = np.minimum(np.searchsorted(tracks.ident, log.track), count - 1)
    at = (tracks.ident[row] == log.track).nonzero()[0]
    row, slot = row[at], log.cycle[at] - (cycle - window + 1)
    if config.classifier == "amplitude":
        ratio = log.log_amplitude[at] + np.log(np.maximum(log.seen[at, 0], 1e-3)) - free_space(radio)
        bright = np.bincount(row, ratio > np.log(config.specular_ratio), count)
        found = bright > 0.5 * np.bincount(row, minlength=count)
    else:
        seen, std, level = np.zeros((count, window, 3)), np.ones((count, window, 3)), np.zeros((count, window))
        held = np.zeros((count, window), dtype=np.bool_)
        seen[row, slot], std[row, slot], level[row, slot] = log.seen[at], log.std[at], log.log_amplitude[at]
        held[row, slot] = True
        features = track_features(Sightings(seen, std, level, held, poses[:, :3], poses[:, 3]), body, radio)
        network = config.classifier == "network"
        found = (classify(features, load_classifier()) if network else classify_geometric(features)) < 0.5
    return np.asarray(found & (tracks.side < PANEL))
