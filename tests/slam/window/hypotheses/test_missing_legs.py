"""Single returns of two walls: those that are heard where the pair is heard now."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.model import RadioConfig
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.hypotheses.unheard_returns import bearings, missing_legs
from rislam_rt.slam.window.measurement_log import empty_log
from rislam_rt.slam.window.smoother.motion_basis import HEAD

CORNER = np.array([1.2, 1.6])
"""[m] from the agent to two upright walls at right angles."""
LENGTH = 2.0 * np.append(CORNER, np.hypot(*CORNER))
"""[m] of the two walls' own returns and of the corner's."""
EVERY = [([0, 1], 0.0), ([0], np.log1p(-CONSTANTS.steady)), ([], CONSTANTS.log_rare)]
"""Which of the walls' own returns are heard, and what that tells of the corner's."""


MISSED = np.log1p(-CONSTANTS.shown)
"""Log probability that a return is missed where nothing blocks it."""


def _context(heard, rays, spreads):
    """Three tracks of nine components in directions `rays` (3, 2), or two components of what is not `heard`, and the
    log of these; `spreads` (3, 2) are the deviations of the cosines: what is of 1 is heard from both ends in turn."""
    state, spreads = np.concatenate([LENGTH[:, None], rays], axis=1), np.asarray(spreads, dtype=float)
    hits = np.array([9 if row in heard else 2 for row in range(2)] + [9])
    track = np.repeat(np.arange(3), hits)
    seen, turn = state[track], (-1.0) ** np.arange(len(track))
    seen[:, 1:] *= np.where(spreads[track] > 0.5, turn[:, None], 1.0)
    log = empty_log()._replace(
        cycle=np.arange(len(track)), seen=seen, std=np.column_stack([np.full(len(track), 1e-3), spreads[track]]),
        track=track,
    )  # fmt: skip
    state[:, 1:] = np.where(spreads > 0.5, 0.1, state[:, 1:])  # the mean of both ends
    tracks = SimpleNamespace(
        hits=hits, mean=np.stack([state, 0.0 * state], axis=-1), log_amplitude=-np.log(LENGTH), side=np.zeros(3),
        ident=np.arange(3),
    )  # fmt: skip
    landmarks = SimpleNamespace(walls=np.zeros(0, dtype=np.int64), anchor=np.zeros((0, 3)))
    scene = SimpleNamespace(radio=RadioConfig(), use_vt=True)
    return SimpleNamespace(tracks=tracks, heading=np.zeros(1), landmarks=landmarks, log=log, scene=scene)


@pytest.mark.parametrize(("heard", "expected"), EVERY)
def test_a_corner_has_the_single_returns_of_its_walls_beside_it(heard, expected):
    """All are as loud as mirrors."""
    rays = np.array([[0.96, 0.28], [-0.28, 0.96], np.array([[0.96, -0.28], [0.28, 0.96]]) @ CORNER / np.hypot(*CORNER)])
    context = _context(heard, rays, np.full((3, 2), 1e-3))
    assert missing_legs(context, np.array([2]), np.zeros(HEAD))[0, 1:3] == pytest.approx([expected, expected])


@pytest.mark.parametrize(("heard", "expected"), EVERY)
def test_walls_on_the_arrays_own_lines_are_heard_beside_their_corner(heard, expected):
    """An agent that faces a wall hears it at the end of its array, now from ahead, now from behind: the mean of both is
    no direction. So the corner's return was the first wall of a hall, one that slants."""
    rays = np.array([[1.0, 0.0], [0.0, 1.0], CORNER / np.hypot(*CORNER)])
    context = _context(heard, rays, [[1.0, 1e-3], [1e-3, 1.0], [1e-3, 1e-3]])
    assert missing_legs(context, np.array([2]), np.zeros(HEAD))[0, 1:3] == pytest.approx([expected, expected])


