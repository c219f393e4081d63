"""Spelling suggestions: known words that are spelled nearly like an unknown one; numbers of things in words."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

LEAST_LIKE = 0.75
"""Least similarity (share of letters in common) of two spellings of one word; `num_particles` and `num_samples` have
0.67."""


def nearest(word: str, known: Iterable[str], most: int = 1) -> list[str]:
    """Known words that are spelled nearly like a given word, the nearest first, at most `most` of them."""
    return get_close_matches(word, list(known), n=most, cutoff=LEAST_LIKE)


def did_you_mean(near: Sequence[str]) -> str:
    """Question `did you mean 'x' or 'y'?` for an error message from suggested words; empty if there are none."""
    return f"did you mean {' or '.join(repr(word) for word in near)}?" if near else ""


def counted(number: int, thing: str) -> str:
    """Spelling of a number of things: `1 error`, `2 errors`."""
    return f"{number} {thing}{'' if number == 1 else 's'}"
