"""What a track may be: each kind finds the truth within its own covariance, and costs least for its own data."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import chi2

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import normalised_squares
from rislam_rt.model import Body
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.nested.birth import BirthContext, judge_wall
from rislam_rt.slam.nested.hypotheses import (
    IMAGE,
    MOVING,
    POINT,
    RECIPROCAL,
    TWIN,
    Fit,
    History,
    fit_doubles,
    fit_feature,
    fit_floor,
    fit_reciprocal,
    initial_value,
    plausible,
)
from rislam_rt.slam.nested.landmark_table import empty_table
from rislam_rt.slam.returns import NONE, TX, Returns, observe, reflect

BODY = Body()
CYCLES, STD = 40, np.array([0.004, 0.004, 0.004])
ANCHOR = np.array([0.5, 0.7, 0.5])
PARENT = np.array([2.0, 1.0, 1.0])
ROOF = ANCHOR + 5.0 * np.array([0.5, 0.0, np.sqrt(0.75)])
"""A slanted roof as the image of the anchor."""
FLOOR = np.array([0.5, 0.7, -0.5])
"""The floor at z = 0."""
FREE = {"point": POINT, "image": IMAGE, "twin": TWIN, "moving image": MOVING}
SOUGHT = {"point": np.array([1.5, 3.0, 2.0]), "image": ROOF, "twin": ROOF, "moving image": ROOF}
SEEDS = 40


class Case(NamedTuple):
    """A track and what may be known with it."""

    history: History
    parent: Floats


def draw(kind: Returns, feature: Floats, *, rng: np.random.Generator) -> Case:
    """Forty cycles on an arc of 1.5 m, so that parallax tells what the range is measured from."""
    turn = np.linspace(0.0, 1.5, CYCLES)
    position = ANCHOR + np.stack([np.sin(turn), 1.0 - np.cos(turn), np.zeros(CYCLES)], axis=1)
    poses = poses_of(position, turn, BODY)
    seen = observe(kind, np.stack([feature, PARENT]), np.stack([ANCHOR, ANCHOR]), poses).seen.mean(axis=-2)
    seen = seen + STD * rng.standard_normal(seen.shape)
    return Case(History(seen, np.tile(STD, (CYCLES, 1)), poses, np.zeros(CYCLES), 0.0, np.zeros((6, 0))), PARENT)


def fitted(kind: Returns, case: Case) -> Fit | None:
    """The best of one kind."""
    if kind is RECIPROCAL:
        return fit_reciprocal(case.parent, ANCHOR, case.history)
    parent = None if kind is POINT or kind is MOVING else case.parent
    first = initial_value(kind, parent, ANCHOR, case.history)
    return None if first is None else fit_feature(kind, first, parent, ANCHOR, case.history, 10)


@pytest.mark.parametrize("name", FREE)
def test_finds_the_truth_within_its_own_covariance(name: str) -> None:
    """Mean squared error over 40 seeds, normalised by the covariance that the fit gives, against chi^2 at 99.9 %.

    Student's t trusts Gaussian data a little too little: its estimate varies by 1 / 0.91 of the best one's, and the
    weights in its covariance, 7 / (4 + chi^2), average 1.1: up to 1.2 is what the method costs, and is allowed.
    """
    squares, accepted = [], 0
    for seed in range(SEEDS):
        case = draw(FREE[name], SOUGHT[name], rng=np.random.default_rng([1, seed]))
        fit = fitted(FREE[name], case)
        assert fit is not None
        squares.append(float(normalised_squares(fit.feature - SOUGHT[name], fit.covariance)))
        accepted += plausible(fit, CYCLES, 3)
    lower, upper = chi2.interval(0.999, 3 * SEEDS)
    assert lower < sum(squares) < 1.2 * upper
    # a bound of 2.5 standard deviations turns about one in a hundred of the right ones away, four in forty hardly ever
    assert accepted > SEEDS - 4


def test_floor_is_found_within_its_own_deviation() -> None:
    """Height alone, from lengths over the Tx leg: chi^2 with one degree of freedom over 40 seeds, two-sided 99.9 %.

    The covariance doubles the deviation of the height, as the image moves twice as far.
    """
    squares = []
    for seed in range(SEEDS):
        case = draw(RECIPROCAL, FLOOR, rng=np.random.default_rng([2, seed]))
        fit = fit_floor(case.parent, ANCHOR, case.history)
        assert fit is not None
        squares.append((fit.feature[2] - FLOOR[2]) ** 2 / fit.covariance[2, 2])
        np.testing.assert_array_equal(fit.feature[:2], ANCHOR[:2])
    lower, upper = chi2.interval(0.999, SEEDS)
    assert lower < sum(squares) < upper


def test_reciprocal_explains_its_own_lengths() -> None:
    """Lengths alone leave walls free that serve as well, so that not the wall is asked for but what it predicts."""
    for seed in range(10):
        case = draw(RECIPROCAL, ROOF, rng=np.random.default_rng([3, seed]))
        fit = fitted(RECIPROCAL, case)
        assert fit is not None
        assert plausible(fit, CYCLES, 3)
        known = np.stack([fit.feature, PARENT])
        seen = observe(RECIPROCAL, known, np.stack([ANCHOR, ANCHOR]), case.history.poses).seen[:, 0]
        # forty lengths of 4 mm leave 4 mm * sqrt(3 / 40) of error along them; four of those
        truth = observe(RECIPROCAL, np.stack([ROOF, PARENT]), np.stack([ANCHOR, ANCHOR]), case.history.poses)
        assert np.sqrt(np.mean((seen[:, 0] - truth.seen[:, 0, 0]) ** 2)) < 4.0 * 0.004 * np.sqrt(3.0 / 40.0)


@pytest.mark.parametrize("name", [*FREE, "reciprocal"])
def test_costs_least_for_its_own_data(name: str) -> None:
    """Each kind against every other, by more than the margin of 9 that a birth asks for, in every one of ten seeds.

    A point behind the roof mirrors all that an image over the Rx leg shows but the length of the Tx leg: the arc
    changes that by centimetres, against 4 mm in each of forty lengths.
    """
    kinds = {**FREE, "reciprocal": RECIPROCAL}
    feature = SOUGHT.get(name, ROOF)
    for seed in range(10):
        case = draw(kinds[name], feature, rng=np.random.default_rng([4, seed]))
        fits = {other: fitted(kind, case) for other, kind in kinds.items()}
        own = fits.pop(name)
        assert own is not None
        for other, fit in fits.items():
            assert fit is None or fit.cost > own.cost + 9.0, other


def test_floor_costs_no_more_than_a_free_wall_for_data_of_a_floor() -> None:
    """With two numbers fewer it may cost what they save: chi^2 with two degrees of freedom, 99.9 %: 13.8."""
    for seed in range(10):
        case = draw(RECIPROCAL, FLOOR, rng=np.random.default_rng([5, seed]))
        free, level = fit_reciprocal(PARENT, ANCHOR, case.history), fit_floor(PARENT, ANCHOR, case.history)
        assert free is not None
        assert level is not None
        assert level.cost < free.cost + 13.8
        assert plausible(level, CYCLES, 1)
    # and a roof is no floor
    assert fit_floor(PARENT, ANCHOR, draw(RECIPROCAL, ROOF, rng=np.random.default_rng(0)).history) is None or not (
        plausible(fit_floor(PARENT, ANCHOR, draw(RECIPROCAL, ROOF, rng=np.random.default_rng(0)).history), CYCLES, 1)
    )


def test_a_wrong_speed_does_not_speak_against_the_truth() -> None:
    """With the pose's uncertainty fitted along, a point stays plausible when the believed trail drifts by 0.03 m/s.

    And its own covariance covers what the drift did to it: chi^2, 3 degrees of freedom, 99.9 %: 16.3.
    """
    case = draw(POINT, SOUGHT["point"], rng=np.random.default_rng(6))
    lag = 0.1 * np.arange(CYCLES)[::-1]
    drift = np.array([0.03, -0.02, 0.0]) * -lag[:, None]
    poses = case.history.poses._replace(tx=case.history.poses.tx + drift, rx=case.history.poses.rx + drift)
    uncertainty = np.diag([0.01, 0.01, 0.0, 0.03, 0.03, 0.0])[:, [0, 1, 3, 4]]
    wrong = case.history._replace(poses=poses, lag=lag)
    blind, open_ = (fitted(POINT, Case(h, PARENT)) for h in (wrong, wrong._replace(uncertainty=uncertainty)))
    assert blind is not None
    assert open_ is not None
    assert not plausible(blind, CYCLES, 3)
    assert plausible(open_, CYCLES, 3)
    assert normalised_squares(open_.feature - SOUGHT["point"], open_.covariance) < 16.3


def test_outliers_move_a_fit_little() -> None:
    """Two measurements of forty that are off by a hundred deviations: least squares would move by 5 % of 0.4 m."""
    case = draw(POINT, SOUGHT["point"], rng=np.random.default_rng(7))
    seen = case.history.seen.copy()
    seen[[5, 20]] += 100.0 * STD
    fit = fitted(POINT, Case(case.history._replace(seen=seen), PARENT))
    assert fit is not None
    assert np.linalg.norm(fit.feature - SOUGHT["point"]) < 0.01


def test_a_floor_mirrors_what_it_should() -> None:
    """The scene itself: the floor's image of the parent lies as far below it as the parent above."""
    np.testing.assert_allclose(reflect(PARENT, FLOOR, ANCHOR), PARENT * [1.0, 1.0, -1.0], atol=1e-12)


