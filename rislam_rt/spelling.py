"""Spelling: what somebody may have meant by a word that is not known."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

LEAST_LIKE = 0.75
"""Share of letters that two spellings of one word have in common; `num_particles` and `num_samples` have 0.67."""


def nearest(word: str, known: Iterable[str], most: int = 1) -> list[str]:
    """Of the known words those with nearly that spelling, the nearest first."""
    return get_close_matches(word, list(known), n=most, cutoff=LEAST_LIKE)


def did_you_mean(near: Sequence[str]) -> str:
    """Question about a word's spelling in an error's line; empty if nothing is near."""
    return f"did you mean {' or '.join(repr(word) for word in near)}?" if near else ""
