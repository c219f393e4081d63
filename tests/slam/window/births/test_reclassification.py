"""Reclassification: a wall that one path alone tells of is asked again what it is."""

import numpy as np
import pytest

from rislam_rt.slam.predicted_returns import NONE, TX, reflect
from rislam_rt.slam.window import tracks
from rislam_rt.slam.window.births import reclassification
from rislam_rt.slam.window.births.feature_removal import resolve
from rislam_rt.slam.window.births.reclassification import reclassified
from rislam_rt.slam.window.cycle_explanation import remove_or_add_features
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.smoother import window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.solver_limits import STRIDE


def told_by(state, row):
    """Rows of the log that tell of a wall, and the forms that they have."""
    at = (state.log.form == state.landmarks.ident[row]).any(axis=(1, 2)).nonzero()[0]
    return at, np.unique(state.log.form[at, 0], axis=0)


def alone(state, row):
    """State in whose log a wall's own return alone tells of it, and its rows there."""
    ident, form = state.landmarks.ident[row], state.log.form.copy()
    own = (form[:, 0] == [TX, NONE, NONE, ident, NONE]).all(axis=1)
    form[~own & (form == ident).any(axis=(1, 2))] = UNKNOWN
    form[own, 1] = UNKNOWN
    return state._replace(log=state.log._replace(form=form)), own.nonzero()[0]


def upright(state):
    """Row of an upright wall that has been heard for long."""
    span = state.window.features - state.landmarks.anchor
    return int(min(state.landmarks.walls, key=lambda row: abs(span[row, 2]) - 0.01 * len(alone(state, row)[1])))


@pytest.fixture
def mistaken(walked):
    """State in which the return of one wall is held for that over another and a wall that is none, which fits it in the
    last cycle; with the true wall's normal, and the row of the false one."""
    state, _, view, _ = walked
    row, other = upright(state), state.landmarks.walls
    state, at = alone(state, row)
    place, anchor = state.window.features, state.landmarks.anchor
    span = place - anchor
    known = next(
        k for k in other if abs(span[k] @ span[row]) < 0.1 * np.linalg.norm(span[k]) * np.linalg.norm(span[row])
    )
    agent = window_gaussian.poses(state.window)[-1, :3]
    image, over = reflect(agent, place[row], anchor[row]), reflect(agent, place[known], anchor[known])
    normal = (image - over) / np.linalg.norm(image - over)
    head, log = state.window.head.copy(), state.log
    head[HEAD + 3 * row :][:3] = anchor[row] - 2.0 * ((anchor[row] - 0.5 * (image + over)) @ normal) * normal
    form, ident = log.form.copy(), state.landmarks.ident
    form[at] = UNKNOWN
    form[at, 0] = [TX, NONE, NONE, ident[known], ident[row]]
    wrong = state._replace(log=log._replace(form=form), window=state.window._replace(head=head))
    return resolve(wrong, 2)[0], view, span[row] / np.linalg.norm(span[row]), row


def always(monkeypatch, row):
    """Let a wall be due in every cycle."""
    monkeypatch.setattr(reclassification, "_due", lambda state: [(row, told_by(state, row)[0])])


def test_a_wall_that_is_none_is_taken_back_and_the_true_one_is_born(mistaken, monkeypatch):
    state, view, normal, row = mistaken
    always(monkeypatch, row)
    after = reclassified(state, view)
    assert state.landmarks.ident[row] not in after.landmarks.ident
    new = (after.landmarks.ident == state.landmarks.next_ident).nonzero()[0]
    span = (after.window.features - after.landmarks.anchor)[new][0]
    assert np.degrees(np.arccos(abs(span @ normal) / np.linalg.norm(span))) < 1.0
    at = told_by(state, row)[0]
    assert (after.log.form[at, 0] == [TX, NONE, NONE, state.landmarks.next_ident, NONE]).all()
    # births ask the other tracks when they would
    kept = np.isin(state.tracks.ident, after.tracks.ident)
    np.testing.assert_array_equal(after.tracks.looked[: kept.sum()], state.tracks.looked[kept])


