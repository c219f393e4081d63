"""What a path was held for before a manoeuvre: what nears and recedes with the agent goes on doing so."""

import numpy as np
import pytest
from scipy.stats import norm

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.motion import egomotion
from rislam_rt.slam.window.motion.length_rates import Rates

MOTION = np.array([0.6, 0.0, 0.1])
AHEAD, ASIDE = np.array([-2.0, 0.0, 0.0]), np.array([-0.4, -1.9, -0.3])


def _rates(toward, rate, names, *, whole=None, std=0.05, owner=None, **more):
    """Rates of path lengths of tracks of some names, with directions that err by 0.02."""
    rate = np.asarray(rate, dtype=np.float64)
    name = np.repeat(np.asarray(names)[:, None], 6, axis=1)
    whole = rate if whole is None else np.asarray(whole, dtype=np.float64)
    many = len(rate)
    return Rates(
        np.array(toward), rate, np.full(many, std**2), np.full(many, 0.02), whole, owner=owner, name=name, **more
    )  # fmt: skip


def _by_bayes(toward, rate):
    """Probabilities (3,) that a path follows, keeps its length, or does neither, if half of all do the first and a
    quarter of the others the second."""
    lean = 0.02 * np.sqrt(1.0 / max(0.25 * toward[2] ** 2, 0.01) - 1.0)
    deviation = np.sqrt(0.05**2 + 0.02**2 * MOTION[0] ** 2 + lean**2 * MOTION[2] ** 2)
    likely = [norm.pdf(rate, toward @ MOTION, deviation), norm.pdf(rate, 0.0, 0.05), 1.0 / (4.0 * CONSTANTS.walk)]
    joint = np.array([0.5, 0.125, 0.375]) * likely
    return joint / joint.sum()


def test_a_path_is_held_for_what_its_rate_before_says():
    """One that followed, one that kept its length, one that did neither, and one of which nothing is known."""
    toward, rate = [AHEAD, ASIDE, AHEAD, ASIDE], [-1.25, 0.02, 0.8]
    before = _rates(toward[:3], rate, [7, 3, 5])
    found = egomotion.with_history(_rates(toward, np.zeros(4), [3, 5, 7, 9], astray=0.0), before, MOTION)
    kinds = np.stack(found.kinds, axis=1)
    for at, was in enumerate([1, 2, 0]):
        np.testing.assert_allclose(kinds[at], _by_bayes(toward[was], rate[was]), rtol=1e-9)
    np.testing.assert_allclose(kinds[3], [0.5, 0.125, 0.375])
    assert kinds[2, 0] > 0.95
    assert kinds[0, 1] > 0.5
    assert kinds[1, 2] > 0.99


def test_a_path_may_have_gone_astray_since():
    before = _rates([AHEAD], [-1.2], [1])
    sure, astray = (
        np.stack(egomotion.with_history(_rates([AHEAD], [0.0], [1], astray=share), before, MOTION).kinds, axis=1)[0]
        for share in (0.0, 0.1)
    )
    np.testing.assert_allclose(astray, 0.9 * sure + 0.1 * np.array([0.5, 0.125, 0.375]), rtol=1e-12)


@pytest.mark.parametrize("rate", [-1.2, 1.2])
def test_the_way_tells_at_which_end_of_the_array_a_path_arrives(rate):
    """Antennas half a wavelength apart hear a wall ahead as one behind: it has two directions, of which one follows."""
    owner, ends = np.array([0, 1, 0]), [AHEAD, ASIDE, -AHEAD]
    before = _rates(ends, [rate, -0.27, rate], [1, 2, 1], owner=owner)
    found = egomotion.with_history(_rates(ends, np.zeros(3), [1, 2, 1], owner=owner), before, MOTION)
    ahead, _, behind = found.kinds.follows
    assert (ahead > 0.9, behind > 0.9) == (rate < 0.0, rate > 0.0)
    np.testing.assert_allclose(found.mixed(found.kinds.follows) + found.kinds.keeps + found.kinds.other, 1.0)


def _reciprocal(options):
    """Names, owners and directions of a pair of reciprocal paths: each comes back as it went, or leaves as the other
    arrives (`both`)."""
    one, other = AHEAD, np.array([-1.0, -1.6, -0.66])
    both = 0.5 * (one + other)
    toward = {"back": [one, other], "both": [one, other, both, both]}[options]
    owner = np.array([0, 1, 0, 1])[: len(toward)]
    return {"toward": toward, "names": 1 + owner, "owner": owner}, float(both @ MOTION)


@pytest.mark.parametrize(
    ("was", "now", "least"),
    [("both", "both", 0.9), ("back", "both", 0.15), ("both", "back", 0.2), ("back", "back", 0.0)],
)
def test_a_reciprocal_path_is_held_for_the_direction_that_it_had(was, now, least):
    """The sum of two directions is shorter than twice one, however near. A direction that is new is not known, and a
    path that followed from one that is asked no more may be anything; one that never followed from its own does not."""
    ends, rate = _reciprocal(was)
    before = _rates(ends["toward"], np.full(len(ends["toward"]), rate), ends["names"], owner=ends["owner"])
    rng, ends = np.random.default_rng(0), _reciprocal(now)[0]
    for _ in range(20):
        near = np.array(ends["toward"]) + 0.01 * rng.standard_normal((len(ends["toward"]), 3))
        silent = _rates(near, np.zeros(len(near)), ends["names"], owner=ends["owner"], astray=0.0)
        found = egomotion.with_history(silent, before, MOTION)
        follows = found.mixed(found.kinds.follows)
        np.testing.assert_allclose(follows + found.kinds.keeps + found.kinds.other, 1.0)
        assert (follows >= least).all()
        assert ((follows < 0.05) == (least == 0.0)).all()


@pytest.mark.parametrize(("before", "stops"), [((-1.2, -1.16), True), ((0.7, -0.3), False), (None, False)])
def test_two_paths_that_followed_are_enough_to_tell_of_a_stop(before, stops):
    """The way's last half second, braked by 1.2 m/s^2: where both followed before, but not where they did as they liked
    all the time, nor where nothing is known."""
    toward, brake = np.array([AHEAD, [-1.93, 0.5, -0.1], ASIDE]), np.array([-1.2, 0.0, 0.0])
    rate = np.append(toward[:2] @ brake, 0.0)
    walked = MOTION[0] * 2.5  # as an acceleration over the same time
    found = _rates(
        toward, rate, [1, 2, 3], whole=rate + toward[:, 0] * walked, std=0.3, believed=np.array([walked, 0.0, 0.0])
    )  # fmt: skip
    if before is not None:
        was = _rates(toward[:2], before, [1, 2])
        found = egomotion.with_history(found, was, MOTION)
    log_prior, calm = -5.2, 0.03**2 * np.eye(2)
    starts = np.array([[0.0, 0.0], [-1.2, 0.0]])
    log_odds, change = egomotion.weigh_change(found, starts, calm, [CONSTANTS.liveliest**2 * np.eye(2)], log_prior)
    assert (log_odds > 0.0) == stops
    if stops:
        np.testing.assert_allclose(change, brake[:2], atol=0.3)
