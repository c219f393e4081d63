"""Gathering labelled tracks from walks: what the receiver reports, tracked as the agent would, and what each was."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.doppler import doppler_shift
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.measurement import ReceiverConfig, TrackingConfig, init_tracks, measure, step_tracks
from rislam_rt.model import PathKind, Paths, RadioConfig, Trajectory
from rislam_rt.slam.classify import FEATURES, Sightings, track_features

WINDOW = 40
"""Cycles that a track is judged by, as many as the filter keeps."""
LOS_MARGIN = 0.1
"""Length [m] beyond the baseline below which a component is the direct path, as in the filter."""
VELOCITY_STD = 0.01
"""Error [m/s] of the agent's own velocity in each axis, constant over a walk."""
CLUTTER = -1
"""In `Examples.kind`."""
OVER_RX, OVER_TX = 1, 2
"""In `Examples.legs`, added up: walls between landmark and Rx, walls between Tx and landmark."""


class Examples(NamedTuple):
    """N components of tracks, one row a component and cycle."""

    features: Floats
    """(N, F), 0 where `near`."""
    kind: Integers
    """(N,) `PathKind`, or `CLUTTER`."""
    legs: Integers
    """(N,) over walls on which legs a landmark's path ran: 0, `OVER_RX`, `OVER_TX`, or both together."""
    age: Integers
    """(N,) measurements of its track within the window."""
    ratio: Floats
    """(N,) amplitude over that of free space of the same length."""
    walk: Integers
    """(N,) number of the walk."""
    policy: Integers
    """(N,) index into `POLICIES`, -1 without a panel: the same walk under other codes is another one to a track."""
    track: Integers
    """(N,) label of its track within walk and policy, whose examples are in the order of time."""
    near: Booleans
    """(N,) as short as the direct path is: removed by its length, before any rule looks."""

    @property
    def keep(self) -> Booleans:
        """(N,) whether a gathered example came over a landmark."""
        return self.kind >= PathKind.PS

    @property
    def labelled(self) -> Booleans:
        """(N,) whether a gathered example was a path, and not clutter."""
        return self.kind != CLUTTER

    def pick(self, rows: Booleans | Integers) -> "Examples":
        """Some of the gathered examples."""
        return Examples._make(field[rows] for field in self)


def join(parts: list[Examples]) -> Examples:
    """Several sets of gathered examples as one."""
    return Examples._make(np.concatenate(fields) for fields in zip(*parts, strict=True))


def gather_walk(
    paths: Paths, motion: Trajectory, radio: RadioConfig, receiver: ReceiverConfig, name: tuple[int, int], stride: int,
    *, rng: np.random.Generator
) -> Examples:  # fmt: skip
    """Examples of one walk, every `stride`-th cycle of it; `name` is its number and that of its policy."""
    believed = motion.position + np.outer(motion.time, rng.standard_normal(3) * [VELOCITY_STD, VELOCITY_STD, 0.0])
    baseline = float(np.linalg.norm(motion.body.tx_offset - motion.body.rx_offset))
    state, config, memory = init_tracks(), TrackingConfig(), _Memory()
    shift, found = doppler_shift(paths, motion, radio.wavelength), []
    for cycle in range(len(motion)):
        heard = measure(paths, cycle, float(motion.heading[cycle]), radio, receiver, None, shift[cycle], rng=rng)
        measurement, truth = heard
        dt = float(motion.time[cycle] - motion.time[cycle - 1]) if cycle else 0.0
        state, info = step_tracks(state, measurement, dt, config)
        length = SPEED_OF_LIGHT * measurement.tau
        std = np.column_stack([SPEED_OF_LIGHT * measurement.tau_std, measurement.cosines_std])
        rows = np.column_stack([length, measurement.cosines, std, np.log(measurement.amplitude)])
        memory.add(info.label, rows, cycle)
        far = length > baseline + LOS_MARGIN + 3.0 * np.minimum(std[:, 0], LOS_MARGIN)
        memory.forget(state.label)
        if cycle % stride == stride - 1 and len(length):
            # a cycle's walk through the window starts at a random phase, so that every age occurs
            sightings = memory.sightings(info.label[far], cycle, believed, motion.heading)
            features, age = np.zeros((len(length), len(FEATURES))), np.zeros(len(length), dtype=np.int64)
            if far.any():
                features[far], age[far] = track_features(sightings, motion.body, radio), sightings.held.sum(axis=1)
            spread = 4.0 * np.pi * length / (radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain))
            walk, policy = (np.full(len(length), number) for number in name)
            kind, legs = _classes(paths, truth.path)
            ratio = measurement.amplitude * spread  # a false component may have no length
            found.append(Examples(features, kind, legs, age, ratio, walk, policy, info.label, ~far))
    return join(found)


def _classes(paths: Paths, column: Integers) -> tuple[Integers, Integers]:
    """`Examples.kind` and `.legs` of gathered components that are these columns of the paths, -1 for clutter."""
    over = OVER_RX * np.any(paths.rx_walls >= 0, axis=1) + OVER_TX * np.any(paths.tx_walls >= 0, axis=1)
    over = np.where(paths.kind >= PathKind.PS, over, 0)
    true = column >= 0
    return np.where(true, paths.kind[column], CLUTTER), np.where(true, over[column], 0)


class _Memory:
    """The last measurements of each living label: the tracker itself keeps none."""

    def __init__(self) -> None:
        self.rows: dict[int, dict[int, Floats]] = {}

    def add(self, labels: Integers, rows: Floats, cycle: int) -> None:
        for label, row in zip(labels.tolist(), rows, strict=True):
            self.rows.setdefault(label, {})[cycle] = row

    def forget(self, living: Integers) -> None:
        alive = set(living.tolist())
        self.rows = {label: held for label, held in self.rows.items() if label in alive}

    def sightings(self, labels: Integers, cycle: int, position: Floats, heading: Floats) -> Sightings:
        """What the labels of gathered tracks have shown in the window that ends at a cycle."""
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
