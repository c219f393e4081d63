"""The log's components and the poses of the window that they were heard at."""

import numpy as np

from rislam_rt.model import Body, RadioConfig, SensorModel
from rislam_rt.slam import SlamConfig
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.predicted_returns import NONE, TX
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.window import init
from rislam_rt.slam.window.landmarks.landmark_table import empty_table, enter
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.landmarks.ris_identification import unknown
from rislam_rt.slam.window.measurement_log import append, empty_log, scatter_variance, squares
from rislam_rt.slam.window.motion.motion_learning import assumed_precision
from rislam_rt.slam.window.relinearisation import relinearise
from rislam_rt.slam.window.smoother import window_features, window_gaussian
from rislam_rt.slam.window.smoother.direction_priors import no_holds

BODY = Body(np.array([-0.05, 0.0, 0.0]), np.array([0.05, 0.0, 0.0]))
SCENE = KnownEnvironment(BODY, RadioConfig(), SensorModel(RadioConfig()), None, 2, True)


def test_a_cycle_in_which_nothing_was_heard_takes_nothing_of_the_one_before():
    window = window_gaussian.begin(np.zeros(3), np.zeros(3), np.full(7, 0.1))
    window = window_features.add_feature(window, np.array([4.0, 0.0, 0.0]), no_holds())
    window = window_gaussian.extend(window, 0.1, np.ones(3))
    landmarks = enter(empty_table(), True, np.zeros(3), 5, 5.0, unknown(1))
    observed = Observations(
        np.array([[4.0, 1.0, 0.0]]), np.full((1, 3), 0.01), np.zeros(1), np.full(1, 0.1), np.ones(1)
    )
    form = np.array([[[TX, NONE, NONE, 0, NONE], [UNKNOWN] * 5]])
    log = append(empty_log(), observed, 3, 0).explain(np.array([0]), form, 0.0, 0.0, np.zeros((1, 3)))
    state = init(
        StartPrior(np.zeros(3), np.zeros(3), 0.01, 0.01, 0.0), BODY, None, SCENE.sensor, SlamConfig(),
        rng=np.random.default_rng(0),
    )._replace(window=window, log=log, landmarks=landmarks, heading=np.zeros(2), attitude=np.zeros((2, 3)))  # fmt: skip
    for cycle, heard in ((3, True), (4, False)):
        found, left = relinearise(state._replace(cycle=cycle), 1)
        assert len(left.row) == heard
        assert found.window.slots.hessian[-1].any() == heard
    # the whole window then: it is the pose before that heard it
    found, left = relinearise(state._replace(cycle=4), 0)
    np.testing.assert_array_equal(left.slot, [0])


def test_told_motion_has_a_rate_of_turn_once_the_compass_was_found_wrong():
    config = SlamConfig(motion="told", sigma_a=0.1, turn_std=0.02)
    assert len(assumed_precision(config, 0.1, False)) == 3
    np.testing.assert_allclose(assumed_precision(config, 0.1, True)[3], 0.1 / 0.02**2)


def test_what_a_residual_has_lost_to_the_estimate_is_given_back():
    """Ten measurements of one number and its mean: errors of nine deviations squared, whatever the residuals show."""
    rng, count, loud = np.random.default_rng(5), 10, 9.0
    log = empty_log()
    observed = Observations(*(np.ones((count, 3)),) * 2, *(np.zeros(count),) * 3)
    log = append(log, observed, 0, 0)
    extra = np.full((count, 3), loud - 1.0)
    log = log._replace(extra=extra, shared=extra)
    error = np.sqrt(loud) * rng.standard_normal((4000, count, 3))
    left = (error - error.mean(axis=1, keepdims=True)) / np.sqrt(loud)
    rows = np.arange(count)
    found = np.mean([squares(rows, each, log, np.full((count, 3), 1.0 / count)) for each in left])
    short = np.mean([squares(rows, each, log, 0.0) for each in left])
    # 4000 x 30 squares, each of variance 2 loud^2
    assert found == np.clip(found, loud - 0.15, loud + 0.15)
    assert short == np.clip(short, 0.9 * loud - 0.15, 0.9 * loud + 0.15)


