"""Labels over birth, death, gaps and crossings, on motions made by hand."""

from typing import NamedTuple

import numpy as np
import pytest

from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.measurement import init_tracks, step_tracks
from rislam_rt.measurement.tracking import CONFIRM_HITS, MAX_MISSES
from rislam_rt.model import Measurement


class Labels(NamedTuple):
    label: np.ndarray
    confirmed: np.ndarray


def components(lengths, cosines, amplitudes, rng, std=(0.01, 0.005)):
    """Components about given lengths [m] and cosines, with errors of these standard deviations."""
    lengths, cosines = np.asarray(lengths, dtype=float), np.asarray(cosines, dtype=float).reshape(-1, 2)
    count = len(lengths)
    return Measurement(
        (lengths + std[0] * rng.standard_normal(count)) / SPEED_OF_LIGHT,
        cosines + std[1] * rng.standard_normal((count, 2)),
        np.asarray(amplitudes, dtype=float) * np.exp(0.05 * rng.standard_normal(count)),
        np.full(count, std[0] / SPEED_OF_LIGHT),
        np.full((count, 2), std[1]),
        np.full(count, 1e-7),
    )


def track(cycles, dt=0.1):
    """State after a list of measurements; of each its labels, and whether their tracks are confirmed."""
    state, out = init_tracks(), []
    for measurement in cycles:
        state, label = step_tracks(state, measurement, dt)
        out.append(Labels(label, np.isin(label, state.label[state.hits >= CONFIRM_HITS])))
    return state, out


def test_moving_paths_keep_their_labels():
    rng = np.random.default_rng(1)
    time = 0.1 * np.arange(100)
    cycles = [
        components([5.0 + 0.1 * t, 5.2 - 0.1 * t], [[0.01 * t, 0.2], [0.5, -0.02 * t]], [1e-5, 1e-5], rng) for t in time
    ]
    _, info = track(cycles)
    labels = np.array([i.label for i in info])
    assert set(map(tuple, labels)) == {tuple(labels[0])}
    assert not info[1].confirmed.any()
    assert info[2].confirmed.all()


@pytest.mark.parametrize("loudness", [1e-5, 1e-4])
def test_labels_survive_a_crossing_in_delay_and_angle(loudness):
    """Both pass through the same length and cosines at once; rates, or loudness, tell them apart afterwards."""
    rng = np.random.default_rng(2)
    time = 0.1 * np.arange(-60, 61)
    cycles = [
        components([5.0 + 0.1 * t, 5.0 - 0.1 * t], [[0.03 * t, 0.2], [-0.03 * t, 0.2]], [1e-5, loudness], rng)
        for t in time
    ]
    _, info = track(cycles)
    assert info[-1].label.tolist() == info[0].label.tolist()


def test_death_birth_and_gaps():
    rng = np.random.default_rng(3)

    def cycle(present):
        return components(
            [5.0, 8.0][: 1 + present], [[0.1, 0.2], [0.4, -0.3]][: 1 + present], [1e-5, 2e-5][: 1 + present], rng
        )

    short, long = MAX_MISSES - 1, MAX_MISSES + 2
    state, info = track([cycle(True)] * 10 + [cycle(False)] * short + [cycle(True)] * 5)
    assert info[-1].label.tolist() == info[0].label.tolist()
    state, info = track([cycle(True)] * 10 + [cycle(False)] * long + [cycle(True)] * 5)
    assert info[-1].label[0] == info[0].label[0]
    assert info[-1].label[1] > info[0].label[1]
    assert state.next_label == 3
    assert len(state.label) == 2


def test_clutter_never_becomes_a_path():
    rng = np.random.default_rng(4)
    cycles = [
        components([5.0, rng.uniform(1.0, 20.0)], [[0.1, 0.2], rng.uniform(-0.6, 0.6, 2)], [1e-5, 3e-6], rng)
        for _ in range(100)
    ]
    state, info = track(cycles)
    assert all(i.label[0] == 0 for i in info)
    assert np.mean([i.confirmed[1] for i in info]) < 0.02
    assert len(state.label) <= 3


def test_empty_cycles_are_cycles():
    rng = np.random.default_rng(5)
    state, info = track(
        [components([], [], [], rng), components([3.0], [[0.0, 0.0]], [1e-5], rng), components([], [], [], rng)]
    )
    assert [len(i.label) for i in info] == [0, 1, 0]
    assert len(state.label) == 0
