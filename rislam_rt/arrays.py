"""Arrays: their types, checks of dtype, shape and NaN that frozen dataclasses make of their fields, blocks of rows, and
rows of several arrays together."""

from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rislam_rt.errors import GeometryError

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
Columns = TypeVar("Columns", bound=tuple[Any, ...])
"""Named tuple of arrays with as many rows each; some may be such tuples themselves."""


def frozen(value: ArrayLike, dtype: Any, shape: tuple[int | None, ...], name: str) -> NDArray[Any]:
    """Return a value as a read-only array of the given type and shape (`None` matches any length).

    A copy, unless the value is such an array already and owns its memory: then nobody can change it.

    Raises
    ------
    GeometryError
        The value is no array of that type, complex where real ones are wanted, has another shape, or holds a NaN.
    """
    if isinstance(value, np.ndarray) and value.dtype == dtype and value.base is None and not value.flags.writeable:
        array = value
    else:
        try:
            if np.dtype(dtype).kind != "c" and np.iscomplexobj(value):
                raise GeometryError(f"{name}: complex numbers received; give real ones (of an amplitude the modulus)")
            array = np.array(value, dtype=dtype)
        except (TypeError, ValueError, OverflowError):
            what = " ".join(repr(value).split())[:60]
            raise GeometryError(f"{name}: {what} received; give an array of {np.dtype(dtype)}") from None
    if array.shape != shape and not _fits(array.shape, shape):
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise GeometryError(f"{name}: shape {array.shape} received, ({wanted}) needed")
    if array.dtype.kind in "fc" and np.isnan(array).any():
        raise GeometryError(
            f"{name}: NaN at index {tuple(int(i) for i in np.argwhere(np.isnan(array))[0])}; give finite numbers"
        )
    array.flags.writeable = False
    return array


def phasor(phase: ArrayLike) -> Complexes:
    """Array `exp(j phase)` (...,) of phases (...,) [rad] to 3e-16, from the tangent of half the phase: numpy's own sine
    and cosine take ten times as long."""
    half = np.tan(0.5 * np.asarray(phase, dtype=np.float64))
    square = half * half
    found = np.empty(half.shape, dtype=np.complex128)
    found.real, found.imag = (1.0 - square) / (1.0 + square), 2.0 * half / (1.0 + square)
    return found


def cross(a: ArrayLike, b: ArrayLike) -> Floats:
    """Cross products (..., 3) of arrays of vectors (..., 3), to the bit numpy's own, which for a few takes thrice as
    long."""
    one, other = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    x, y, z, u, v, w = *(one[..., i] for i in range(3)), *(other[..., i] for i in range(3))
    first = y * w - z * v
    found = np.empty((*first.shape, 3))
    found[..., 0] = first
    found[..., 1] = z * u - x * w
    found[..., 2] = x * v - y * u
    return found


def distinct_rows(rows: NDArray[Any]) -> tuple[Integers, Integers, Integers]:
    """Distinct rows (U,) among rows (N, M) of numbers, in lexicographic order: the number of the first that is one, by
    row (N,) which it is, and how many are (U,). What `np.unique` says along an axis takes several times as long."""
    order = np.lexsort(rows.T[::-1]) if rows.shape[1] else np.arange(len(rows))
    ranked, is_new = rows[order], np.ones(len(rows), dtype=np.bool_)
    is_new[1:] = (ranked[1:] != ranked[:-1]).any(axis=1)
    which = np.empty(len(rows), dtype=np.int64)
    which[order] = np.cumsum(is_new) - 1
    begin = np.flatnonzero(is_new)
    return order[begin], which, np.diff(np.append(begin, len(rows)))


def show_point(point: ArrayLike) -> str:
    """Text of an array of three coordinates with four digits, for messages: `(0.5, 0.7, 0.5)`."""
    return f"({', '.join(f'{value:.4g}' for value in np.asarray(point))})"


def _fits(have: tuple[int, ...], want: tuple[int | None, ...]) -> bool:
    """Whether an array's shape is the wanted one, in which `None` matches any length."""
    return len(have) == len(want) and all(w in (None, h) for w, h in zip(want, have, strict=True))


def freeze(record: Any, dtype: Any, **shapes: tuple[int | None, ...]) -> None:
    """Replace fields of a frozen dataclass by checked, read-only arrays of a type and shapes (for `__post_init__`)."""
    for name, shape in shapes.items():
        label = f"{type(record).__name__}.{name}"
        object.__setattr__(record, name, frozen(getattr(record, name), dtype, shape, label))


def row_blocks(count: int, width: int, most: int = 2_000_000, least: int = 1) -> list[slice]:
    """Slices of an array's rows of `width` numbers, so that one holds about `most`, `least` rows or more."""
    step = max(least, most // max(width, 1))
    return [slice(first, min(first + step, count)) for first in range(0, count, step)]


def take_rows(columns: Columns, rows: Any) -> Columns:
    """The named tuple with some rows of each of its arrays, by number, mask or slice."""
    make: Any = type(columns)._make  # type: ignore[attr-defined]
    taken: Columns = make(take_rows(one, rows) if isinstance(one, tuple) else one[rows] for one in columns)
    return taken


def join_rows(parts: Iterable[Columns]) -> Columns:
    """One named tuple of the arrays of several, one or more, the rows of each array under those of the one before."""
    first, *more = parts
    make: Any = type(first)._make  # type: ignore[attr-defined]
    fields = zip(first, *more, strict=True)
    joined: Columns = make(join_rows(each) if isinstance(each[0], tuple) else np.concatenate(each) for each in fields)
    return joined
