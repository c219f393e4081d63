"""Markdown of the studies' pages: paragraphs, tables, pictures."""

import textwrap
from collections.abc import Sequence


def table_lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table."""
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]


def picture(figure: str | None, words: str) -> list[str]:
    """Lines of Markdown that show a picture file; none if `figure` is None."""
    return [f"![{words}]({figure})", ""] if figure is not None else []


def paragraph(text: str) -> list[str]:
    """Wrap a text to the lines of a Markdown paragraph."""
    return textwrap.wrap(" ".join(text.split()), 118, break_long_words=False, break_on_hyphens=False)
