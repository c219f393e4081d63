"""Markdown of the studies' pages: paragraphs, pictures, tables, and their cells with lengths, ratios and shares."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rislam_rt.input_messages import share_text


def table_lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table."""
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]


def picture(figure: str | None, words: str) -> list[str]:
    """Lines of Markdown that show a picture file; none if `figure` is None."""
    return [f"![{words}]({figure})", ""] if figure is not None else []


def paragraph(text: str) -> list[str]:
    """Wrap a text to the lines of a Markdown paragraph."""
    return textwrap.wrap(" ".join(text.split()), 118, break_long_words=False, break_on_hyphens=False)


NOTHING = "-"
"""Table cell without a value."""


def metres(value: float | None) -> str:
    """Table cell in Markdown: a length in metres with three decimals."""
    return NOTHING if value is None or np.isnan(value) else f"{value:.3f}"


def metres_between(entry: Mapping[str, Any], name: str = "rmse") -> str:
    """Table cell in Markdown: an entry's error in metres with its interval."""
    value, low, high = (entry[f"{name}{end}_m"] for end in ("", "_low", "_high"))
    return metres(value) if value is None or low is None else between(value, low, high)


def between(value: float, low: float, high: float, digits: int = 3) -> str:
    """Table cell in Markdown: a number with its interval."""
    return f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def ratio(value: float | None) -> str:
    """Table cell in Markdown: a ratio with two decimals."""
    return NOTHING if value is None else f"{value:.2f}"


def percent_between(entry: Mapping[str, Any], name: str) -> str:
    """Table cell in Markdown: a share of an entry in percent with its interval."""
    if entry[name] is None:
        return NOTHING
    found = (entry[name + end] for end in ("", "_low", "_high"))
    value, low, high = (np.nan if part is None else 100 * part for part in found)
    return f"{value:.0f} % ({low:.0f} to {high:.0f})"


def percent(value: float | None) -> str:
    """Table cell in Markdown: a share in percent."""
    return NOTHING if value is None else share_text(value).replace("%", " %")
