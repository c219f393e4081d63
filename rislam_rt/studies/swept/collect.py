"""Collecting the cells of a swept study as numbers with intervals. Failures are counted, never dropped."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import Interval, bootstrap, bootstrap_ratio, rms_over_runs
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.sweeps import Row
from rislam_rt.sweeps.store import DONE, MISSING

LEVEL = 0.95
"""Confidence of every interval."""


class Group(NamedTuple):
    """All repetitions at one point."""

    point: Mapping[str, Any]
    results: tuple[Mapping[str, Any] | None, ...]
    """One a repetition; None where the cell has not ended well."""
    missing: int = 0
    """Repetitions that have not run yet."""

    @property
    def schemes(self) -> list[str]:
        """Names, in the order of `SCHEMES`: what is read back from a cell's file has lost its own; others last."""
        ran = {name for result in self.results if result for name in result["schemes"]}
        return [name for name in SCHEMES if name in ran] + sorted(ran - set(SCHEMES))

    def column(self, scheme: str, *name: str) -> Floats:
        """(R,) a score by its names, outermost first, e.g. `"landmarks", "ris", "rmse_m"`; NaN where there is none."""
        return np.array([_look(result, scheme, name) for result in self.results], dtype=np.float64)

    def parts(self, scheme: str, name: str) -> list[str]:
        """What a score holds in any repetition: the landmarks of `landmarks`, the walls of `walls`."""
        found = [result["schemes"].get(scheme, {}).get(name, {}) for result in self.results if result]
        return list(dict.fromkeys(part for entry in found for part in entry))

    @property
    def reasons(self) -> list[str]:
        """Why schemes failed in a collected group, each reason once."""
        entries = [(name, entry) for result in self.results if result for name, entry in result["schemes"].items()]
        return list(dict.fromkeys(f"{name}: {entry['failed']}" for name, entry in entries if "failed" in entry))

    def failed(self, scheme: str) -> int:
        """Repetitions in a collected group without a score of the scheme: it failed, or its cell did."""
        return int(np.isnan(self.column(scheme, "rmse_m")).sum()) - self.missing

    def diverged(self, scheme: str) -> int:
        """Repetitions in a collected group in which the estimate was lost."""
        return int(np.nansum(self.column(scheme, "diverged")))

    def mean(self, name: str) -> float:
        """Mean in a collected group of a number that belongs to the cell and to no scheme."""
        return float(np.mean([result[name] for result in self.results if result]))


def group_rows(rows: Sequence[Row]) -> list[Group]:
    """Collect rows by their point, both in their order."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(repr(row.cell.point), []).append(row)
    return [
        Group(
            group[0].cell.point,
            tuple(row.result if row.state == DONE else None for row in group),
            sum(row.state == MISSING for row in group),
        )
        for group in groups.values()
    ]


def spread(values: Floats) -> Interval | None:
    """RMS over the collected runs that have a value, with its interval; None if none has."""
    known = values[~np.isnan(values)]
    if not len(known):
        return None
    if len(known) == 1:
        return Interval(float(known[0]), float("nan"), float("nan"))
    return bootstrap(known, rng=np.random.default_rng(0), statistic=rms_over_runs, level=LEVEL)


def paired_gain(ours: Floats, theirs: Floats) -> Interval | None:
    """By which share our RMSE is below theirs, `1 - ours / theirs`, from the seeds that both have; None below two."""
    both = ~(np.isnan(ours) | np.isnan(theirs))
    if both.sum() < 2:
        return None
    value, low, high = bootstrap_ratio(ours[both], theirs[both], rng=np.random.default_rng(0), level=LEVEL)
    return Interval(1.0 - value, 1.0 - high, 1.0 - low)


def paired_difference(ours: Floats, theirs: Floats) -> Interval | None:
    """By how much [m] our RMSE is below theirs, from the seeds that both have; None below two."""
    both = ~(np.isnan(ours) | np.isnan(theirs))
    if both.sum() < 2:
        return None

    def difference(samples: Floats) -> Floats:
        root = rms_over_runs(samples)
        return np.asarray(root[..., 1] - root[..., 0])

    pairs = np.stack([ours[both], theirs[both]], axis=-1)
    return bootstrap(pairs, rng=np.random.default_rng(0), statistic=difference, level=LEVEL)


def _look(result: Mapping[str, Any] | None, scheme: str, name: Sequence[str]) -> float:
    found: Any = result["schemes"].get(scheme) if result else None
    for part in name:
        found = found.get(part) if isinstance(found, Mapping) else None
    return float("nan") if found is None else float(found)
