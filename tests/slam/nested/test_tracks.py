"""Faint tracks: they outlive gaps that their own past lets expect, wait for each other, and are doubted more."""

import numpy as np
import pytest

from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.nested.birth_scheduling import due_tracks
from rislam_rt.slam.nested.tracks import LandmarkTracks, advance, begin, extend, has_ended, no_tracks, overstatement
from rislam_rt.slam.observations import OTHER, PANEL, Observations
from tests.slam.test_association import outlook

NOTHING = outlook(np.zeros((0, 3)), np.zeros(0))
STEADY, FAINT = "#" * 12, "#..#..##...#.#.#..#.#..#"
"""Cycles with and without a measurement: twelve of twelve, and 10 of 24."""
SNR = 10.0


def follow(*courses: str, lengths: tuple[float, ...] = (3.0,), side: int = OTHER) -> tuple[LandmarkTracks, int]:
    """Tracks that show as drawn, all of one direction and strength, and the cycle after which they are looked at."""
    tracks, dull = no_tracks(40), np.zeros(len(courses), dtype=np.bool_)
    seen = np.array([[length, 0.1, 0.2] for length in lengths])
    zero = np.zeros(len(courses))
    observed = Observations(
        seen, np.full(seen.shape, 0.02), zero, zero + 0.1, zero + 0.1, zero, np.full(len(courses), side)
    )
    for cycle in range(len(courses[0])):
        if cycle:
            shown = np.flatnonzero([course[cycle] == "#" for course in courses])
            tracks = advance(tracks, 0.1, cycle, np.full(3, 0.03))
            tracks = extend(tracks, shown, observed, shown, dull, cycle)
        else:
            tracks = begin(tracks, observed, np.arange(len(courses)), dull, np.full(3, 0.1), cycle)
    return tracks, len(courses[0]) - 1


@pytest.mark.parametrize(
    ("course", "gap", "ended"),
    [
        (STEADY, 4, False),
        (STEADY, 5, True),
        (FAINT, 5, False),
        (FAINT, 8, False),
        (FAINT, 15, True),
        ("#.#.#", 4, False),
        ("#.#.#", 5, True),  # too young to know
    ],
)
def test_a_track_ends_when_it_is_silent_for_longer_than_it_ever_was(course: str, gap: int, ended: bool) -> None:
    tracks, cycle = follow(course + "." * gap)
    assert has_ended(tracks, cycle, 4)[0] == ended


def test_a_gap_is_as_likely_as_a_flat_prior_makes_it() -> None:
    """By drawing the probability of showing from its posterior: the share of runs in which the gap is that long."""
    tracks, _ = follow(FAINT)
    seen, missed = int(tracks.length[0]), int(tracks.earlier_misses(len(FAINT) - 1)[0])
    assert (seen, missed) == (10, 14)
    draws = np.random.default_rng(3).beta(seen + 1, missed + 1, 400_000)
    gaps = [gap for gap in range(5, 30) if has_ended(*follow(FAINT + "." * gap), 4)[0]]
    first = min(gaps)
    # one in a hundred lies between the first gap that is not borne and the last that is
    assert np.mean((1.0 - draws) ** first) < 0.0105
    assert np.mean((1.0 - draws) ** (first - 1)) > 0.0095


def test_amplitudes_of_a_faint_path_are_overstated_as_told() -> None:
    """Only what noise lifts above the threshold is measured; what that does to the mean, by drawing it."""
    rng, level = np.random.default_rng(4), np.sqrt(2.0 * SNR)
    for course, share in ((FAINT, 11 / 26), (STEADY, 13 / 14)):
        tracks, cycle = follow(course)
        noise = rng.standard_normal(400_000)
        strength = level - np.quantile(noise, 1.0 - share)
        heard = strength + noise[strength + noise > level]
        np.testing.assert_allclose(overstatement(tracks, cycle, SNR), heard.mean() / strength, rtol=5e-3)


@pytest.mark.parametrize(("side", "due"), [(OTHER, True), (PANEL, False)])
def test_ways_count_as_measurements_do_unless_the_panel_makes_the_gaps(side: int, due: bool) -> None:
    """Eight measurements in fifteen cycles, where twelve are asked for."""
    tracks, cycle = follow("#.#.#.#.#.#.#.#", side=side)
    assert (len(due_tracks(tracks, NOTHING, cycle, SlamConfig())) == 1) == due
    # but eight cycles are eight cycles
    tracks, cycle = follow("########", side=side)
    assert not len(due_tracks(tracks, NOTHING, cycle, SlamConfig()))


@pytest.mark.parametrize(("silent", "waits"), [(1, True), (5, True), (14, False)])
def test_an_image_waits_for_what_is_silent_for_a_while_only(silent: int, waits: bool) -> None:
    """The longer track comes from the shorter one's direction; the shorter one is faint."""
    long = "#" + "." * (len(FAINT) + silent - 12) + "#" * 11
    tracks, cycle = follow(FAINT + "." * silent, long, lengths=(3.0, 4.0))
    due = due_tracks(tracks, NOTHING, cycle, SlamConfig())
    assert (1 not in due) == waits
