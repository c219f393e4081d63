"""Data of a run for the interactive view: each scheme's estimates, landmarks and codes at some cycles."""

from typing import Any

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import SchemeResult, SlamResult
from rislam_rt.report.style import scheme_styles
from rislam_rt.report.view.room_data import room_data, rounded, spread

FRAMES = 150
"""Largest number of cycles in a view."""
FINE = 4
"""Decimals of positions and errors [m] in a view."""
KNOWN = 0.5
"""Probability of being the panel above which a landmark is shown as the panel."""


def run_data(result: SlamResult) -> dict[str, Any]:
    """Data of a run for the interactive view: room, true trajectory and every scheme, at up to `FRAMES` cycles."""
    rows = spread(len(result.scene.agent), FRAMES)
    styles = scheme_styles(result.schemes)
    return room_data(result.scene) | {
        "kind": "run", "above": True, "first": len(rows) - 1, "time": rounded(result.scene.agent.elapsed[rows]),
        "truth": rounded(result.scene.agent.position[rows], FINE),
        "schemes": [_scheme(result, one, rows, styles[name].colour) for name, one in result.schemes.items()],
    }  # fmt: skip


def _scheme(result: SlamResult, scheme: SchemeResult, rows: Integers, colour: str) -> dict[str, Any]:
    """Data of one scheme for the view of a run: trajectory, 2 sigma ellipses, errors, landmarks, codes."""
    error = np.linalg.norm(scheme.position - result.scene.agent.position, axis=1)[rows]
    sigma = np.sqrt(np.maximum(np.trace(scheme.covariance[rows, :2, :2], axis1=1, axis2=2), 0.0))
    data = {
        "name": scheme.scheme, "colour": colour, "position": rounded(scheme.position[rows], FINE),
        "ellipse": [_ellipse(scheme.covariance[row, :2, :2]) for row in rows],
        "error": rounded(np.column_stack([error, sigma]), FINE), "lost": _lost(scheme, rows),
        "landmarks": [mark for column in range(len(scheme.ident)) if (mark := _landmark(scheme, column, rows))],
    }  # fmt: skip
    spec = result.scene.ris.spec if result.scene.ris is not None else None
    if scheme.applied.shape[1] and spec is not None:
        shapes = [[panel.rows, panel.cols] for panel in spec.panels]
        data |= {"levels": scheme.levels, "shapes": shapes, "codes": [_code(scheme, row, shapes) for row in rows]}
    return data


def _lost(scheme: SchemeResult, rows: Integers) -> str:
    """Digits in the view of a run, one a cycle shown: 1 if the filter reported divergence since the one before."""
    lost = np.array([outcome == "diverged" for outcome in scheme.outcome], dtype=np.int64)
    begins = np.append(0, rows[:-1] + 1)
    return "".join("1" if lost[first : last + 1].any() else "0" for first, last in zip(begins, rows, strict=True))


def _ellipse(covariance: Floats) -> list[float]:
    """Ellipse in the view of a run: half axes [m] of 2 sigma of a position covariance (2, 2), and the angle [rad] of
    the first."""
    value, vector = np.linalg.eigh(covariance)
    half = 2.0 * np.sqrt(np.maximum(value, 0.0))
    return [*rounded(half, FINE + 1), round(float(np.arctan2(vector[1, 0], vector[0, 0])), 3)]


def _landmark(scheme: SchemeResult, column: int, rows: Integers) -> dict[str, Any] | None:
    """Data of one estimated landmark for the view of a run, from its first cycle to its last; None if never mapped."""
    held = scheme.held[rows, column]
    if not held.any():
        return None
    first, last = int(np.argmax(held)), len(rows) - int(np.argmax(held[::-1]))
    places = rounded(scheme.landmark_position[rows[first:last], column])
    known = scheme.ris_probability[rows[first:last], column] > KNOWN
    return {
        "id": int(scheme.ident[column]),
        "image": bool(scheme.parent[column] >= 0),
        "first": first,
        "at": [place if there else None for place, there in zip(places, held[first:last], strict=True)],
        "panel": "".join("1" if one else "0" for one in known),
    }


def _code(scheme: SchemeResult, row: int, shapes: list[list[int]]) -> str:
    """Code in the view of a run: phase levels in base 36, of one width, panel by panel with `|` between."""
    index = scheme.applied[row].ravel()
    digits = len(np.base_repr(scheme.levels - 1, 36))
    sizes = [rows * cols for rows, cols in shapes]
    ends = np.cumsum(sizes)
    text = [np.base_repr(int(level), 36).lower().zfill(digits) for level in index]
    return "|".join("".join(text[end - size : end]) for end, size in zip(ends, sizes, strict=True))
