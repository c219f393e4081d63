"""Loss by the truth, scored: whether the estimate was far off for a while, since when, and whether the filter knew."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.pipeline.scores.loss_causes import is_unnoticed

LOST, FAR_OVER, LASTING = 0.1, 5.0, 1.0
"""A run is lost once its relative error exceeds `LOST` [m] and `FAR_OVER` relative bounds for `LASTING` [s] on end."""


def lost_scores(relative: Floats, bound: Floats, own: Floats, time: Floats, outcomes: Sequence[Any]) -> dict[str, Any]:
    """Score of divergence: whether the estimate was lost, when, and whether the estimator did not notice ("silent").

    It noticed if an outcome says so from then on, or if its own standard deviation `own` (K,) [m] covers the error.
    """
    far = relative > np.maximum(LOST, FAR_OVER * bound)
    lost = _lasting(far, time)
    if not lost.any():
        return {"lost": False, "silent": False, "lost_at_s": None}
    first = int(np.argmax(lost))
    said = any(str(outcome) == "diverged" for outcome in outcomes[first:])
    surprised = _lasting(far & (relative > FAR_OVER * own), time).any()
    return {"lost": True, "silent": bool(surprised and not said), "lost_at_s": float(time[first])}


def _lasting(flag: Booleans, time: Floats) -> Booleans:
    """Cycles, for a score of loss, from which on a flag (K,) is set for `LASTING` seconds without a break."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else LASTING
    length = max(1, round(LASTING / step))
    return np.asarray(np.convolve(flag, np.ones(length), "valid") >= length) if len(flag) >= length else flag[:0]


def silent_loss_lines(schemes: Mapping[str, Any]) -> list[str]:
    """Warnings of a run, from the scores of its schemes by name: a line for each that was silently lost by the truth,
    unless it diverged without noticing, of which another line tells."""
    return [
        f"{name}: {words_of_silence(scores)}"
        for name, scores in schemes.items()
        if scores["true_loss"] and scores["true_loss"]["silent"] and not is_unnoticed(scores)
    ]


def words_of_silence(scores: Mapping[str, Any]) -> str:
    """Silent loss of a scheme in words, by its scores."""
    return (
        f"silently lost from {scores['true_loss']['lost_at_s']:.1f} s on: off by more than {LOST:g} m and {FAR_OVER:g} "
        f"bounds for {LASTING:g} s on end, relative to its start; its position by up to {scores['largest_m']:.2f} m"
    )
