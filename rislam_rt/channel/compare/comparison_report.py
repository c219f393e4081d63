"""The report of a comparison of two path sets: what was found."""

from collections import Counter
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, freeze
from rislam_rt.channel.compare.error_limits import ErrorLimits
from rislam_rt.model import PathKind

MOST_LISTED = 20
"""Breaches that are listed, the worst first; all are counted."""


class OneSidedPath(NamedTuple):
    """A path that only one side has, in one cycle."""

    cycle: int
    label: str
    """Identity in words."""
    side: str
    """`traced` or `analytic`: who has it."""
    reason: str
    """Why the other has not, empty where no proof was found."""
    proof: str
    """What was computed from the geometry, with its size."""
    size: float
    """[m] the length or distance on which the proof rests, 0 where it rests on none."""


class LimitViolation(NamedTuple):
    """A matched path on which the two sides are farther apart than precision and geometry explain."""

    cycle: int
    label: str
    """Identity in words."""
    quantity: str
    value: float
    """The error, in the unit that `quantity` names."""
    limit: float

    def __str__(self) -> str:
        return (
            f"cycle {self.cycle}, {self.label}: error of {self.quantity} {self.value:.3g}, more than {self.limit:.3g}"
        )


@dataclass(frozen=True, slots=True, eq=False)
class PathReport:
    """Matched paths with their errors, traced against analytic, and one-sided paths with their proofs."""

    cycles: int
    labels: tuple[str, ...]
    """(P,) identities in words."""
    path: Integers
    """(M,) which of `labels` each matched path has."""
    cycle: Integers
    """(M,)."""
    kind: Integers
    """(M,) `PathKind` of each matched path."""
    length_error: Floats
    """(M,) [m] absolute."""
    gain_error_db: Floats
    """(M,) [dB] absolute."""
    gain_error: Floats
    """(M,) difference of the magnitudes, relative to the coherent scale (`limits.coherent_scale`)."""
    phase_error: Floats
    """(M,) [rad] absolute."""
    aod_error: Floats
    """(M,) [rad] angle between the directions of departure."""
    aoa_error: Floats
    """(M,) [rad] angle between the directions of arrival."""
    limits: ErrorLimits
    """Of `length_error`, `gain_error`, `phase_error`, `aod_error` and `aoa_error`."""
    one_sided: tuple[OneSidedPath, ...]
    searched: dict[str, str]
    """By side: whose numbers, and among which wall sequences paths were looked for (`Paths.source`)."""

    def __post_init__(self) -> None:
        freeze(self, "kind", np.int64, (None,))
        for name in ("path", "cycle"):
            freeze(self, name, np.int64, (len(self.kind),))
        for name in ("length_error", "gain_error_db", "gain_error", "phase_error", "aod_error", "aoa_error"):
            freeze(self, name, np.float64, (len(self.kind),))

    @property
    def matched(self) -> int:
        """Compared paths that both sides have, counted per cycle."""
        return len(self.kind)

    @property
    def explained(self) -> dict[str, int]:
        """Compared paths of one side with a proof, counted by reason."""
        return dict(sorted(Counter(path.reason for path in self.one_sided if path.reason).items()))

    @property
    def unexplained(self) -> int:
        """Compared paths of one side without a proof."""
        return sum(not path.reason for path in self.one_sided)

    @property
    def judged(self) -> dict[str, tuple[Floats, Floats]]:
        """Errors (M,) and limits (M,) of compared paths by quantity."""
        return {
            "length [m]": (self.length_error, self.limits.length),
            "gain [of the coherent scale]": (self.gain_error, self.limits.gain),
            "phase [rad]": (self.phase_error, self.limits.phase),
            "departure [rad]": (self.aod_error, self.limits.aod),
            "arrival [rad]": (self.aoa_error, self.limits.aoa),
        }

    @property
    def num_breaches(self) -> int:
        """Errors of compared paths beyond their limits, over all paths and quantities."""
        return sum(int(np.sum(~(error <= limit))) for error, limit in self.judged.values())

    @property
    def breaches(self) -> list[LimitViolation]:
        """The worst breaches of the report first, at most `MOST_LISTED`."""
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
        """Whether every one-sided path is explained and every error of a matched one within its limit."""
        return not self.unexplained and not self.num_breaches

    @property
    def explanation_limits(self) -> dict[str, float]:
        """The weakest proof of each reason: the largest length or distance [m] it rests on."""
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
            "percentiles": {
                "length_error_m": _percentiles(self.length_error),
                "gain_error_db": _percentiles(self.gain_error_db),
                "gain_error": _percentiles(self.gain_error),
                "phase_error_rad": _percentiles(self.phase_error),
                "aod_error_rad": _percentiles(self.aod_error),
                "aoa_error_rad": _percentiles(self.aoa_error),
            },
        }

    def _nearest(self, error: Floats, limit: Floats) -> dict[str, Any]:
        """For the comparison's JSON: range of a quantity's limits, and the path that comes nearest to its own."""
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
    """Largest error in the comparison's report, 0 of none."""
    return float(errors.max(initial=0.0))


def _percentiles(errors: Floats) -> dict[str, float]:
    """Median, 90th, 99th percentile and maximum of errors for the comparison's report; nothing of none."""
    if len(errors) == 0:
        return {}
    p50, p90, p99, top = np.percentile(errors, [50.0, 90.0, 99.0, 100.0])
    return {"p50": float(p50), "p90": float(p90), "p99": float(p99), "max": float(top)}