def test_what_is_heard_from_both_ends_has_two_bearings():
    rays = np.array([[1.0, 0.0], [0.0, 1.0], CORNER / np.hypot(*CORNER)])
    context = _context([0, 1], rays, [[1.0, 1e-3], [1e-3, 1.0], [1e-3, 1e-3]])
    found = bearings(context, np.array([2, 1, 0]), np.zeros(HEAD))
    np.testing.assert_array_equal(found.track, [0, 1, 2, 1, 2])
    np.testing.assert_allclose(found.length, LENGTH[[2, 1, 0, 1, 0]])
    ends = np.array([[0.6, 0.8], [0.1, 1.0], [1.0, 0.1], [0.1, -1.0], [-1.0, 0.1]])
    np.testing.assert_allclose(found.ray[:, :2], ends, atol=0.11)


@pytest.mark.parametrize(
    ("lengths", "missing"),
    [((3.0, 4.4), 0), ((3.0, 3.6), 1), ((3.0,), 1), ((), 2)],
    ids=["both", "another", "one", "none"],
)
@pytest.mark.parametrize("turned", [0.0, 0.3], ids=["on the array's line", "aslant"])
def test_opposite_walls_have_single_returns_that_make_up_the_return_over_both(lengths, missing, turned):
    """Along one line, where nothing can block one of the three alone."""
    length = np.array([*lengths, 7.4])
    count, ray = len(length), np.array([np.cos(turned), np.sin(turned)])
    state = np.column_stack([length, np.tile(ray, (count, 1)) * (-1.0) ** np.arange(count)[:, None]])
    std = np.tile([1e-3, 1.0 if turned == 0.0 else 1e-3, 1e-3], (count, 1))
    log = empty_log()._replace(cycle=np.zeros(count, dtype=int), seen=state, std=std, track=np.arange(count))
    tracks = SimpleNamespace(
        hits=np.full(count, 9), mean=np.stack([state, 0.0 * state], axis=-1), log_amplitude=-np.log(length),
        ident=np.arange(count),
    )  # fmt: skip
    landmarks = SimpleNamespace(walls=np.zeros(0, dtype=np.int64), anchor=np.zeros((0, 3)))
    scene = SimpleNamespace(radio=RadioConfig(), use_vt=True)
    context = SimpleNamespace(tracks=tracks, heading=np.zeros(1), landmarks=landmarks, log=log, scene=scene)
    found = missing_legs(context, np.array([count - 1]), np.zeros(HEAD))[0, 0]
    assert found == pytest.approx(missing * np.log1p(-CONSTANTS.shown))


@pytest.mark.parametrize(
    ("length", "aslant", "floor", "pattern", "expected"),
    [(5.8, 0.2, False, "upper", 0.0), (5.8, 0.5, False, "upper", MISSED), (9.0, 0.0, False, "upper", MISSED),
     (7.6, 0.0, False, "upper", MISSED), (5.8, 0.2, True, "upper", -np.inf), (5.8, 0.2, False, "isotropic", -np.inf)],
    ids=["a pulled return", "another direction", "a longer way", "as high", "a known floor", "a floor that is heard"],
)  # fmt: skip
def test_an_echo_has_its_ceilings_own_return_beside_it(length, aslant, floor, pattern, expected):
    """However faint: merged with others it fades, its direction is pulled, and the echo is the clearer of both."""
    state = np.array([[length, aslant, 0.0], [7.8, 0.0, 0.0]])
    log = empty_log()._replace(cycle=np.zeros(2, dtype=int), seen=state, std=np.full((2, 3), 1e-3), track=np.arange(2))
    tracks = SimpleNamespace(
        hits=np.full(2, 9), mean=np.stack([state, 0.0 * state], axis=-1), log_amplitude=np.array([-12.0, -8.0]),
        ident=np.arange(2),
    )  # fmt: skip
    walls, radio = np.arange(1 if floor else 0), RadioConfig()
    landmarks = SimpleNamespace(walls=walls, anchor=np.zeros((len(walls), 3)))
    scene = SimpleNamespace(radio=replace(radio, array=replace(radio.array, pattern=pattern)), use_vt=True)
    context = SimpleNamespace(tracks=tracks, heading=np.zeros(1), landmarks=landmarks, log=log, scene=scene)
    mean = np.concatenate([np.zeros(HEAD), *([[0.0, 0.0, -2.0]] if floor else [])])
    assert missing_legs(context, np.array([1]), mean)[0, 3] == pytest.approx(expected)
