"""Scores of a run on the terminal, with the warnings that belong to them."""

from collections.abc import Mapping
from typing import Any

from rislam_rt.cli.verbosity import warn


def show_scores(summary: Mapping[str, Any]) -> None:
    """Print the scores of a run from its summary, then its warnings on the error stream."""
    from rislam_rt.report.terminal_tables import print_summary

    print_summary(summary)
    for line in summary["warnings"]:
        warn(line)
