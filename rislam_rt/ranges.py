"""Ranges of settings, said by their types (`sigma_a: Positive`), and the check of a record whose fields have such."""

import math
import operator
from collections.abc import Iterator
from functools import cache
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt

from rislam_rt.errors import ConfigError, RislamError

Positive = Annotated[float, Gt(0.0)]
NotNegative = Annotated[float, Ge(0.0)]
Probability = Annotated[float, Ge(0.0), Le(1.0)]
Share = Annotated[float, Gt(0.0), Le(1.0)]
"""Part of a whole, which may be the whole and not nothing."""
Chance = Annotated[float, Gt(0.0), Lt(1.0)]
"""Probability of what is neither certain nor impossible."""
Count = Annotated[int, Ge(1)]
WORDS = {"ge": "at least", "gt": "more than", "le": "at most", "lt": "less than"}
"""Kinds of bounds in words, by the name that the bound and the operator have."""


def check_ranges(section: str, record: Any, error: type[RislamError] = ConfigError) -> None:
    """Check that each field of a record is one of its type's choices, or a finite number in its type's range; None,
    where one may be left out, passes.

    Raises
    ------
    RislamError
        A value is not, or no number; of the kind `error`, with the line `section.name: value received; give ...`.
    """
    kind: type = type(record)
    for name, (choices, bounds) in _limits(kind).items():
        value = getattr(record, name)
        if value is None:
            continue
        if choices and value not in choices:
            raise error(f"{section}.{name}: '{value}' received; give one of {', '.join(choices)}")
        try:
            good = all(math.isfinite(value) and getattr(operator, word)(value, limit) for word, limit in bounds)
        except TypeError:
            raise error(f"{section}.{name}: {str(value)[:60]!r} received; give a number") from None
        if not good:
            wanted = " and ".join(f"{WORDS[word]} {limit:g}" for word, limit in bounds)
            raise error(f"{section}.{name}: {value} received; give {wanted}")


@cache
def _limits(record: type) -> dict[str, tuple[list[str], list[tuple[str, float]]]]:
    """Choices and bounds (kind and limit) of each field of a record."""
    said = {name: list(_said(kind)) for name, kind in get_type_hints(record, include_extras=True).items()}
    return {
        name: (
            [one for one in own if isinstance(one, str)],
            [(word, getattr(one, word)) for one in own for word in WORDS if hasattr(one, word)],
        )
        for name, own in said.items()
    }


def _said(kind: Any) -> Iterator[Any]:
    """All that a field's type says of its range, of one that may be left out, too: choices, and bounds."""
    if get_origin(kind) is Literal:
        yield from get_args(kind)
    yield from getattr(kind, "__metadata__", ())
    for part in get_args(kind):
        yield from _said(part)
