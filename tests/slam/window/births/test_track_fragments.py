"""Track fragments: a path's earlier track that broke off is of the same path, and another path's is not."""

import numpy as np
import pytest

from rislam_rt.slam.observations import PANEL
from rislam_rt.slam.predicted_returns import NONE, TX
from rislam_rt.slam.window.births.track_fragments import with_fragments
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN

NAME = 10_000


@pytest.fixture(params=[slice(0, 7), slice(10, 14)], ids=["before", "between"])
def broken(walked, request):
    """State in which some cycles of the return over the first wall are of a track that ended, with the rows of the
    log of that track, and of the others."""
    state, *_ = walked
    log = state.log
    rows = (log.form[:, 0] == [TX, NONE, NONE, int(state.landmarks.ident[0]), NONE]).all(axis=1).nonzero()[0]
    form, track, lost = log.form.copy(), log.track.copy(), rows[request.param]
    form[lost], track[lost] = UNKNOWN, NAME
    return state._replace(log=log._replace(form=form, track=track)), lost, np.setdiff1d(rows, lost)


def joined(state, lost, others):
    """Whether the broken track is associated with the path of the `others`."""
    after = with_fragments(state)
    own = (after.log.form[lost, 0] == state.log.form[others[0], 0]).all(axis=1)
    assert own.all() or not own.any()
    return bool(own.all())


def test_a_track_that_broke_off_is_of_the_path_that_goes_on(broken):
    assert joined(*broken)


def test_a_track_elsewhere_is_not(broken):
    """Five resolution cells off, or by as much louder as no path comes to be."""
    state, lost, others = broken
    seen, level = state.log.seen.copy(), state.log.log_amplitude.copy()
    seen[lost, 0] += 1.5
    level[lost] += 4.0
    assert not joined(state._replace(log=state.log._replace(seen=seen)), lost, others)
    assert not joined(state._replace(log=state.log._replace(log_amplitude=level)), lost, others)


def test_a_track_that_is_heard_beside_the_path_is_another(broken):
    """Of one path there is one component a cycle, even if two are in its place and as loud."""
    state, lost, others = broken
    track, seen, level = state.log.track.copy(), state.log.seen.copy(), state.log.log_amplitude.copy()
    beside = ((state.log.cycle == state.log.cycle[others[-1]]) & ~state.log.explained).nonzero()[0][0]
    track[beside], seen[beside], level[beside] = NAME, seen[others[-1]], level[others[-1]]
    log = state.log._replace(track=track, seen=seen, log_amplitude=level)
    assert not joined(state._replace(log=log), lost, others)


def test_a_track_over_the_panel_is_of_no_wall(broken):
    state, lost, others = broken
    side = state.log.side.copy()
    side[lost] = PANEL
    assert not joined(state._replace(log=state.log._replace(side=side)), lost, others)


def test_a_track_that_does_not_fit_is_no_reason_against_one_that_does(broken):
    """Its component next to the path's is where that is, and the others are five cells off."""
    state, lost, others = broken
    log, wall = state.log, int(np.unique(state.log.form[state.log.form[:, 0, 0] == TX, 0, 3])[1])
    rows = (log.form[:, 0] == [TX, NONE, NONE, wall, NONE]).all(axis=1).nonzero()[0][9:14]
    form, track, seen = log.form.copy(), log.track.copy(), log.seen.copy()
    form[rows], track[rows] = UNKNOWN, NAME + 1
    seen[rows[1:-1], 0] += 1.5
    state = state._replace(log=log._replace(form=form, track=track, seen=seen))
    assert joined(state, lost, others)
    assert (with_fragments(state).log.form[rows, 0, 0] == UNKNOWN).all()


def test_a_track_that_goes_on_is_asked_by_births(broken):
    """It may have a cause of its own."""
    state, lost, others = broken
    ident = state.tracks.ident.copy()
    ident[0] = NAME
    assert not joined(state._replace(tracks=state.tracks._replace(ident=ident)), lost, others)


def test_a_wall_that_was_silent_is_told_of_by_what_was_heard_before(interrupted):
    """Its first track ended before anything was born, and the wall was born of what came after."""
    state, *_ = interrupted
    form = state.log.form[:, 0]
    over_one = (form[:, 0] == TX) & (form[:, 3] >= 0) & (form[:, [1, 2, 4]] == NONE).all(axis=1)
    cycles = [state.log.cycle[over_one & (form[:, 3] == wall)] for wall in np.unique(form[over_one, 3])]
    gaps = [each for each in cycles if np.diff(each).max() > 6]
    assert len(gaps) == 1
    assert gaps[0][0] == 0
