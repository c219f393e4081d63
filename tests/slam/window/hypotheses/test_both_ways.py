"""A new wall at an acute angle to a known one: two paths, met in either order, that come out as one component."""

from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import reflect
from rislam_rt.slam.window.births import births, track_classification
from rislam_rt.slam.window.hypotheses.hypotheses import (
    BOTH_WAYS,
    KNOWN_WALL,
    WALL_KNOWN,
    hypotheses,
    known_features,
)
from rislam_rt.slam.window.hypotheses.hypothesis_evidence import _log_pitch
from rislam_rt.slam.window.hypotheses.hypothesis_fits import try_all
from rislam_rt.slam.window.hypotheses.path_feasibility import log_possible
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary
from rislam_rt.slam.window.landmarks.landmark_table import empty_table, enter
from rislam_rt.slam.window.landmarks.ris_identification import unknown

MIDDLE, CELL = np.array([0.3, 0.2, 1.0]), np.array([0.25, 0.25])
WALL_AT = np.array([3.5, 0.0, 0.0])
"""Way from the agent to the known upright wall."""


def _image(way):
    """Image of the agent's place in the wall to which that is the way."""
    return MIDDLE + 2.0 * np.asarray(way, dtype=np.float64)


def _ceiling(slope, height=1.6, aside=0.02):
    """Way to a ceiling `height` above the agent that rises by `slope` towards the known wall, if that is positive."""
    normal = np.array([-slope, aside, 1.0])
    return height * normal / (normal @ normal)


def _seen(images, rx):
    """Length and cosines (B, 3) of what the Rx hears of images of the Tx."""
    out = images - rx
    return np.concatenate(
        [np.linalg.norm(out, axis=1, keepdims=True), (out / np.linalg.norm(out, axis=1)[:, None])[:, :2]], 1
    )


def _case(new, share=0.5, known=WALL_AT, move=(0.3, 0.5, 0.4), baseline=(0.0, 0.05, 0.0)):
    """Track of the paths over the known wall and a `new` one, for an agent that moves: of both orders, the second at a
    `share`; with the map."""
    time = np.linspace(-1.0, 0.0, 8)
    place = MIDDLE + time[:, None] * np.asarray(move)
    tx, rx = place + np.array(baseline), place - np.array(baseline)
    known, image = _image(known), _image(new)
    one, other = (
        _seen(reflect(reflect(tx, first, MIDDLE), then, MIDDLE), rx) for first, then in ((known, image), (image, known))
    )
    seen = (1.0 - share) * one + share * other
    weight = np.tile([1.0 / 0.002, 1.0 / 0.002, 1.0 / 0.002], (8, 1))
    summary = TrackSummary(
        seen[None], weight[None], time[None], tx[None], rx[None], np.zeros((1, 8, 3, 6)), np.zeros(1), np.ones((1, 3)),
        MIDDLE, 0.8, np.zeros((1, 8, 3, 0)),
    )  # fmt: skip
    landmarks = enter(empty_table(1), True, MIDDLE, 10, 5.0, unknown(1, 1))
    return summary, known_features(known[None], 1e-8 * np.eye(3), landmarks, MIDDLE), landmarks


def test_the_ceiling_that_rises_towards_a_wall_is_found_from_both_orders_at_once():
    """One order alone makes a ceiling of it that is level, and as high as the edge is."""
    slope = 0.08
    summary, known, landmarks = _case(_ceiling(slope))
    table = hypotheses(summary, known, landmarks)
    table = table.take(np.isin(table.kind, (KNOWN_WALL, WALL_KNOWN, BOTH_WAYS)))
    fits = try_all(table.trials, summary)
    off = np.linalg.norm(fits.place - _image(_ceiling(slope)), axis=1)
    both = table.kind == BOTH_WAYS
    assert off[both] < 1e-3
    assert fits.cost[both] < 1e-3
    assert (off[~both] > 0.1).all()
    np.testing.assert_array_equal(fits.share, np.where(both, 0.5, 0.0))


