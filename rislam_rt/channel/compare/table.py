"""The validation page: one row a room, from the reports of one run."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rislam_rt.channel.compare.report import PathReport


class Validation(NamedTuple):
    """One room's comparison."""

    scene: str
    depth: int
    report: PathReport


def validation_table(rows: Sequence[Validation]) -> str:
    """Markdown table: paths per room, every reason with its count and weakest proof, largest errors."""
    head = ["room", "depth", "poses", "matched", "explained", "unexplained", "length [m]", "gain [dB]", "phase [rad]"]
    lines = [_row([*head, "angle [rad]"]), _row(["---"] * (len(head) + 1))]
    for scene, depth, report in rows:
        numbers = report.as_dict()
        errors = [
            f"{numbers[f'max_{name}']:.1e}"
            for name in ("length_error_m", "gain_error_db", "phase_error_rad", "angle_error_rad")
        ]
        counts = [str(report.cycles), str(report.matched), _reasons(numbers), str(report.unexplained)]
        lines.append(_row([scene, str(depth), *counts, *errors]))
    return "\n".join(lines) + "\n"


def _reasons(numbers: Mapping[str, Any]) -> str:
    """`edge: 3 (1.2e-6 m)`, one after the other."""
    limits = numbers["proof_limits_m"]
    texts = [
        f"{reason}: {n}" + (f" ({limits[reason]:.1e} m)" if limits[reason] else "")
        for reason, n in numbers["explained"].items()
    ]
    return ", ".join(texts) or "none needed"


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
