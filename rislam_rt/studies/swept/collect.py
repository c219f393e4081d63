"""Collecting the cells of a swept study: RMSEs over repetitions with confidence intervals, and counts of failures."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import Interval, bootstrap, rms_over_runs
from rislam_rt.evaluate.confidence_intervals import Statistic
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.sweeps import Row
from rislam_rt.sweeps.store import DONE, MISSING, rows_by_point

LEVEL = 0.95
"""Confidence level of every interval."""


class Group(NamedTuple):
    """Results of all repetitions of a swept study at one point of its axes."""

    point: Mapping[str, Any]
    """Values along the axes, by key."""
    results: tuple[Mapping[str, Any] | None, ...]
    """One a repetition; None where the cell failed or has not run."""
    missing: int = 0
    """Number of repetitions that have not run yet."""

    @property
    def schemes(self) -> list[str]:
        """Names of the schemes in the collected cells of a swept study, in the order of `SCHEMES`, as cells' files do
        not keep theirs; others last."""
        ran = {name for result in self.results if result for name in result["schemes"]}
        return [name for name in SCHEMES if name in ran] + sorted(ran - set(SCHEMES))

    def column(self, scheme: str, *name: str) -> Floats:
        """One collected score of a scheme over all repetitions, (R,); NaN where there is none.

        `name` are the nested keys, e.g. `"landmarks", "ris", "rmse_m"`.
        """
        return np.array([_look(result, scheme, name) for result in self.results], dtype=np.float64)

    def parts(self, scheme: str, name: str) -> list[str]:
        """Keys that a collected nested score of a scheme has in any repetition: landmarks' names, or `walls`."""
        found = [result["schemes"].get(scheme, {}).get(name, {}) for result in self.results if result]
        return list(dict.fromkeys(part for entry in found for part in entry))

    @property
    def reasons(self) -> list[str]:
        """Error messages collected from all cells of a group in a sweep, of the schemes that failed, each once."""
        entries = [(name, entry) for result in self.results if result for name, entry in result["schemes"].items()]
        return list(dict.fromkeys(f"{name}: {entry['failed']}" for name, entry in entries if "failed" in entry))

    def failed(self, scheme: str) -> int:
        """Number of repetitions in which a scheme failed, or its whole cell did."""
        return int(np.isnan(self.column(scheme, "rmse_m")).sum()) - self.missing

    def diverged(self, scheme: str) -> int:
        """Number of repetitions in which a scheme's estimate diverged."""
        return int(np.nansum(self.column(scheme, "diverged")))

    def mean(self, name: str) -> float:
        """Mean over the repetitions of a number that the schemes of a cell share, such as the SNR."""
        return float(np.mean([result[name] for result in self.results if result]))


def group_rows(rows: Sequence[Row]) -> list[Group]:
    """Group the cells of a swept study by their point on the axes, all in their order."""
    return [
        Group(
            group[0].cell.point,
            tuple(row.result if row.state == DONE else None for row in group),
            sum(row.state == MISSING for row in group),
        )
        for group in rows_by_point(rows)
    ]


def spread(values: Floats) -> Interval | None:
    """RMS over repetitions of their RMSEs, with a bootstrap interval; NaN values are left out, None if all are NaN."""
    known = values[~np.isnan(values)]
    if not len(known):
        return None
    if len(known) == 1:
        return Interval(float(known[0]), float("nan"), float("nan"))
    return bootstrap(known, rng=np.random.default_rng(0), statistic=rms_over_runs, level=LEVEL)


def paired_gain(ours: Floats, theirs: Floats) -> Interval | None:
    """Relative reduction of our collected RMSE against theirs, `1 - ours / theirs`, with its interval, over seeds that
    both have.

    None for fewer than two seeds.
    """

    def ratio(samples: Floats) -> Floats:
        return rms_over_runs(samples[..., 0]) / rms_over_runs(samples[..., 1])

    found = _paired(ours, theirs, ratio)
    return Interval(1.0 - found.value, 1.0 - found.upper, 1.0 - found.lower) if found else None


def paired_difference(ours: Floats, theirs: Floats) -> Interval | None:
    """Difference [m] of their collected RMSE and ours, with interval, over common seeds; None of fewer than two."""

    def difference(samples: Floats) -> Floats:
        root = rms_over_runs(samples)
        return np.asarray(root[..., 1] - root[..., 0])

    return _paired(ours, theirs, difference)


def _paired(ours: Floats, theirs: Floats, statistic: Statistic) -> Interval | None:
    """Statistic of collected pairs (S, 2), of those seeds that both have, with its interval; None of fewer than two.

    Seeds are drawn in pairs, so that what both schemes share (room, noise) does not widen the interval.
    """
    pairs = np.stack([ours, theirs], axis=-1)
    pairs = pairs[~np.isnan(pairs).any(axis=1)]
    return None if len(pairs) < 2 else bootstrap(pairs, rng=np.random.default_rng(0), statistic=statistic, level=LEVEL)


def _look(result: Mapping[str, Any] | None, scheme: str, name: Sequence[str]) -> float:
    """One of the collected scores of a scheme by nested keys; NaN if there is none."""
    found: Any = result["schemes"].get(scheme) if result else None
    for part in name:
        found = found.get(part) if isinstance(found, Mapping) else None
    return float("nan") if found is None else float(found)
