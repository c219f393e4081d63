"""Warnings of wall returns that a filter may take for others, before a run: cancelled, merged, of parallel fronts."""

from collections.abc import Iterator

from rislam_rt.adviser.cancelled_returns import cancelled_return_warnings
from rislam_rt.adviser.link_budget import Survey
from rislam_rt.adviser.merged_returns import merged_return_warnings
from rislam_rt.adviser.parallel_fronts import parallel_front_warnings
from rislam_rt.scene.findings import Finding


def return_warnings(looked: Survey, file: str) -> Iterator[Finding]:
    """All warnings of wall returns along a way that was looked at; `file` is what they name as their place."""
    yield from cancelled_return_warnings(looked, file)
    yield from merged_return_warnings(looked, file)
    yield from parallel_front_warnings(looked, file)
