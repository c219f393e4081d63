"""Planes: mirroring is an isometry and its own inverse; a plane is found again from a point and its image."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.planes import mirror, mirror_direction, plane_between, signed_distance

coordinate = st.floats(-20.0, 20.0)
point = st.tuples(coordinate, coordinate, coordinate).map(np.array)
normal = point.filter(lambda v: np.linalg.norm(v) > 0.1).map(unit)


@given(point, point, normal, coordinate)
def test_mirroring(p, q, n, offset):
    image = mirror(p, n, np.array(offset))
    assert signed_distance(image, n, np.array(offset)) == pytest.approx(
        -signed_distance(p, n, np.array(offset)), abs=1e-12
    )
    np.testing.assert_allclose(mirror(image, n, np.array(offset)), p, atol=1e-12)
    assert np.linalg.norm(image - mirror(q, n, np.array(offset))) == pytest.approx(np.linalg.norm(p - q), abs=1e-12)
    np.testing.assert_allclose(mirror_direction(q - p, n), mirror(q, n, np.array(offset)) - image, atol=1e-12)


@given(point, normal, coordinate)
def test_plane_between_a_point_and_its_image(p, n, offset):
    if abs(n @ p - offset) < 1e-3:
        return
    found, distance = plane_between(p, mirror(p, n, np.array(offset)))
    assert distance >= 0.0
    sign = np.sign(found @ n)
    np.testing.assert_allclose(sign * found, n, atol=1e-9)
    assert sign * distance == pytest.approx(offset, abs=1e-9)
