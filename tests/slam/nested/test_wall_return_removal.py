"""Wall returns told from a landmark's path among the tracks, by each of the classifiers."""

import numpy as np
import pytest

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.errors import ConfigError
from rislam_rt.model import Body, RadioConfig
from rislam_rt.slam import NestedConfig
from rislam_rt.slam.nested.particle_filter import wall_returns
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD, Observations
from rislam_rt.slam.window.measurement_log import Log, append, empty_log
from rislam_rt.slam.window.tracks import no_tracks, start

RADIO, BODY, WINDOW = RadioConfig(), Body(), 40
POINT, WALL = np.array([3.1, 2.6, 1.9]), 5.0


def look(position: Floats) -> Observations:
    """What is heard of a sphere of 5 cm, and of the wall x = 5 m of reflection 0.85; noise-free."""
    tx, rx = BODY.ends(position, np.array(0.0))
    image = tx * [-1.0, 1.0, 1.0] + [2.0 * WALL, 0.0, 0.0]
    length = np.array([np.linalg.norm(POINT - tx) + np.linalg.norm(POINT - rx), np.linalg.norm(image - rx)])
    ray = np.stack([(p - rx) / np.linalg.norm(p - rx) for p in (POINT, image)])
    # both legs of the sphere spread, the mirror's image spreads once
    ratio = np.array([0.05 * length[0] / (np.linalg.norm(POINT - tx) * np.linalg.norm(POINT - rx)), 0.85])
    log_amplitude, small = np.log(ratio * RADIO.wavelength / (4.0 * np.pi * length)), np.full(2, 1e-3)
    return Observations(
        np.column_stack([length, ray[:, :2]]), np.full((2, 3), 2e-3), log_amplitude, small, small, ratio
    )


def heard(looks: list[Observations]) -> Log:
    """The log of some cycles, in which component k is track k's."""
    log = empty_log()
    for cycle, seen in enumerate(looks):
        log = append(log, seen, cycle, cycle - WINDOW + 1)
        log.track[-len(seen.seen) :] = np.arange(len(seen.seen))
    return log


def found(looks: list[Observations], position: Floats, classifier: str, side: int = UNTOLD) -> Booleans:
    """Which tracks are taken for wall returns."""
    count = len(looks[0].seen)
    tracks, _ = start(no_tracks(), looks[0], np.arange(count), np.full((count, 3), 0.1), 0)
    poses = np.column_stack([position, np.zeros(len(position))])
    config = NestedConfig(classifier=classifier)
    tracks = tracks._replace(side=np.full(count, side))
    return wall_returns(tracks, heard(looks), len(looks) - 1, poses, BODY, RADIO, config)


@pytest.mark.parametrize("classifier", ["amplitude", "network", "geometric"])
def test_a_wall_is_told_from_a_sphere(classifier: str) -> None:
    position = np.array([1.0, 1.2, 0.5]) + np.arange(WINDOW)[:, None] * np.array([0.012, -0.008, 0.0])
    looks = [look(place) for place in position]
    assert found(looks, position, classifier).tolist() == [False, True]
    assert found(looks, position, classifier, OTHER).tolist() == [False, True]
    # what the receiver says ran over the panel is no wall, however it looks
    assert found(looks, position, classifier, PANEL).tolist() == [False, False]


def test_nothing_followed_is_nothing_removed() -> None:
    assert len(wall_returns(no_tracks(), empty_log(), 0, np.zeros((1, 4)), BODY, RADIO, NestedConfig())) == 0


def test_an_unknown_classifier_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"nested\.classifier: 'guess' received"):
        NestedConfig(classifier="guess")


@pytest.mark.parametrize("case", range(6))
def test_whatever_was_measured_is_judged(case: int) -> None:
    """Lengths of a micrometre to the filter's infinity, cosines beyond any sphere, coincident tracks, a still agent."""
    rng = np.random.default_rng(case)
    count, ones = int(rng.integers(1, 12)), np.ones(12)
    position = rng.uniform(0.0, 5.0, (5, 3)) if case % 2 else np.ones((5, 3))
    looks = []
    for _ in range(5):
        cosines = rng.choice([-1e5, -1.0, 0.0, 0.3, 1e5], (count, 2))
        seen = np.column_stack([10.0 ** rng.uniform(-6.0, 5.0, count), cosines])
        seen = np.broadcast_to(seen[:1], seen.shape) if case % 3 == 0 else seen
        std, level = 10.0 ** rng.uniform(-5.0, 5.0, (count, 3)), rng.uniform(-69.0, 69.0, count)
        looks.append(Observations(seen, std, level, ones[:count], ones[:count]))
    for classifier in ("amplitude", "network", "geometric"):
        assert found(looks, position, classifier).shape == (count,)
