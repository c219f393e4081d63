"""Report of a comparison of two path sets: errors of matched paths with their limits, and paths that one side lacks."""

from collections import Counter
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, freeze
from rislam_rt.channel.compare.error_limits import ErrorLimits
from rislam_rt.model import PathKind

ERRORS = {
    "length_error_m": "length_error", "gain_error_db": "gain_error_db", "gain_error": "gain_error",
    "phase_error_rad": "phase_error", "aod_error_rad": "aod_error", "aoa_error_rad": "aoa_error",
}  # fmt: skip
"""Fields of a report with errors, by their names in JSON."""
MOST_LISTED = 20
"""Largest number of limit violations that a report lists, the worst first; all are counted."""


class OneSidedPath(NamedTuple):
    """A path that only one of two compared channels has, in one cycle, with the reason."""

    cycle: int
    label: str
    """Identity in words."""
    side: str
    """Channel that has the path: `traced` or `analytic`."""
    reason: str
    """Why the other channel lacks it, empty where no explanation was found."""
    proof: str
    """What was computed from the geometry to explain it, with its size."""
    size: float
    """[m] the length or distance on which the explanation rests, 0 where it rests on none."""


class LimitViolation(NamedTuple):
    """A matched path on which two compared channels differ by more than numerical precision and geometry explain."""

    cycle: int
    label: str
    """Identity in words."""
    quantity: str
    """Name and unit of the quantity, as in `PathReport.judged`."""
    value: float
    """The error, in the unit that `quantity` names."""
    limit: float

    def __str__(self) -> str:
        return (
            f"cycle {self.cycle}, {self.label}: error of {self.quantity} {self.value:.3g}, more than {self.limit:.3g}"
        )


