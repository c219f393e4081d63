"""Doubted returns: what scatters about a wall by more than fits is asked anew what caused it."""

import numpy as np
import pytest

from rislam_rt.slam.predicted_returns import NONE, TX
from rislam_rt.slam.window.births.doubted_returns import with_other_cause
from rislam_rt.slam.window.cycle_explanation import remove_or_add_features
from rislam_rt.slam.window.measurement_log import scatter_variance

LATE = 12


@pytest.fixture
def ceiling(walked):
    """State, true places, association, the ceiling's ident and the rows of its return's last 12 components."""
    state, place, view, _ = walked
    walls = state.landmarks.ident[state.landmarks.is_wall]
    span = (state.window.features - state.landmarks.anchor)[state.landmarks.is_wall]
    level = int(walls[np.argmax(span[:, 2])])
    rows = (state.log.form[:, 0] == [TX, NONE, NONE, level, NONE]).all(axis=1).nonzero()[0][-LATE:]
    assert len(rows) == LATE
    return state, place, view, level, rows


def scattering(state, rows, seen, by=40.0):
    """State whose log has seen (A, 3) in its rows, held for the path's by a scatter of `by` deviations."""
    log = state.log
    every, extra = log.seen.copy(), log.extra.copy()
    every[rows] = seen
    extra[rows] = log.shared[rows] + scatter_variance(np.full(len(rows), by**2), log.std[rows])
    return state._replace(log=log._replace(seen=every, extra=extra))


def over_slope(state, place, normal, at):
    """Lengths and cosines (A, 3) of the return over a plane through `at`, for an agent in `place` (A, 3)."""
    cos, sin = np.cos(state.heading[-1]), np.sin(state.heading[-1])
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    tx, rx = (place + turn @ offset for offset in (state.scene.body.tx_offset, state.scene.body.rx_offset))
    image = tx - 2.0 * ((tx - at) @ normal)[:, None] * normal
    way = image - rx
    length = np.linalg.norm(way, axis=1)
    return np.column_stack([length, (way @ turn)[:, :2] / length[:, None]])


NORMAL = np.array([0.15, -0.05, 1.0]) / np.linalg.norm([0.15, -0.05, 1.0])


def under_the_other_slope(state, place, rows, rng):
    """State in which the ceiling's last components are those of another slope, held for its own."""
    at = place[-LATE - 1] + [0.0, 0.0, 0.5 * state.log.seen[rows[0], 0]]
    exact = over_slope(state, place[state.log.cycle[rows]], NORMAL, at)
    return scattering(state, rows, exact + state.log.std[rows] * rng.standard_normal(exact.shape))


def test_a_cycle_without_a_birth_asks(ceiling, walked, rng):
    state, place, view, _, rows = ceiling
    doubted = under_the_other_slope(state, place, rows, rng)
    after = remove_or_add_features(doubted, walked[3], view)
    assert (after.log.form[rows, 0, 3] >= state.landmarks.next_ident).all()


def test_the_other_slope_of_a_ceiling_is_a_wall_of_its_own(ceiling, rng):
    state, place, view, level, rows = ceiling
    after = with_other_cause(under_the_other_slope(state, place, rows, rng), view)
    new = np.unique(after.log.form[rows, 0, 3])
    assert len(new) == 1
    assert new[0] not in state.landmarks.ident
    row = int(np.flatnonzero(after.landmarks.ident == new[0])[0])
    span = after.window.features[row] - after.landmarks.anchor[row]
    assert np.degrees(np.arccos(abs(span @ NORMAL) / np.linalg.norm(span))) < 1.0
    kept = np.isin(state.tracks.ident, after.tracks.ident)
    np.testing.assert_array_equal(after.tracks.looked, state.tracks.looked[kept])  # births ask them when they would
    # the first slope keeps what was heard over it before
    assert (after.log.form[:, 0, 3] == level).any()


def test_what_scatters_at_random_stays(ceiling, rng):
    """No wall moves a component to and fro by as much: a neighbour does."""
    state, _, view, _, rows = ceiling
    seen = state.log.seen[rows] + 40.0 * state.log.std[rows] * rng.standard_normal((LATE, 3))
    noisy = scattering(state, rows, seen)
    assert with_other_cause(noisy, view) is noisy


def test_what_fits_is_not_asked(ceiling):
    state, _, view, _, _ = ceiling
    assert with_other_cause(state, view) is state


@pytest.fixture
def rng():
    return np.random.default_rng(3)