def test_the_slopes_of_the_mean_of_both_orders_are_those_of_finite_differences():
    """The fit's own information against that of the prediction, moved along each axis."""
    summary, known, landmarks = _case(_ceiling(0.15))
    table = hypotheses(summary, known, landmarks)
    table = table.take(table.kind == BOTH_WAYS)
    place, step = _image(_ceiling(0.15)), 1e-4
    tx, rx, wall = summary.tx[0], summary.rx[0], known.place[0]

    def seen(image):
        images = (reflect(reflect(tx, first, MIDDLE), then, MIDDLE) for first, then in ((wall, image), (image, wall)))
        return np.mean([_seen(each, rx) for each in images], axis=0)

    slopes = np.stack([(seen(place + at) - seen(place - at)) / (2.0 * step) for at in step * np.eye(3)], axis=-1)
    heavy = slopes * summary.weight[0][..., None]
    tail = (CONSTANTS.tail + 3.0) / CONSTANTS.tail
    ridge = (2.0 * CONSTANTS.size) ** -2.0
    information = tail * np.einsum("bij,bik->jk", heavy, heavy) + ridge * np.eye(3)
    fits = try_all(table.trials, summary)
    np.testing.assert_allclose(np.linalg.inv(fits.held[0]), information, rtol=2e-3, atol=1e-3 * information.max())


NEW = {
    "ceiling": _ceiling(0.08, aside=0.0),
    "steep ceiling": _ceiling(0.35, aside=0.0),
    "ceiling that rises along the wall": _ceiling(0.08, aside=0.2),
    "upright": 2.4 * np.array([np.sin(-0.2), np.cos(-0.2), 0.0]),
    "upright, sharper": 1.5 * np.array([np.sin(-0.5), np.cos(-0.5), 0.0]),
}
"""Ways to walls that meet the known one at an acute angle."""


LEVEL, SLOPING = np.array([0.0, 0.0, 1.6]), _ceiling(0.3, aside=0.1)
"""Ways to known ceilings."""


@pytest.mark.parametrize(
    ("known", "new"),
    [*((WALL_AT, way) for way in NEW.values())]
    + [(known, way) for known in (LEVEL, SLOPING) for way in ((0.9, 0.0, -0.2), (0.6, 0.6, -0.2))],
)
def test_at_rest_the_first_guess_is_the_wall_itself(known, new):
    """The mean of two directions is shorter than one, so that of upright walls it seems to come from above."""
    summary, known, landmarks = _case(new, known=known, move=(0.0, 0.0, 0.0), baseline=(0.0, 0.0, 0.0))
    table = hypotheses(summary, known, landmarks)
    start = table.trials.start[table.kind == BOTH_WAYS]
    np.testing.assert_allclose(start[0], _image(new), atol=1e-6)
    alone = hypotheses(summary, known, landmarks, both_ways=False)
    assert (alone.kind != BOTH_WAYS).all()
    assert len(alone.kind) == len(table.kind) - 1


@pytest.mark.parametrize("new", NEW)
@pytest.mark.parametrize("known", [(3.5, 0.0, 0.0), (0.56, -0.02, 0.0)])
def test_walls_at_an_acute_angle_are_found(new, known):
    """By fits of at most `STEPS` steps, while the agent goes a short way; the ends of its link are 0.1 m apart. How far
    an upright wall leans is told by the angle's square alone: cost 0.1 leaves 0.15 m of its image's height open."""
    summary, features, landmarks = _case(NEW[new], known=np.array(known), move=(0.1, 0.2, 0.0))
    table = hypotheses(summary, features, landmarks)
    table = table.take(table.kind == BOTH_WAYS)
    fits = try_all(table.trials, summary)
    assert fits.cost[0] < 0.1
    off = np.abs(fits.place[0] - _image(NEW[new]))
    assert (off < [0.01, 0.01, 0.15]).all()


