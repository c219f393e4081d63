"""Gathering training examples of the classifier from walks: tracked components with their features and true classes."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, join_rows
from rislam_rt.channel.doppler import doppler_shift
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.measurement import ReceiverConfig, init_tracks, measure, step_tracks
from rislam_rt.model import PathKind, Paths, RadioConfig, Trajectory
from rislam_rt.slam.classify import FEATURES, Sightings, track_features

WINDOW = 40
"""Number of cycles of a track that its features are computed from, as in the filter's window."""
LOS_MARGIN = 0.1
"""Length [m] beyond the Tx-Rx baseline below which a component counts as the direct path (LOS), as in the filter."""
VELOCITY_STD = 0.01
"""Standard deviation [m/s] of the error of the agent's assumed velocity in each axis, constant over a walk."""
CLUTTER = -1
"""Value of `Examples.kind` for false components."""
OVER_RX, OVER_TX = 1, 2
"""Values of `Examples.legs`, added up: walls on the leg to the Rx, walls on the leg from the Tx."""


class Examples(NamedTuple):
    """Training examples of the classifier: N tracked components in single cycles with features and true classes."""

    features: Floats
    """(N, F) features of the track, 0 where `near`."""
    kind: Integers
    """(N,) true `PathKind`, or `CLUTTER`."""
    legs: Integers
    """(N,) legs with walls of a landmark's path: 0, `OVER_RX`, `OVER_TX`, or their sum."""
    age: Integers
    """(N,) number of the track's measurements within the window."""
    ratio: Floats
    """(N,) amplitude over that of a free-space path of the same length."""
    walk: Integers
    """(N,) number of the walk."""
    policy: Integers
    """(N,) code policy, an index into `POLICIES`; -1 without a panel. Tracks of other policies are other tracks."""
    track: Integers
    """(N,) label of the track within walk and policy, whose examples are in the order of time."""
    near: Booleans
    """(N,) whether the component is as short as the direct path: removed by its length, before it is classified."""

    @property
    def keep(self) -> Booleans:
        """Whether each example (N,) is a path over a landmark, which the classifier should keep."""
        return self.kind >= PathKind.PS

    @property
    def labelled(self) -> Booleans:
        """Whether each example (N,) is a path, not clutter."""
        return self.kind != CLUTTER


def gather_walk(
    paths: Paths, motion: Trajectory, radio: RadioConfig, receiver: ReceiverConfig, name: tuple[int, int], stride: int,
    *, rng: np.random.Generator
) -> Examples:  # fmt: skip
    """Training examples of one walk at every `stride`-th cycle: measure, track, compute features, label by truth.

    `name` holds the number of the walk and that of its code policy.
    """
    believed = motion.position + np.outer(motion.time, rng.standard_normal(3) * [VELOCITY_STD, VELOCITY_STD, 0.0])
    baseline = float(np.linalg.norm(motion.body.tx_offset - motion.body.rx_offset))
    state, memory = init_tracks(), _TrackHistory()
    shift, found = doppler_shift(paths, motion, radio.wavelength), []
    over = OVER_RX * np.any(paths.rx_walls >= 0, axis=1) + OVER_TX * np.any(paths.tx_walls >= 0, axis=1)
    over = np.where(paths.kind >= PathKind.PS, over, 0)
    for cycle in range(len(motion)):
        heading = float(motion.heading[cycle])
        measurement, truth = measure(paths, cycle, heading, radio, receiver, None, shift[cycle], rng=rng)
        dt = float(motion.time[cycle] - motion.time[cycle - 1]) if cycle else 0.0
        state, label = step_tracks(state, measurement, dt)
        length = SPEED_OF_LIGHT * measurement.tau
        std = np.column_stack([SPEED_OF_LIGHT * measurement.tau_std, measurement.cosines_std])
        rows = np.column_stack([length, measurement.cosines, std, np.log(measurement.amplitude)])
        memory.add(label, rows, cycle)
        far = length > baseline + LOS_MARGIN + 3.0 * np.minimum(std[:, 0], LOS_MARGIN)
        memory.forget(state.label)
        if cycle % stride == stride - 1 and len(length):
            # a cycle's walk through the window starts at a random phase, so that every age occurs
            sightings = memory.sightings(label[far], cycle, believed, motion.heading)
            features, age = np.zeros((len(length), len(FEATURES))), np.zeros(len(length), dtype=np.int64)
            if far.any():
                features[far], age[far] = track_features(sightings, motion.body, radio), sightings.held.sum(axis=1)
            spread = 4.0 * np.pi * length / (radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain))
            walk, policy = (np.full(len(length), number) for number in name)
            kind = np.where(truth.path >= 0, paths.kind[truth.path], CLUTTER)
            legs = np.where(truth.path >= 0, over[truth.path], 0)
            ratio = measurement.amplitude * spread  # a false component may have no length
            found.append(Examples(features, kind, legs, age, ratio, walk, policy, label, ~far))
    return join_rows(found)


class _TrackHistory:
    """Measurements of each track that is alive, by cycle, as the tracker itself keeps none."""

    def __init__(self) -> None:
        self.rows: dict[int, dict[int, Floats]] = {}

    def add(self, labels: Integers, rows: Floats, cycle: int) -> None:
        """Store one measurement of each labelled track in a cycle, for training examples."""
        for label, row in zip(labels.tolist(), rows, strict=True):
            self.rows.setdefault(label, {})[cycle] = row

    def forget(self, living: Integers) -> None:
        """Drop the measurements of all tracks but the `living`, for training examples."""
        alive = set(living.tolist())
        self.rows = {label: held for label, held in self.rows.items() if label in alive}

    def sightings(self, labels: Integers, cycle: int, position: Floats, heading: Floats) -> Sightings:
        """Measurements of the tracks with these labels in the window that ends at a cycle, with the agent's poses, for
        training examples."""
        first = max(0, cycle - WINDOW + 1)
        table = np.zeros((len(labels), cycle - first + 1, 7))
        table[..., 3:6] = 1.0
        held = np.zeros(table.shape[:2], dtype=np.bool_)
        for place, label in enumerate(labels.tolist()):
            for when, row in self.rows[label].items():
                if when >= first:
                    table[place, when - first], held[place, when - first] = row, True
        window = slice(first, cycle + 1)
        return Sightings(table[..., :3], table[..., 3:6], table[..., 6], held, position[window], heading[window])
