"""What a comparison of two path sets found."""

from collections import Counter
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, freeze
from rislam_rt.model import PathKind


class OneSided(NamedTuple):
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


@dataclass(frozen=True, slots=True, eq=False)
class PathReport:
    """Matched paths with their errors, traced against analytic, and one-sided paths with their proofs."""

    cycles: int
    kind: Integers
    """(M,) `PathKind` of each matched path."""
    length_error: Floats
    """(M,) [m] absolute."""
    gain_error_db: Floats
    """(M,) [dB] absolute."""
    phase_error: Floats
    """(M,) [rad] absolute."""
    aod_error: Floats
    """(M,) [rad] angle between the directions of departure."""
    aoa_error: Floats
    """(M,) [rad] angle between the directions of arrival."""
    one_sided: tuple[OneSided, ...]

    def __post_init__(self) -> None:
        freeze(self, "kind", np.int64, (None,))
        for name in ("length_error", "gain_error_db", "phase_error", "aod_error", "aoa_error"):
            freeze(self, name, np.float64, (len(self.kind),))

    @property
    def matched(self) -> int:
        """Paths that both sides have, counted per cycle."""
        return len(self.kind)

    @property
    def explained(self) -> dict[str, int]:
        """One-sided paths with a proof, counted by reason."""
        return dict(sorted(Counter(path.reason for path in self.one_sided if path.reason).items()))

    @property
    def unexplained(self) -> int:
        """One-sided paths without a proof."""
        return sum(not path.reason for path in self.one_sided)

    @property
    def proof_limits(self) -> dict[str, float]:
        """The weakest proof of each reason: the largest length or distance [m] it rests on."""
        return {r: max(path.size for path in self.one_sided if path.reason == r) for r in self.explained}

    def as_dict(self) -> dict[str, Any]:
        """Counts, largest errors and their distributions, for JSON."""
        return {
            "cycles": self.cycles,
            "matched": self.matched,
            "explained": self.explained,
            "unexplained": self.unexplained,
            "max_length_error_m": _largest(self.length_error),
            "max_gain_error_db": _largest(self.gain_error_db),
            "max_phase_error_rad": _largest(self.phase_error),
            "max_angle_error_rad": max(_largest(self.aod_error), _largest(self.aoa_error)),
            "proof_limits_m": self.proof_limits,
            "matched_by_kind": {k.name: int(np.sum(self.kind == k)) for k in PathKind if np.any(self.kind == k)},
            "percentiles": {
                "length_error_m": _percentiles(self.length_error),
                "gain_error_db": _percentiles(self.gain_error_db),
                "phase_error_rad": _percentiles(self.phase_error),
                "aod_error_rad": _percentiles(self.aod_error),
                "aoa_error_rad": _percentiles(self.aoa_error),
            },
        }


def _largest(errors: Floats) -> float:
    """Largest error, 0 of none."""
    return float(errors.max(initial=0.0))


def _percentiles(errors: Floats) -> dict[str, float]:
    """Median, 90th, 99th percentile and maximum; nothing of none."""
    if len(errors) == 0:
        return {}
    p50, p90, p99, top = np.percentile(errors, [50.0, 90.0, 99.0, 100.0])
    return {"p50": float(p50), "p90": float(p90), "p99": float(p99), "max": float(top)}