def test_noise_leads_no_fit_astray():
    """It ends at no more than the truth costs. A wall at 76 degrees to one beside which the agent goes: next to nothing
    tells how far it leans, and steps that are not damped go far that way."""
    new, tail = 3.8 * np.array([np.sin(-0.24), np.cos(-0.24), 0.0]), CONSTANTS.tail
    summary, features, landmarks = _case(new, known=np.array([0.56, -0.02, 0.0]), move=(0.1, 0.2, 0.0))
    for seed in range(40):
        noise = np.random.default_rng(seed).standard_normal(summary.seen.shape)
        heard = summary._replace(seen=summary.seen + noise / summary.weight)
        table = hypotheses(heard, features, landmarks)
        fits = try_all(table.take(table.kind == BOTH_WAYS).trials, heard)
        assert fits.cost[0] <= (tail + 3.0) * np.log1p((noise**2).sum(axis=2) / tail).sum()


def test_arrivals_at_the_rim_have_a_first_guess():
    """Where rounding puts two cosines beyond the unit circle."""
    summary, features, landmarks = _case(NEW["upright"])
    rim = np.linspace(0.0, 2.0 * np.pi, 200)
    for angle in rim:
        cosines = np.array([np.cos(angle), np.sin(angle)]) * (1.0 + 4e-16)
        summary.seen[..., 1:] = cosines
        table = hypotheses(summary, features, landmarks)
        assert np.isfinite(table.trials.start).all()


@pytest.mark.parametrize("slope", [0.05, 0.08, -0.08, 0.0, 0.3])
def test_which_orders_there_are_hangs_on_the_angle(slope):
    """Acute: both, as one component unless they are a cell apart; obtuse: none; right: one of the two."""
    summary, known, landmarks = _case(_ceiling(slope), move=(0.0, 0.0, 0.0), baseline=(0.05, 0.0, 0.0))
    table = hypotheses(summary, known, landmarks)
    table = table.take(np.isin(table.kind, (KNOWN_WALL, WALL_KNOWN, BOTH_WAYS)))
    image, spread = _image(_ceiling(slope)), np.tile(1e-8 * np.eye(3), (3, 1, 1))
    possible = log_possible(table, np.tile(image, (3, 1)), spread, summary, known, CELL)
    found = dict(zip(table.kind, np.exp(possible), strict=True))
    alone, both = [found[KNOWN_WALL], found[WALL_KNOWN]], found[BOTH_WAYS]
    if slope < 0.0:
        assert max(*alone, both) < 1e-3
    elif slope == 0.0:
        np.testing.assert_allclose(np.sort(alone), [0.0, 2.0], atol=1e-3)
        assert both < 1e-3
    else:
        orders = ((known.place[0], image), (image, known.place[0]))
        seen = [
            _seen(reflect(reflect(summary.tx[0], *one[:1], MIDDLE), one[1], MIDDLE), summary.rx[0]) for one in orders
        ]
        apart = min(float(np.abs(seen[0] - seen[1])[0, 1:].max()) / CELL[0], 1.0)
        np.testing.assert_allclose(alone, 2.0, rtol=1e-6)
        np.testing.assert_allclose(both, 2.0 * max(1.0 - apart, np.exp(CONSTANTS.log_lost)), rtol=1e-6)
        assert (apart < 1.0) == (slope < 0.1)


@pytest.mark.parametrize("turned", [0.0, 0.05, 0.8])
def test_what_is_met_in_both_orders_is_not_presumed_to_be_at_right_angles(turned):
    """However the room lies: a ceiling may be level along the wall that it rises towards, and not across."""
    flat = np.array([[np.cos(turned), -np.sin(turned), 0.0], [np.sin(turned), np.cos(turned), 0.0], [0.0, 0.0, 1.0]])
    table = SimpleNamespace(
        kind=np.array([KNOWN_WALL, BOTH_WAYS]),
        known=np.zeros(2, dtype=int),
        trials=SimpleNamespace(is_wall=np.ones(2, bool)),
    )

    def axes(at, new, old):
        known = SimpleNamespace(place=_image(flat @ old)[None])
        landmarks = enter(empty_table(1), True, MIDDLE, 10, 5.0, unknown(1, 1))
        return track_classification._holds(table, _image(flat @ new), MIDDLE, known, landmarks, at).axis

    sloping, upright = _ceiling(0.08), np.array([-1.0, 2.0, 0.0])
    assert len(axes(0, sloping, WALL_AT)) == 2
    np.testing.assert_allclose(np.abs(axes(1, sloping, WALL_AT)), np.abs(flat @ [[0.0], [1.0], [0.0]]).T, atol=1e-12)
    np.testing.assert_allclose(axes(1, upright, WALL_AT), [[0.0, 0.0, 1.0]])
    assert len(axes(1, np.array([0.3, 2.0, 0.05]), np.array([0.0, 0.0, 1.6]))) == 0  # under a level ceiling
    # where the known one slopes, the new one may be upright or level
    np.testing.assert_allclose(axes(1, upright, sloping)[0], [0.0, 0.0, 1.0])