def test_a_point_is_known_as_well_where_the_agent_is_not() -> None:
    """An error of the position moves the point along and leaves its own covariance; one of the speed does not."""
    history = draw(POINT, SOUGHT["point"], rng=np.random.default_rng(3)).history
    history = history._replace(lag=np.linspace(4.0, 0.0, CYCLES))
    fits = []
    for position, velocity in ((0.0, 0.0), (1.0, 0.0), (0.0, 0.02)):
        uncertainty = np.diag([position, position, 0.0, velocity, velocity, 0.0])[:, [0, 1, 3, 4]]
        first = initial_value(POINT, None, ANCHOR, history)
        assert first is not None
        fits.append(fit_feature(POINT, first, None, ANCHOR, history._replace(uncertainty=uncertainty), 10))
    spread = [np.sqrt(np.linalg.eigvalsh(fit.covariance)[-1]) for fit in fits]
    np.testing.assert_allclose(spread[1], spread[0], rtol=0.1)
    assert spread[2] > 1.2 * spread[0]


DOUBLES = {
    "opposite": (np.array([0.5, -1.3, 0.5]), np.array([0.5, 10.7, 0.5])),
    "edge": (np.array([9.5, 0.7, 0.5]), np.array([0.5, 0.7, 5.5])),
    "corner": (np.array([9.5, 0.7, 0.5]), np.array([0.5, -1.3, 0.5])),
}
"""Two walls of a room of 5 x 6 x 3 m, as images of the anchor."""


