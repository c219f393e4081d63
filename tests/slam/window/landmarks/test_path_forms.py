"""Which legs of the map are possible: two walls at right angles, known as well as they are."""

import numpy as np
import pytest

from rislam_rt.slam.predicted_returns import TX, Poses, reflect
from rislam_rt.slam.window.landmarks.path_forms import enumerate_forms, possible_legs

RX, BASELINE = np.zeros(3), 0.1
DEPTH, HEIGHT = 9.0, 1.5


def ways_over_both(lean, std, tx):
    """Walls next to the Tx in the possible two-wall paths of a level ceiling (0) and an upright wall (1) that is
    estimated to lean by `lean` [rad] about its foot, with a deviation of `std` [rad]."""
    anchor = np.zeros((2, 3))
    normal = np.array([[0.0, 0.0, 1.0], [np.cos(lean), 0.0, np.sin(lean)]])
    reach = 2.0 * np.array([HEIGHT, DEPTH * np.cos(lean)])
    features = reach[:, None] * normal
    covariance = np.zeros((6, 6))
    covariance[5, 5] = (reach[1] * std) ** 2  # a mirror image turns with its wall
    legs = enumerate_forms((), (0, 1), 2)[0].legs
    fine = possible_legs(legs, features, covariance, anchor, Poses(tx, RX, np.zeros(())))
    return [int(wall) for base, wall, other in legs[fine] if base == TX and other >= 0], features, anchor


ACROSS, AWAY = np.array([0.0, BASELINE, 0.0]), np.array([-BASELINE, 0.0, 0.0])


@pytest.mark.parametrize("tx", [ACROSS, AWAY])
def test_a_right_angle_throws_one_path_back(tx):
    ways, features, anchor = ways_over_both(1e-6, 1e-3, tx)
    assert len(ways) == 1
    image = reflect(reflect(tx, features[0], anchor[0]), features[1], anchor[1])
    other = reflect(reflect(tx, features[1], anchor[1]), features[0], anchor[0])
    np.testing.assert_allclose(image, other, atol=1e-4)  # a millionth of a radian over some metres, twice


@pytest.mark.parametrize("tx", [ACROSS, AWAY])
def test_an_angle_that_is_not_told_hides_no_path(tx):
    leans = np.linspace(-4e-3, 4e-3, 41)
    known = np.array([len(ways_over_both(lean, 0.0, tx)[0]) for lean in leans])
    told = np.array([len(ways_over_both(lean, 3e-3, tx)[0]) for lean in leans])
    assert (known == 0).any()  # an obtuse angle throws nothing back to where it came from
    assert (known[np.abs(leans) > 3e-3] != 1).any()
    np.testing.assert_array_equal(told, np.maximum(known, 1))


def test_a_known_obtuse_angle_throws_none():
    assert any(ways_over_both(lean, 1e-4, ACROSS)[0] == [] for lean in (-0.02, 0.02))
