"""The page of the channel validation: how traced and image-source paths were compared, and a table of all rooms."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rislam_rt.channel.compare import Validation
from rislam_rt.report.markdown import table_lines
from rislam_rt.report.studies.channel_validation_figure import draw_certificate
from rislam_rt.report.style import to_png
from rislam_rt.storage.files import json_file, write_all
from rislam_rt.studies.channel_validation import Comparison
from rislam_rt.studies.spec import CompareSpec

COMPARISON, CERTIFICATE = "channel_validation", "figures/path_certificate.png"

_HEAD = [
    "room", "depth", "numbers", "poses", "matched", "explained", "unexplained",
    "beyond limits", "length [m]", "gain [dB]", "phase [rad]", "AoD [rad]", "AoA [rad]", "share of the limit",
]  # fmt: skip

_TEXT = """\
# Channel validation

Every path of every room, traced (Sionna RT) against analytic (image sources, float64), matched by identity: class,
landmark, walls in the order of travel. Written by `rislam-rt` from one run; do not edit.

- *matched*: paths on both sides, counted per pose; *unexplained*: one-sided paths without a proof.
- *explained*: one-sided paths with the proof recomputed from the geometry (`channel/compare/unmatched_paths.py`);
  in brackets the weakest proof, the largest length or distance that any of them rests on.
- both sides look among all wall sequences that the walls' sides allow, except where a room allows more than 2000 on the
  analytic side (mirrored beams rule out the others) or 100 000 on the traced one (cones do); the JSON says which.
- errors are the largest of all matched paths, in brackets the 99th percentile; the panel at one random code. *traced*
  rows are the tracer's own float32 numbers: the independent evidence, and the verdict. In *refined* rows the tracer
  decides which paths exist and what its materials do to the field; lengths and directions are recomputed in float64 on
  the walls it named, by formulas that image sources share, so that their errors say little beyond rounding.
- every error is judged by a limit of its own path (`rislam_rt/channel/compare/error_limits.py`), which follows from the
  rounding of float32 (of float64 in refined rows), the room's size, the path's length, its bounces and the segments
  next to agent and landmark; none is fitted. *beyond limits* counts the errors that are larger: exit code 1.
- *share of the limit*: the path that comes nearest to its own, for length, gain, phase, departure and arrival.
- gains are judged against the sum of the magnitudes that make them up: over a panel's elements, and with slabs taken
  for mirrors. A null of the panel, or a slab at Brewster's angle, is a difference of large numbers: its own size says
  nothing about their error, and decibels of it (the column) may be large where nothing is wrong.

"""


def write_comparison(
    found: Comparison, spec: CompareSpec, content: Mapping[str, Any], folder: Path, *, figures: bool = True
) -> Path:
    """Write the files of the channel validation: page, JSON and figure; return the page's path.

    Raises
    ------
    StoreError
        The disk refused.
    """
    files = {f"{COMPARISON}.md": validation_page(found.rows, seed=spec.seed).encode()}
    if figures and found.certificate is not None:
        files[CERTIFICATE] = to_png(draw_certificate(found.certificate))
    return write_all(folder, files | {f"{COMPARISON}.json": json_file(content)})


def validation_table(rows: Sequence[Validation]) -> str:
    """Markdown table of the channel validation: matched and one-sided paths with reasons, largest errors, by room."""
    cells = []
    for scene, depth, kind, report in rows:
        numbers = report.as_dict()
        spread = numbers["percentiles"]
        columns = ("length_error_m", "gain_error_db", "phase_error_rad", "aod_error_rad", "aoa_error_rad")
        errors = [_error(spread[name]) for name in columns]
        counts = [str(report.cycles), str(report.matched), _reasons(numbers), str(report.unexplained)]
        shares = " ".join(_share(limits) for limits in numbers["limits"].values())
        cells.append([scene, str(depth), kind, *counts, str(report.num_breaches), *errors, shares])
    return "\n".join(table_lines(_HEAD, cells)) + "\n"


def validation_page(rows: Sequence[Validation], *, seed: int) -> str:
    """Markdown page of the channel validation: method and table."""
    how = f"Seed {seed}; poses at random, midpoint at least 0.1 m off every surface, baseline 0.1 m."
    return f"{_TEXT}{how}\n\n{validation_table(rows)}"


def _reasons(numbers: Mapping[str, Any]) -> str:
    """Table cell of the channel validation: reasons of one-sided paths, as `edge: 3 (1.2e-6 m)`."""
    limits = numbers["proof_limits_m"]
    texts = [
        f"{reason}: {n}" + (f" ({limits[reason]:.1e} m)" if limits[reason] else "")
        for reason, n in numbers["explained"].items()
    ]
    return ", ".join(texts) or "none needed"


def _share(limits: Mapping[str, Any]) -> str:
    """Table cell of the channel validation: largest ratio of a path's error to its limit."""
    return f"{limits['nearest']['share']:.0%}" if limits else "-"


def _error(spread: Mapping[str, float]) -> str:
    """Table cell of the channel validation: largest error and 99th percentile; `< 1e-12` for mere rounding."""
    if not spread:
        return "-"
    largest, p99 = ("< 1e-12" if spread[name] < 1e-12 else f"{spread[name]:.1e}" for name in ("max", "p99"))
    return f"{largest} ({p99})"