def double(name: str, reach: float, *, rng: np.random.Generator) -> History:
    """What both walls throw together, on an arc that begins along x and turns by `reach` [rad]."""
    kind = Returns(np.array([[TX, NONE, NONE], [TX, 0, 1]]), np.array([0]), np.array([1]))
    turn = np.linspace(0.0, reach, CYCLES)
    position = ANCHOR + np.stack([np.sin(turn), 1.0 - np.cos(turn), np.zeros(CYCLES)], axis=1)
    poses = poses_of(position, turn, BODY)
    seen = observe(kind, np.stack(DOUBLES[name]), np.stack([ANCHOR, ANCHOR]), poses).seen[:, 0]
    seen = seen + STD * rng.standard_normal(seen.shape)
    return History(seen, np.tile(STD, (CYCLES, 1)), poses, np.zeros(CYCLES), 0.0, np.zeros((6, 0)))


@pytest.mark.parametrize(("name", "place"), [("opposite", 0), ("edge", 1), ("corner", 2)])
def test_what_two_walls_throw_is_told_from_a_wall_and_a_point(name: str, place: int) -> None:
    """On a curve, its own hypothesis costs what noise costs; the image in one wall costs more by far more than 9."""
    for seed in range(5):
        history = double(name, 0.8, rng=np.random.default_rng([9, seed]))
        wall = initial_value(MOVING, None, ANCHOR, history)
        assert wall is not None
        fit = fit_doubles(wall, ANCHOR, history)[place]
        assert plausible(fit, CYCLES, 2)
        assert fit_feature(MOVING, wall, None, ANCHOR, history, 10).cost > fit.cost + 100.0


def shown(*images: Floats) -> BirthContext:
    """A judgement where the agent sees itself in so many mirrors."""
    mirrored = np.array(images).reshape(-1, 3)
    return BirthContext(np.zeros((0, 3)), empty_table(), ANCHOR, None, mirrored, SlamConfig())  # type: ignore[arg-type]


def test_a_wall_is_not_born_before_its_image_moves_as_one_walls_does() -> None:
    """Along opposite walls the image that both throw together looks like that in one, until the agent turns.

    The nearer image from the same side is what makes it suspect: without one it can only be a single wall's.
    """
    near, far = DOUBLES["opposite"]
    scene = shown(near, far)
    rng = np.random.default_rng(10)
    straight = double("opposite", 0.03, rng=rng)
    wall = initial_value(MOVING, None, ANCHOR, straight)
    assert wall is not None
    assert plausible(fit_feature(MOVING, wall, None, ANCHOR, straight, 10), CYCLES, 3)
    assert judge_wall(straight, scene) is None
    for harmless in (shown(), shown(wall), shown(ANCHOR + np.array([4.0, 0.0, 0.0]))):
        assert judge_wall(straight, harmless) is not None
    case = draw(MOVING, ROOF, rng=rng)
    verdict = judge_wall(case.history, scene)
    assert verdict is not None
    assert np.linalg.norm(verdict.fit.feature - ROOF) < 0.05
