"""Association scored on answers of known quality."""

import numpy as np

from rislam_rt.evaluate import association_score

TRUTH = np.array([0, 1, 0, 1, -1, 0, 1, 2])


def test_labels_need_not_be_the_true_numbers():
    score = association_score(np.array([7, 3, 7, 3, -1, 7, 3, 9]), TRUTH)
    assert score == (1.0, 1.0, 1.0)


def test_a_swap_costs_what_it_swaps():
    score = association_score(np.array([7, 3, 7, 3, -1, 3, 7, 9]), TRUTH)
    assert score.accuracy == 6 / 8


def test_clutter_taken_and_landmark_left_cost_precision_and_recall():
    score = association_score(np.array([7, 3, 7, 3, 7, 7, 3, -1]), TRUTH)
    assert score.accuracy == 6 / 8
    assert score.precision == 6 / 7
    assert score.recall == 6 / 7


def test_one_label_for_two_identities_counts_once():
    score = association_score(np.zeros(8, dtype=int), TRUTH)
    assert score.accuracy == 3 / 8


def test_nothing_measured_is_nothing_wrong():
    assert association_score(np.zeros(0, dtype=int), np.zeros(0, dtype=int)).accuracy == 1.0
