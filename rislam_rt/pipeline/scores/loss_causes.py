"""Causes of loss, scored: how often an estimator began to hold itself for lost in a run, when first, and why."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rislam_rt.model import SchemeResult
from rislam_rt.slam.step_info import LossCause, StepOutcome

WORDS = {
    LossCause.NONE: "it gives no reason",
    LossCause.START: "the first paths tell of another speed or heading than it was told at the start",
    LossCause.JUMP: "what it hears fits its map from another place",
    LossCause.TRACKS: "many paths that it followed fell silent at once",
    LossCause.MAP: "what it hears fits its map worse than chance would",
    LossCause.MOTION: "the lengths of the paths change as under another motion than it believes in",
    LossCause.RESTART: "it began anew with an empty map",
}
"""Causes of loss in plain words."""
UNNOTICED = "diverged without noticing: nothing that it heard spoke against its map and its motion"
"""What is said of a run that diverged by the truth, and whose estimator never held itself for lost."""


class LossTally:
    """Tally of the times at which an estimator began to hold itself for lost, part by part of a run."""

    def __init__(self) -> None:
        self.causes: Counter[LossCause] = Counter()
        self.first: float | None = None
        self.lost = False

    def add(self, time: Iterable[float], outcomes: Sequence[str], causes: Iterable[float] | None) -> None:
        """Add cycles: times [s], outcomes, and codes of `LossCause`, which other estimators do not give."""
        codes = [LossCause.NONE] * len(outcomes) if causes is None else [LossCause(int(code)) for code in causes]
        for at, outcome, cause in zip(time, outcomes, codes, strict=True):
            if outcome == StepOutcome.NO_MEASUREMENTS:  # which tells nothing of it
                continue
            lost = outcome == StepOutcome.DIVERGED
            if lost and not self.lost:
                self.causes[cause] += 1
                self.first = float(at) if self.first is None else self.first
            self.lost = lost

    def scores(self, start: float) -> dict[str, Any]:
        """Number of `times` it began to hold itself for lost, the first [s] after the `start` [s], and how often for
        each of the `causes`, named as those of `LossCause` in lower case."""
        first = None if self.first is None else self.first - start
        causes = {cause.name.lower(): count for cause, count in self.causes.most_common()}
        return {"times": self.causes.total(), "first_s": first, "causes": causes}


def loss_scores(scheme: SchemeResult) -> dict[str, Any]:
    """Score of divergence by the filter's own word: how often it began to hold itself for lost, when, and why."""
    tally = LossTally()
    tally.add(scheme.time, scheme.outcome, scheme.info.get("cause"))
    return tally.scores(float(scheme.time[0]))


def is_unnoticed(scores: Mapping[str, Any]) -> bool:
    """Whether a scheme of a run, by its scores, diverged without noticing: it never held itself for lost, so that no
    cause of loss is known."""
    return bool(scores["diverged"]) and not scores["lost"]["times"]


def unnoticed_lines(schemes: Mapping[str, Any]) -> list[str]:
    """Warnings of a run, from the scores of its schemes by name: a line for each cause of loss that no filter told of,
    as the scheme diverged without noticing."""
    found = ((name, scores["largest_m"]) for name, scores in schemes.items() if is_unnoticed(scores))
    return [f"{name}: {UNNOTICED}; off by up to {largest:.2f} m" for name, largest in found]


def words_of_loss(lost: Mapping[str, Any]) -> str:
    """Causes of loss in words, the most frequent first, from the scores that `LossTally` gives."""
    many = len(lost["causes"]) > 1
    return "; ".join(
        WORDS[LossCause[name.upper()]] + (f" ({count} times)" if many and count > 1 else "")
        for name, count in lost["causes"].items()
    )