def test_what_a_motion_explains_that_is_held_for_none_is_no_error():
    """Residuals that are the sum of an error of nine deviations squared and of what a motion does, four times that: in
    the mean the error's square; a long residual is for the most part motion."""
    rng, count, loud, excess = np.random.default_rng(6), 10, 9.0, 4.0
    log = append(empty_log(), Observations(*(np.ones((count, 3)),) * 2, *(np.zeros(count),) * 3), 0, 0)
    extra = np.full((count, 3), loud - 1.0)
    log, rows = log._replace(extra=extra, shared=extra), np.arange(count)
    left = np.sqrt(1.0 + excess) * rng.standard_normal((4000, count, 3))
    found = np.mean([squares(rows, each, log, 0.0, np.full((count, 3), excess)) for each in left])
    assert found == np.clip(found, loud - 0.15, loud + 0.15)  # as above
    long = squares(rows, np.full((count, 3), 30.0), log, 0.0, np.full((count, 3), excess))
    np.testing.assert_allclose(long, loud * (900.0 / 25.0 + 0.8))


def test_scatter_that_keeps_its_sign_counts_once_in_its_own_cycle():
    log = empty_log()._replace(
        std=np.full((1, 3), 0.002),
        shared=np.zeros((1, 3)),
        extra=scatter_variance(np.array([9.0]), np.full((1, 3), 0.002)),
    )
    found = log.sharper(np.array([0]))
    np.testing.assert_allclose(found**2, (1.0 + CONSTANTS.memory * 8.0) / 9.0)


def _at_the_end(cosines, deviation):
    """Log of as many components of one track, whose second cosine is near the end of the array's axis."""
    seen = np.column_stack([np.full(len(cosines), 1.8), np.full(len(cosines), -0.0115), cosines])
    log = empty_log()._replace(seen=seen, std=np.tile([2e-4, 3e-4, deviation], (len(cosines), 1)))
    others = [name for name in log._fields if name not in ("std", "seen")]
    return log._replace(**{name: np.zeros((len(cosines), *getattr(log, name).shape[1:])) for name in others})


def test_a_direction_that_may_be_one_of_two_counts_from_both_ends():
    """A wall along the array's own line: the cosine reads 1 or -1, its deviation a share of the period between."""
    turns, rows, none = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0]), np.arange(6), np.zeros(6, dtype=np.int64)
    for cosine, deviation, both in ((0.9998 * turns, 0.9, True), (0.9998 + 0.0 * turns, 0.9, True),
                                    (0.9998 * turns, 0.02, False), (0.5 * turns, 0.9, False)):  # fmt: skip
        found = _at_the_end(cosine, deviation).both_ends(rows, none, 0.5)
        assert found.owner.tolist() == ([0, 0] if both else [0])
        if both:
            np.testing.assert_allclose(found.cosines[found.which == 0, 1], 0.9998, atol=2e-4)
            np.testing.assert_allclose(found.cosines[found.which == 1, 1], -0.9998, atol=2e-4)
            np.testing.assert_array_equal(found.cosines[:, 0], -0.0115)
            # the other axis tells how much a cosine errs, of whose sign nothing is known
            np.testing.assert_array_equal(found.std, 3e-4)
            np.testing.assert_array_equal(found.row, np.tile(rows, 2))


def test_which_side_a_level_cosine_comes_to_lie_on_is_no_news():
    """Its residual is the same from either side, unless its deviation says that the side is known."""
    seen, predicted = np.array([0.9998, -0.9998, 0.9998, 0.3]), np.array([0.999, 0.999, -0.999, -0.8])
    left = np.column_stack([np.full(4, 0.01), seen - predicted])
    found = _at_the_end(seen, 0.9).nearest(np.arange(4), left, 0.5)
    np.testing.assert_allclose(found[:, 1], [8e-4, 1.2e-3, -1.2e-3, 1.1], atol=1e-12)
    for log, spacing in ((_at_the_end(seen, 0.02), 0.5), (_at_the_end(seen, 0.9), 0.4)):  # known, or out of the sky
        np.testing.assert_array_equal(log.nearest(np.arange(4), left, spacing), left)
    np.testing.assert_array_equal(found[:, 0], 0.01)


def test_only_tracks_at_the_end_of_an_axis_have_two_directions():
    log = _at_the_end(np.array([0.9998, 0.3, -0.9998, 0.3]), 0.9)
    found = log.both_ends(np.arange(4), np.array([0, 1, 0, 1]), 0.5)
    assert found.owner.tolist() == [0, 1, 0]
    assert found.row.tolist() == [0, 1, 2, 3, 0, 2]
