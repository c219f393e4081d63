"""What a cycle's components tell: innovations at the horizon, and labels of what explains them."""

from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.slam.window.cycle_explanation import _names, innovations
from rislam_rt.slam.window.measurement_log import empty_log


def test_a_level_ray_moves_nothing_where_it_is_reported_on_average():
    """Half of its reports lie on the rim of the unit disc, and those within it by 0.4 deviations in the mean."""
    std = 0.01
    inside = 1.0 - std / np.sqrt(2.0 * np.pi)
    groups = SimpleNamespace(leader=np.array([0]), partner=np.array([-1]), gap=np.zeros((1, 3)))
    expected = SimpleNamespace(seen=np.array([[5.0, 0.6, 0.8]]), jacobian=np.eye(3)[None])
    view = SimpleNamespace(row=np.array([0]), pick=np.array([0]), groups=groups, expected=expected)
    log = _log_of(np.array([[5.0, 0.6 * inside, 0.8 * inside]]), np.full((1, 3), std))
    left, slope, _ = innovations(view, log, np.ones(1, dtype=np.bool_), 7, 3, 0.5)
    np.testing.assert_allclose(left, 0.0, atol=1e-9)
    assert std * slope[0, 1:, 1:] @ [0.6, 0.8] @ [0.6, 0.8] == pytest.approx(0.5)
    np.testing.assert_array_equal(expected.jacobian, np.eye(3)[None])  # another cycle's map asks it again


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_side_on_which_a_level_ray_is_reported_moves_nothing(side):
    """Along the array's own line the receiver takes now the one end and now the other, and says so."""
    groups = SimpleNamespace(leader=np.array([0]), partner=np.array([-1]), gap=np.zeros((1, 3)))
    expected = SimpleNamespace(seen=np.array([[5.0, 0.9995, 0.02]]), jacobian=np.eye(3)[None])
    view = SimpleNamespace(row=np.array([0]), pick=np.array([0]), groups=groups, expected=expected)
    log = _log_of(np.array([[5.0, side * 0.9995, 0.02]]), np.array([[0.01, 0.9, 0.003]]))
    left, _, _ = innovations(view, log, np.ones(1, dtype=np.bool_), 7, 3, 0.5)
    assert np.abs(left).max() < 2e-3  # what is left of a period, 1e-3, of a deviation of 0.9


def _log_of(seen, std):
    """Log of components (A, 3) of cycle 7 that are associated with paths alone."""
    count = len(seen)
    log, none = empty_log(), np.zeros(count)
    return log._replace(
        cycle=np.full(count, 7), share=none, seen=seen, std=std, extra=np.zeros((count, 3)),
        shared=np.zeros((count, 3)),
    )  # fmt: skip


def test_labels_tell_points_images_walls_and_pairs_of_walls_apart():
    landmarks = SimpleNamespace(ident=np.array([4, 9, 0, 7]))  # a point, and three walls
    point, one, two, three, none, tx = 0, 1, 2, 3, -1, -1
    alike = [
        [[point, none, none, none, none]],
        [[point, one, none, none, none], [point, two, none, one, none], [point, none, none, one, two]],
        [[point, none, none, two, none]],
        [[tx, none, none, one, none]],
        [[tx, none, none, two, none]],
        [[tx, none, none, one, two], [tx, none, none, two, one]],
        [[tx, none, none, three, two], [tx, none, none, two, three]],
        [[tx, none, none, one, three], [tx, none, none, three, one]],
    ]
    found = [_names(landmarks, np.array(forms)) for forms in alike]
    assert all(len(set(names.tolist())) == 1 for names in found)
    assert len({int(names[0]) for names in found}) == len(alike)
    assert not len(_names(landmarks, np.zeros((0, 5), dtype=np.int64)))
