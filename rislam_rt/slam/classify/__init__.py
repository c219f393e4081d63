"""Classifiers that tell tracks of landmark paths from wall returns: a small network, its features, a baseline."""

from rislam_rt.slam.classify.geometric_classifier import classify_geometric
from rislam_rt.slam.classify.network import (
    Network,
    blend,
    classify,
    load_classifier,
    log_odds,
    network_arrays,
    read_network,
)
from rislam_rt.slam.classify.sighting_features import FEATURES, Sightings, fit_motion, track_features

__all__ = [
    "FEATURES", "Network", "Sightings", "blend", "classify", "classify_geometric", "fit_motion", "load_classifier",
    "log_odds", "network_arrays", "read_network", "track_features",
]  # fmt: skip
