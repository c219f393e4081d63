"""Markdown of the pages: paragraphs, tables, pictures."""

import textwrap
from collections.abc import Sequence


def table_lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """A table, a line a row."""
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]


def picture(figure: str | None, words: str) -> list[str]:
    """A picture, if there is one."""
    return [f"![{words}]({figure})", ""] if figure is not None else []


def paragraph(text: str) -> list[str]:
    """A paragraph in lines of readable length."""
    return textwrap.wrap(" ".join(text.split()), 118, break_long_words=False, break_on_hyphens=False)