def test_a_cycle_asks(mistaken, walked, monkeypatch):
    state, view, _, row = mistaken
    always(monkeypatch, row)
    after = remove_or_add_features(state._replace(cycle=24), walked[3], view)
    assert state.landmarks.ident[row] not in after.landmarks.ident


def test_only_its_track_is_due_and_the_map_of_before_says_nothing(mistaken, monkeypatch):
    """The association's returns are numbered by the rows of a map that has the wall."""
    state, view, _, row = mistaken
    always(monkeypatch, row)
    asked = []
    monkeypatch.setattr(reclassification, "births", lambda trial, returns: asked.append((trial, returns)) or trial)
    fresh = state.tracks._replace(looked=np.zeros_like(state.tracks.looked))
    assert len(tracks.due(fresh, state.cycle))
    reclassified(state._replace(tracks=fresh), view)
    ((trial, returns),) = asked
    due = trial.tracks.ident[tracks.due(trial.tracks, trial.cycle)]
    assert due.tolist() == np.unique(trial.log.track[told_by(state, row)[0]]).tolist()
    assert not len(returns.groups.leader)
    assert len(view.groups.leader)


def test_right_walls_stay(walked, monkeypatch):
    state, _, view, _ = walked
    for row in state.landmarks.walls:
        lonely, at = alone(state, row)
        assert len(at) > 5
        always(monkeypatch, row)
        assert reclassified(lonely, view) is lonely


def test_what_is_nothing_clear_stays(mistaken, monkeypatch):
    """A wall is not taken back for being unlikely: neighbours make any unlikely in the long run."""
    state, view, _, row = mistaken
    always(monkeypatch, row)
    monkeypatch.setattr(reclassification, "births", lambda trial, returns: trial)
    assert reclassified(state, view) is state


@pytest.mark.parametrize("partner", [False, True])
def test_the_same_walls_in_another_order_are_no_other_wall(mistaken, monkeypatch, partner):
    """Nor are they with a partner: where two walls stand at right angles one path has both orders."""
    state, view, _, row = mistaken
    always(monkeypatch, row)
    at = told_by(state, row)[0]

    def born(trial, returns):
        form, new = trial.log.form.copy(), state.landmarks.next_ident
        first, second = state.log.form[at[0], 0, 3], new
        form[at, 0] = [TX, NONE, NONE, *([first, second] if partner else [second, first])]
        form[at, 1] = [TX, NONE, NONE, second, first] if partner else UNKNOWN
        return trial._replace(
            log=trial.log._replace(form=form), landmarks=trial.landmarks._replace(next_ident=new + 1)
        )  # fmt: skip

    monkeypatch.setattr(reclassification, "births", born)
    assert reclassified(state, view) is state


def test_each_wall_is_asked_in_its_turn_once_in_half_a_window(walked):
    row = upright(walked[0])
    state, at = alone(walked[0], row)
    due = [cycle for cycle in range(60, 120, STRIDE) if row in rows_due(state._replace(cycle=cycle))]
    assert np.diff(due).tolist() == [18] * (len(due) - 1)
    assert len(due) >= 3
    lonely = state._replace(cycle=due[0])
    form = state.log.form.copy()
    form[at[9:]] = UNKNOWN
    assert row in rows_due(lonely._replace(log=state.log._replace(form=form)))
    form[at[8]] = UNKNOWN  # half as many again as a birth asks for are 9
    assert row not in rows_due(lonely._replace(log=state.log._replace(form=form)))


def rows_due(state):
    """Rows of the walls that are due."""
    return [row for row, _ in reclassification._due(state)]


@pytest.mark.parametrize(("slot", "some"), [(0, slice(5, 6)), (1, slice(5, 6)), (1, slice(None))])
def test_a_wall_that_two_paths_tell_of_is_not_asked(walked, slot, some):
    """The second one by itself, or as a partner, once or always."""
    row = upright(walked[0])
    state, at = alone(walked[0], row)
    state = next(each for each in (state._replace(cycle=60 + more) for more in range(18)) if row in rows_due(each))
    form, other = state.log.form.copy(), next(each for each in state.landmarks.walls if each != row)
    form[at[some], slot] = [TX, NONE, NONE, state.landmarks.ident[row], state.landmarks.ident[other]]
    assert row not in rows_due(state._replace(log=state.log._replace(form=form)))
