"""Terminal table of the score cards of a study in unseen rooms."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from rislam_rt.report.unseen.files import unseen_content
from rislam_rt.report.unseen.page import ROWS
from rislam_rt.report.unseen.score_cards import by_series, read_runs
from rislam_rt.sweeps import Row


def print_cards(rows: Sequence[Row], timings: Sequence[Mapping[str, Any]]) -> None:
    """Print the score cards of a study in unseen rooms as a table, a column for each series."""
    cards = unseen_content(by_series(read_runs(rows)), timings)["cards"]
    columns = (Column(name, justify="right") for name in cards)
    table = Table("score", *columns, title="median (95 % interval); 95th percentile")
    for label, show in ROWS.items():
        table.add_row(escape(label), *(show(entry) for entry in cards.values()))
    Console().print(table, highlight=False)
