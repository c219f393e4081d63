"""Scores of a run on the terminal, and its warnings."""

from collections.abc import Mapping
from typing import Any

from rislam_rt.cli.verbosity import warn


def show_scores(summary: Mapping[str, Any]) -> None:
    """Print the table of a run's scores, then its warnings on the error stream; `summary` as `summarise` returns it."""
    from rislam_rt.report.terminal_tables import print_summary

    print_summary(summary)
    for line in summary["warnings"]:
        warn(line)
