"""Frozen arrays: checked, read-only, and copied unless nobody can change them. Rows of several arrays together."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from rislam_rt.arrays import frozen, join_rows, take_rows
from rislam_rt.errors import GeometryError


def test_what_could_still_change_is_copied():
    own = np.arange(6.0).reshape(2, 3).copy()
    first = frozen(own, np.float64, (2, 3), "x")
    own[0, 0] = 9.0
    assert first[0, 0] == 0.0
    view = own[:1]
    view.flags.writeable = False
    second = frozen(view, np.float64, (1, 3), "x")
    own[0, 0] = 7.0
    assert second[0, 0] == 9.0
    with pytest.raises(ValueError, match="read-only"):
        second[0, 0] = 1.0


def test_what_cannot_change_is_taken_as_it_is():
    array = frozen(np.arange(3.0), np.float64, (3,), "x")
    assert frozen(array, np.float64, (None,), "x") is array
    assert frozen(array, np.complex128, (3,), "x").dtype == np.complex128


def test_checks_hold_for_both():
    array = np.array([0.0, np.nan])
    for writeable in (True, False):
        array.flags.writeable = writeable
        with pytest.raises(GeometryError, match=r"x: NaN at index \(1,\)"):
            frozen(array, np.float64, (2,), "x")
        with pytest.raises(GeometryError, match=r"x: shape \(2,\) received, \(3\) needed"):
            frozen(array, np.float64, (3,), "x")


@pytest.mark.parametrize("value", ["abc", {}, [[1.0], [2.0, 3.0]], [None, object()], [10**400]])
def test_what_is_no_array_of_numbers_is_refused_with_its_name(value):
    with pytest.raises(GeometryError, match=r"^x: .* received; give an array of float64$"):
        frozen(value, np.float64, (None,), "x")


@pytest.mark.parametrize("value", [1j, [1.0, 2j], np.ones(2, np.complex128), [np.complex128(2.0)]])
def test_complex_numbers_do_not_lose_their_imaginary_part(value):
    for dtype in (np.float64, np.int64):
        with pytest.raises(GeometryError) as found:
            frozen(value, dtype, (None,), "x")
        assert str(found.value) == "x: complex numbers received; give real ones (of an amplitude the modulus)"
    assert frozen([1.0, 2j], np.complex128, (2,), "x")[1] == 2j


class Ends(NamedTuple):
    first: Any
    last: Any


class Rays(NamedTuple):
    number: Any
    ends: Ends


def test_rows_of_arrays_within_arrays_are_taken_and_joined():
    rays = Rays(np.arange(3), Ends(np.arange(6.0).reshape(3, 2), np.array(["a", "b", "c"])))
    for rows in (np.array([2, 0]), np.array([False, True, True]), slice(1)):
        some = take_rows(rays, rows)
        assert isinstance(some.ends, Ends)
        np.testing.assert_array_equal(some.ends.first, rays.ends.first[rows])
        np.testing.assert_array_equal(join_rows([some, rays]).ends.last, [*rays.ends.last[rows], *"abc"])
