"""How long a track that is missed is waited for."""

import numpy as np

from rislam_rt.slam.observations import Observations
from rislam_rt.slam.window import tracks
from rislam_rt.slam.window.landmarks.horizon_detection import level_above, prior_tilts
from rislam_rt.slam.window.smoother import attitude


def waits(level, seen, hits=3):
    """Cycles for which a track of so many measurements at `seen` (3,) is waited for, while the body sways by the
    deviation number `level`."""
    one = np.ones(1)
    heard = Observations(seen[None], np.full((1, 3), 1e-3), one, 0.1 * one, one)
    found, _ = tracks.start(tracks.no_tracks(), heard, np.array([0]), np.full((1, 3), 0.1), 0)
    found = found._replace(hits=np.array([hits]), last=np.array([hits - 1]))
    probability = np.tile(np.eye(len(attitude.levels()))[level], (2, 1))
    above = level_above(tracks.nearly_level(found), found.rises, prior_tilts(probability))
    cycle = hits - 1
    while tracks.alive(found, cycle + 1, above, probability[0])[0]:
        cycle += 1
    return cycle - (hits - 1)


def test_a_level_track_is_waited_for_longer_while_the_body_sways():
    rim, ceiling = np.array([5.0, 0.6, 0.8]), np.array([5.0, 0.1, 0.2])
    assert waits(0, rim) == waits(0, ceiling) == waits(4, ceiling) == 3
    assert waits(4, rim) > 4
    assert waits(4, rim, hits=8) > waits(0, rim, hits=8)


def test_tracks_go_on_as_in_a_manoeuvre_if_that_is_likelier_for_all_of_them():
    """Lengths that change by 3 cm more than believed are those of who accelerates; one such alone is another thing."""
    seen = np.array([[5.0, 0.1, 0.2], [7.0, -0.3, 0.2], [9.0, 0.4, -0.5], [4.0, 0.0, 0.6]])
    heard = Observations(seen, np.full((4, 3), 1e-3), np.zeros(4), np.full(4, 0.1), np.ones(4))
    found, _ = tracks.start(tracks.no_tracks(), heard, np.arange(4), np.full((4, 3), 0.02), 0)
    calm, lively = (tracks.advance(found, 0.1, 0.0, np.array([bend, 0.1, 0.1]), np.zeros(2)) for bend in (0.1, 2.0))
    for moved, followed in ((3, True), (1, False), (0, False)):
        now = heard._replace(seen=seen + 0.03 * (np.arange(4) < moved)[:, None] * [1.0, 0.0, 0.0])
        both, rows, picks = tracks.match_over_motions(calm, lambda: (lively, np.log(0.02)), now, np.arange(4), 1, 1e-3)
        assert both is (lively if followed else calm)
        np.testing.assert_array_equal(rows, picks)
        assert len(rows) == (4 if followed else 4 - moved)