@dataclass(frozen=True, slots=True, eq=False)
class PathReport:
    """Report of a comparison: matched paths with their errors, traced against analytic, and paths of one side."""

    cycles: int
    labels: tuple[str, ...]
    """(P,) identities in words."""
    path: Integers
    """(M,) which of `labels` each matched path has."""
    cycle: Integers
    """(M,) cycle of each matched path."""
    kind: Integers
    """(M,) `PathKind` of each matched path."""
    length_error: Floats
    """(M,) [m] absolute difference of the path lengths."""
    gain_error_db: Floats
    """(M,) [dB] absolute difference of the gains' magnitudes."""
    gain_error: Floats
    """(M,) difference of the gains' magnitudes, relative to the coherent scale (`error_limits.coherent_scale`)."""
    phase_error: Floats
    """(M,) [rad] absolute difference of the gains' phases."""
    aod_error: Floats
    """(M,) [rad] angle between the directions of departure."""
    aoa_error: Floats
    """(M,) [rad] angle between the directions of arrival."""
    limits: ErrorLimits
    """Limits of `length_error`, `gain_error`, `phase_error`, `aod_error` and `aoa_error`."""
    one_sided: tuple[OneSidedPath, ...]
    """Paths that only one channel has."""
    searched: dict[str, str]
    """How each channel found its paths (`Paths.source`), by side."""

    def __post_init__(self) -> None:
        freeze(self, np.int64, kind=(None,))
        freeze(self, np.int64, **dict.fromkeys(("path", "cycle"), self.kind.shape))
        freeze(self, np.float64, **dict.fromkeys(ERRORS.values(), self.kind.shape))

    @property
    def matched(self) -> int:
        """Number of matched paths in a comparison's report: those that both channels have, counted per cycle."""
        return len(self.kind)

    @property
    def explained(self) -> dict[str, int]:
        """Numbers of paths in a comparison's report that one channel lacks for a reason that was found, by reason."""
        return dict(sorted(Counter(path.reason for path in self.one_sided if path.reason).items()))

    @property
    def unexplained(self) -> int:
        """Number of paths in a comparison's report that one channel lacks without a reason that was found."""
        return sum(not path.reason for path in self.one_sided)

    @property
    def judged(self) -> dict[str, tuple[Floats, Floats]]:
        """Errors (M,) and limits (M,) of the matched paths in a comparison's report, by quantity."""
        return {
            "length [m]": (self.length_error, self.limits.length),
            "gain [of the coherent scale]": (self.gain_error, self.limits.gain),
            "phase [rad]": (self.phase_error, self.limits.phase),
            "departure [rad]": (self.aod_error, self.limits.aod),
            "arrival [rad]": (self.aoa_error, self.limits.aoa),
        }

    @property
    def num_breaches(self) -> int:
        """Number of errors beyond their limits in a comparison's report, over all matched paths and quantities."""
        return sum(int(np.sum(~(error <= limit))) for error, limit in self.judged.values())

    @property
    def breaches(self) -> list[LimitViolation]:
        """Errors beyond their limits that a comparison's report lists, the worst first, at most `MOST_LISTED`."""
        found = []
        for quantity, (error, limit) in self.judged.items():
            for row in np.flatnonzero(~(error <= limit)):
                label = self.labels[self.path[row]]
                found.append(
                    LimitViolation(int(self.cycle[row]), label, quantity, float(error[row]), float(limit[row]))
                )
        return sorted(found, key=lambda b: -b.value / b.limit)[:MOST_LISTED]

    @property
    def passed(self) -> bool:
        """Whether a comparison's report has every one-sided path explained and every matched one within its limits."""
        return not self.unexplained and not self.num_breaches

    @property
    def explanation_limits(self) -> dict[str, float]:
        """Largest length or distance [m] on which an explanation of a missing path rests, by reason, for the report."""
        return {r: max(path.size for path in self.one_sided if path.reason == r) for r in self.explained}

    def as_dict(self) -> dict[str, Any]:
        """The comparison's report for JSON: counts, largest errors and their distributions."""
        return {
            "cycles": self.cycles,
            "searched": self.searched,
            "matched": self.matched,
            "explained": self.explained,
            "unexplained": self.unexplained,
            "max_length_error_m": _largest(self.length_error),
            "max_gain_error_db": _largest(self.gain_error_db),
            "max_phase_error_rad": _largest(self.phase_error),
            "max_angle_error_rad": max(_largest(self.aod_error), _largest(self.aoa_error)),
            "passed": self.passed,
            "num_breaches": self.num_breaches,
            "breaches": [breach._asdict() for breach in self.breaches],
            "limits": {quantity: self._nearest(*pair) for quantity, pair in self.judged.items()},
            "proof_limits_m": self.explanation_limits,
            "matched_by_kind": {k.name: int(np.sum(self.kind == k)) for k in PathKind if np.any(self.kind == k)},
            "percentiles": {name: _percentiles(getattr(self, error)) for name, error in ERRORS.items()},
        }

    def _nearest(self, error: Floats, limit: Floats) -> dict[str, Any]:
        """Range of a quantity's error limits, and the matched path nearest to its own, for the report."""
        if len(error) == 0:
            return {}
        share = error / limit
        row = int(np.argmax(share))
        return {
            "smallest": float(limit.min()),
            "median": float(np.median(limit)),
            "largest": float(limit.max()),
            "nearest": {
                "cycle": int(self.cycle[row]), "path": self.labels[self.path[row]],
                "error": float(error[row]), "limit": float(limit[row]), "share": float(share[row]),
            },
        }  # fmt: skip


def _largest(errors: Floats) -> float:
    """Largest of the errors (M,) of matched paths, for the report; 0 of none."""
    return float(errors.max(initial=0.0))


def _percentiles(errors: Floats) -> dict[str, float]:
    """Median, 90th and 99th percentile and maximum of errors (M,) of matched paths, for the report; empty of none."""
    if len(errors) == 0:
        return {}
    p50, p90, p99, top = np.percentile(errors, [50.0, 90.0, 99.0, 100.0])
    return {"p50": float(p50), "p90": float(p90), "p99": float(p99), "max": float(top)}