def test_an_upright_wall_under_a_known_ceiling_that_slopes_is_found_too():
    """Beside the two orders alone, whose fits are next to perfect sooner."""
    for slope in (0.05, 0.08):
        ceiling = _ceiling(slope)
        summary, known, landmarks = _case(WALL_AT, known=ceiling)
        table = hypotheses(summary, known, landmarks)
        table = table.take(np.isin(table.kind, (KNOWN_WALL, WALL_KNOWN, BOTH_WAYS)))
        fits = try_all(table.trials, summary)
        both = table.kind == BOTH_WAYS
        assert fits.cost[both] < 0.1
        assert np.linalg.norm(fits.place[both] - _image(WALL_AT)) < 5e-3
        assert not track_classification._is_oblique(table, fits, summary, known).any()


def test_both_orders_enter_the_log_as_partners():
    decision = track_classification.TrackDecision(BOTH_WAYS, 1.0, 4, -1, *7 * [None])
    assert decision.is_wall
    assert decision.is_return
    assert decision.form == (-1, -1, -1, 4, track_classification.NEW)
    assert births._partner(decision, np.array([-1, -1, -1, 4, 9])).tolist() == [-1, -1, -1, 9, 4]


def test_only_between_upright_walls_is_what_is_met_in_both_orders_upright():
    summary, known, landmarks = _case(_ceiling(0.08))
    table = hypotheses(summary, known, landmarks)
    for way, oblique in ((_ceiling(0.08), True), (np.array([-1.0, 2.0, 0.0]), False)):
        fits = SimpleNamespace(place=np.tile(_image(way), (len(table.kind), 1)))
        found = track_classification._is_oblique(table, fits, summary, known)
        np.testing.assert_array_equal(found, oblique & (table.kind == BOTH_WAYS))


def test_all_pitches_are_alike_beforehand():
    """Over a sphere of directions the prior integrates to one."""
    rng, count = np.random.default_rng(2), 200_000
    way = rng.standard_normal((count, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    found = np.exp(_log_pitch(3.0 * way, np.full(count, 3.0), np.zeros((count, 3, 3))))
    # gentler than the lean of level walls there is no more of it
    assert abs(found.mean() - 1.0) < 5.0 * found.std() / count**0.5 + CONSTANTS.lean
    pitch = np.arcsin(np.hypot(*way[:, :2].T))
    share = [found[(pitch > low) & (pitch < low + 0.2)].sum() / count for low in (0.2, 0.6, 1.2)]
    np.testing.assert_allclose(share, 0.2 / (0.5 * np.pi), rtol=0.1)


def test_a_feature_slopes_unless_it_is_held_for_level():
    own, same, oblique = np.arange(3), np.array([False, True, True]), np.array([False, False, True])
    for log_odds, chosen in ((-2.0, 2), (-4.0, 0)):  # one in twenty is at -2.9
        evidence = np.array([-10.0, -np.inf, -10.0 + log_odds])
        assert track_classification._cautious(oblique, own, evidence, same, 0) == chosen
    assert track_classification._cautious(oblique, own, np.zeros(3), same & False, 0) == 0
    slopes = np.array([False, True, True])  # of two that slope, the likeliest of all
    assert (
        track_classification._cautious(slopes, own, np.array([-9.0, -1.0, -2.0]), np.array([True, True, False]), 2) == 2
    )
