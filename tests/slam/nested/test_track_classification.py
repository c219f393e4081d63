"""The filter's choice of classifier: looks at its turns only, odds blended, names refused."""

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.model import Body, RadioConfig
from rislam_rt.slam import NestedConfig
from rislam_rt.slam.nested.track_classification import LOOK_EVERY, classify_tracks
from rislam_rt.slam.nested.tracks import LandmarkTracks, advance, begin, extend, no_tracks
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD, Observations

RADIO, BODY, WINDOW = RadioConfig(), Body(), 40
POINT, WALL = np.array([3.1, 2.6, 1.9]), 5.0


def _walked() -> tuple[LandmarkTracks, np.ndarray]:
    """Two tracks over 40 cycles: a sphere of 5 cm, and the wall x = 5 m of reflection 0.85; noise-free."""
    position = np.array([1.0, 1.2, 0.5]) + np.arange(WINDOW)[:, None] * np.array([0.012, -0.008, 0.0])
    tracks = no_tracks(WINDOW)
    for cycle in range(WINDOW):
        tx, rx = BODY.ends(position[cycle], np.array(0.0))
        image = tx * [-1.0, 1.0, 1.0] + [2.0 * WALL, 0.0, 0.0]
        length = np.array([np.linalg.norm(POINT - tx) + np.linalg.norm(POINT - rx), np.linalg.norm(image - rx)])
        ray = np.stack([(p - rx) / np.linalg.norm(p - rx) for p in (POINT, image)])
        # both legs of the sphere spread, the mirror's image spreads once
        free = RADIO.wavelength / (4.0 * np.pi * length)
        ratio = np.array([0.05 * length[0] / (np.linalg.norm(POINT - tx) * np.linalg.norm(POINT - rx)), 0.85])
        log_amplitude, small = np.log(ratio * free), np.full(2, 1e-3)
        observed = Observations(
            np.column_stack([length, ray[:, :2]]), np.full((2, 3), 2e-3), log_amplitude, small, small, ratio
        )
        rows, dark = np.arange(2), np.zeros(2, dtype=np.bool_)
        tracks = advance(tracks, 0.1, cycle, np.full(3, 0.02))
        if cycle:
            tracks = extend(tracks, rows, observed, rows, dark, cycle)
        else:
            tracks = begin(tracks, observed, rows, dark, np.full(3, 0.1), cycle)
    return tracks, position


@pytest.mark.parametrize("classifier", ["network", "geometric"])
def test_a_wall_is_told_from_a_sphere(classifier: str) -> None:
    tracks, position = _walked()
    now = WINDOW - WINDOW % LOOK_EVERY
    found = classify_tracks(tracks, position, np.zeros(WINDOW), now, BODY, RADIO, classifier)
    assert found.looks.tolist() == [1, 1]
    assert found.specular.tolist() == [False, True]
    assert tracks.specular.tolist() == [False, False]  # by amplitude, which here was said to be dark
    again = classify_tracks(found, position, np.zeros(WINDOW), now + LOOK_EVERY, BODY, RADIO, classifier)
    assert again.looks.tolist() == [2, 2]


def test_what_ran_over_the_panel_is_no_wall_whatever_the_odds() -> None:
    tracks, _ = _walked()
    tracks = tracks._replace(looks=np.array([1, 1]), odds=np.array([-8.0, -8.0]))
    assert tracks._replace(side=np.array([PANEL, OTHER])).specular.tolist() == [False, True]
    assert tracks._replace(side=np.array([UNTOLD, PANEL])).specular.tolist() == [True, False]


def test_between_its_turns_and_by_amplitude_nothing_changes() -> None:
    tracks, position = _walked()
    for cycle, classifier in ((LOOK_EVERY + 1, "network"), (LOOK_EVERY, "amplitude")):
        assert classify_tracks(tracks, position, np.zeros(WINDOW), cycle, BODY, RADIO, classifier) is tracks
    none = no_tracks(WINDOW)
    assert classify_tracks(none, position, np.zeros(WINDOW), LOOK_EVERY, BODY, RADIO, "network") is none


def test_a_track_that_was_missed_is_not_looked_at() -> None:
    tracks, position = _walked()
    found = classify_tracks(
        tracks._replace(misses=np.array([1, 0])), position, np.zeros(WINDOW), 40, BODY, RADIO, "network"
    )
    assert found.looks.tolist() == [0, 1]
    assert found.odds[0] == 0.0


def test_an_unknown_classifier_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"nested\.classifier: 'guess' received"):
        NestedConfig(classifier="guess")


@pytest.mark.parametrize("case", range(6))
def test_odds_are_finite_whatever_was_measured(case: int) -> None:
    """Lengths of a micrometre to the filter's infinity, cosines beyond any sphere, coincident tracks, a still agent."""
    rng = np.random.default_rng(case)
    count, tracks = int(rng.integers(1, 12)), no_tracks(WINDOW)
    rows, dark, ones = np.arange(count), np.zeros(count, dtype=np.bool_), np.ones(count)
    position = rng.uniform(0.0, 5.0, (WINDOW, 3)) if case % 2 else np.ones((WINDOW, 3))
    for cycle in range(LOOK_EVERY + 1):
        cosines = rng.choice([-1e5, -1.0, 0.0, 0.3, 1e5], (count, 2))
        seen = np.column_stack([10.0 ** rng.uniform(-6.0, 5.0, count), cosines])
        seen = np.broadcast_to(seen[:1], seen.shape) if case % 3 == 0 else seen
        std, level = 10.0 ** rng.uniform(-5.0, 5.0, (count, 3)), rng.uniform(-69.0, 69.0, count)
        observed = Observations(seen, std, level, ones, ones, ones)
        tracks = advance(tracks, 0.1, cycle, np.full(3, 0.02))
        if cycle:
            tracks = extend(tracks, rows, observed, rows, dark, cycle)
        else:
            tracks = begin(tracks, observed, rows, dark, np.full(3, 0.1), cycle)
    for classifier in ("network", "geometric"):
        found = classify_tracks(tracks, position, np.zeros(WINDOW), LOOK_EVERY, BODY, RADIO, classifier)
        assert np.isfinite(found.odds).all()
        assert (found.looks == 1).all()
