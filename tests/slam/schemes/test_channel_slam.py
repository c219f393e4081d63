"""Channel-SLAM: how ranges are labelled, and what a virtual transmitter does with them."""

import numpy as np
from rooms import BODY, CYCLE, HEADING, RADIO, build_room, measurement_of

from rislam_rt.model import SensorModel
from rislam_rt.slam.schemes import channel_slam
from rislam_rt.slam.schemes.channel_slam import ChannelSlamConfig
from rislam_rt.slam.schemes.channel_slam.tracker import advance, assign, follow, no_tracks

CONFIG = ChannelSlamConfig()


def walk(lengths: list[np.ndarray], config: ChannelSlamConfig, ratio: float = 0.05) -> channel_slam.ChannelSlamState:
    rng = np.random.default_rng(1)
    state = channel_slam.init(build_room(1, 1).start, BODY, None, SensorModel(RADIO), config, rng=rng)
    for cycle, length in enumerate(lengths):
        dt = CYCLE if cycle else 0.0
        state, _ = channel_slam.step(state, measurement_of(length, ratio), None, dt, HEADING, config, rng=rng)
    return state


def test_a_transmitter_is_born_with_the_last_range_that_confirms_it_and_ends_with_its_path() -> None:
    """None before `confirm_hits` ranges; gone as `max_misses` are exceeded; a path of another length is another one."""
    seen = [np.array([4.0])] * CONFIG.confirm_hits
    assert len(walk(seen[1:], CONFIG).sums.ident) == 0
    assert len(walk(seen, CONFIG).sums.ident) == 1
    none = [np.zeros(0)] * CONFIG.max_misses
    assert len(walk(seen + none, CONFIG).sums.ident) == 1
    assert len(walk(seen + none + none[:1], CONFIG).sums.ident) == 0
    assert len(walk([*seen, np.array([6.0])], CONFIG).sums.ident) == 1


def test_no_more_transmitters_than_allowed() -> None:
    """Five paths and room for three: those confirmed first, by label."""
    config = ChannelSlamConfig(max_paths=3)
    state = walk([np.array([3.0, 4.0, 5.0, 6.0, 7.0])] * 8, config)
    assert np.array_equal(state.sums.ident, [0, 1, 2])


def test_strong_paths_are_walls_or_set_aside() -> None:
    """As strong as a wall return: kinds of a wall with `planes`, nothing at all without."""
    seen = [np.array([4.0])] * CONFIG.confirm_hits
    assert set(walk(seen, CONFIG, ratio=0.85).sums.kind.tolist()) == {0, 1, 2}
    assert set(walk(seen, CONFIG).sums.kind.tolist()) == {0, 2}
    assert len(walk(seen, ChannelSlamConfig(planes=False), ratio=0.85).sums.ident) == 0


def test_a_path_that_fits_no_transmitter_starts_anew() -> None:
    """A length that stands, then runs at a speed that the label follows and no point can have: the sum is replaced.

    The rate grows by 0.03 m/s a cycle up to 0.6 m/s, three times twice the agent's speed.
    """
    config = ChannelSlamConfig(wanderers=0.0, gate=50.0, range_acceleration=1.0)
    rate = np.concatenate([np.zeros(20), np.minimum(0.03 * np.arange(40), 0.6)])
    length = 4.0 + CYCLE * np.cumsum(rate)
    state = walk([np.array([each]) for each in length], config)
    assert len(state.sums.ident) <= 1
    assert state.strains.get(0, 1.0) <= config.strain_limit
    born = np.linalg.norm(state.sums.base[:, :2] - build_room(1, 1).start.position[:2], axis=1)
    # the first base lies less than 0.05 m from the start, where five cycles lead
    assert np.all(born > 0.1)


def test_labels_follow_their_ranges() -> None:
    """Two ranges that come nearer each other, in changing order, with a miss: the labels stay."""
    tracks, first = no_tracks(), 0
    for cycle in range(30):
        tracks = advance(tracks, 0.1, 0.03)
        length = np.array([5.0 - 0.02 * cycle, 4.0 + 0.01 * cycle])
        order = np.array([1, 0]) if cycle % 3 else np.array([0, 1])
        order = order[:1] if cycle == 10 else order
        found = assign(tracks, length[order], np.full(len(order), 0.005), 9.0)
        tracks, label = follow(tracks, found, length[order], np.full(len(order), 0.005), 0.3, first)
        first = max(first, int(label.max()) + 1)
        assert np.array_equal(label, order)
    # Cycle 10 showed one range only, that of label 1.
    assert np.array_equal(tracks.hits, [29, 30])
    assert np.allclose(tracks.mean[:, 1], [-0.2, 0.1], rtol=0.0, atol=0.03)


def test_no_two_ranges_continue_one_track() -> None:
    """The nearer one does; the other starts a track of its own."""
    tracks, _ = follow(no_tracks(), np.array([-1]), np.array([3.0]), np.array([0.01]), 0.1, 0)
    found = assign(tracks, np.array([3.01, 3.001]), np.full(2, 0.01), 9.0)
    assert np.array_equal(found, [-1, 0])
