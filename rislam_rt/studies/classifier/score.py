"""Scores of the component classifier: F1 of "keep" with intervals over walks, and the importance of each feature."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, take_rows
from rislam_rt.model import PathKind
from rislam_rt.slam.classify import FEATURES, Network, blend, classify_geometric, log_odds
from rislam_rt.studies.classifier.training_examples import Examples
from rislam_rt.studies.classifier.walks import POLICIES

AMPLITUDE_RULE = 0.35
"""Ratio of amplitude to free-space amplitude above which the amplitude rule removes (`SlamConfig.specular_ratio`)."""
LEGS = ("", "", " reciprocal", " both legs")
"""Suffix of a path class's name by the legs with walls: none, Rx, Tx, both."""
NUM_RESAMPLES = 1000
"""Bootstrap resamples of an interval."""
NUM_SHUFFLES = 5
"""Shuffles of a feature for its importance."""

Rule = Callable[[Examples], Booleans]
"""Classification rule: which examples (N,) are kept as paths over landmarks."""


class ClassifierScore(NamedTuple):
    """Scores of one classification rule on one set of examples; clutter counts in `clutter_kept` alone."""

    f1: float
    """2 TP / (2 TP + FP + FN) of keep; 1 where there is nothing to keep and nothing was kept."""
    low: float
    """Lower end of the interval of F1."""
    high: float
    """Upper end of the interval of F1."""
    precision: float
    recall: float
    removed: float
    """Share of LOS and wall returns that were removed."""
    clutter_kept: float
    """Share of clutter that was kept."""


def rules(network: Network) -> dict[str, Rule]:
    """Classification rules to score by name: the network over a track's life or cycle by cycle, geometry, amplitude.

    All of them remove components as short as the direct path.
    """
    return {
        "network": lambda e: ~e.near & (odds_over_life(e, network) > 0.0),
        "single": lambda e: ~e.near & (log_odds(e.features, network) > 0.0),
        "geometric": lambda e: ~e.near & (classify_geometric(e.features) > 0.5),
        "amplitude": lambda e: ~e.near & (e.ratio < AMPLITUDE_RULE),
    }


def odds_over_life(examples: Examples, network: Network) -> Floats:
    """Log odds (N,) of the classifier that a component is to be kept, averaged over its track so far."""
    fresh = log_odds(examples.features, network)
    found, held = np.empty(len(fresh)), dict[tuple[int, int, int], tuple[float, int]]()
    names = zip(examples.walk.tolist(), examples.policy.tolist(), examples.track.tolist(), strict=True)
    for row, name in enumerate(names):
        odds, looks = held.get(name, (0.0, 0))
        found[row] = blend(np.array(odds), np.array(looks), fresh[row])
        held[name] = (float(found[row]), looks + 1)
    return found


def score(examples: Examples, rule: Rule, coverage: float, *, rng: np.random.Generator) -> ClassifierScore:
    """Scores of a classification rule, with a bootstrap interval of F1 over walks, which are independent."""
    kept = rule(examples)
    labelled, tables = examples.labelled, _tables(examples, kept)
    draws = rng.integers(len(tables), size=(NUM_RESAMPLES, len(tables)))
    tail = 50.0 * (1.0 - coverage)
    low, high = np.percentile(_f1(tables[draws].sum(axis=1)), [tail, 100.0 - tail])
    hit, false, missed, right = tables.sum(axis=0)
    clutter = kept[~labelled]
    return ClassifierScore(
        float(_f1(tables.sum(axis=0)[None])[0]), float(low), float(high), _share(hit, hit + false),
        _share(hit, hit + missed), _share(right, right + false), float(clutter.mean()) if len(clutter) else 0.0,
    )  # fmt: skip


def mean_over_rooms(rooms: list[Examples], rule: Rule, coverage: float, *, rng: np.random.Generator) -> Floats:
    """Score of the classifier: mean over rooms of a rule's F1, (3,) with interval, walks resampled in each room."""
    draws = []
    for examples in rooms:
        tables = _tables(examples, rule(examples))
        picks = rng.integers(len(tables), size=(NUM_RESAMPLES, len(tables)))
        draws.append(np.append(_f1(tables[picks].sum(axis=1)), _f1(tables.sum(axis=0)[None])))
    mean = np.mean(draws, axis=0)
    tail = 50.0 * (1.0 - coverage)
    return np.array([mean[-1], *np.percentile(mean[:-1], [tail, 100.0 - tail])])


def importance(examples: Examples, network: Network, *, rng: np.random.Generator) -> dict[str, Floats]:
    """Importance of each feature of the classifier: loss of F1 (S,) when it is shuffled among the examples, S times."""
    known = take_rows(examples, examples.labelled & ~examples.near)
    full = f1(known.keep, odds_over_life(known, network) > 0.0)
    lost: dict[str, Floats] = {}
    for column, name in enumerate(FEATURES):
        drops = []
        for _ in range(NUM_SHUFFLES):
            features = known.features.copy()
            features[:, column] = rng.permutation(features[:, column])
            drops.append(full - f1(known.keep, odds_over_life(known._replace(features=features), network) > 0.0))
        lost[name] = np.array(drops)
    return lost


def by_value(examples: Examples, rule: Rule, value: Floats, edges: tuple[int, ...]) -> dict[str, tuple[float, int]]:
    """Score of the classifier by a value: F1 of a rule and number of examples in bins `edges[i] <= value < edges[i +
    1]` of age or SNR."""
    kept, known = rule(examples), examples.labelled & ~examples.near
    bins = {}
    for low, high in pairwise(edges):
        rows = known & (value >= low) & (value < high)
        if rows.any():
            name = f"{low} to {high - 1}" if high - low > 1 else f"{low}"
            bins[name] = (f1(examples.keep[rows], kept[rows]), int(rows.sum()))
    return bins


def path_classes(examples: Examples) -> dict[str, Booleans]:
    """Which examples (N,) of the classifier are of each path class, by name; paths with walls are split by the legs
    that have them."""
    found = {}
    for kind in PathKind:
        over_walls = kind in (PathKind.VS, PathKind.VRIS)
        for legs, words in enumerate(LEGS) if over_walls else ((0, ""),):
            rows = (examples.kind == kind) & (examples.legs == legs)
            if rows.any():
                found[kind.name + words] = rows
    return found


def mistakes(examples: Examples, rule: Rule) -> dict[str, tuple[int, int]]:
    """Number of examples that the classifier gets wrong, and of all, by path class."""
    wrong = rule(examples) != examples.keep
    return {name: (int(np.sum(wrong & rows)), int(np.sum(rows))) for name, rows in path_classes(examples).items()}


def right_by_class(examples: Examples, rule: Rule) -> float:
    """Score of the classifier: mean over the path classes of the share of examples classified correctly, rare classes
    counting in full."""
    kept = rule(examples)
    shares = [np.mean((kept == examples.keep)[examples.kind == kind]) for kind in PathKind if kind in examples.kind]
    return float(np.mean(shares)) if shares else 1.0


def panel_dropped(examples: Examples, rule: Rule) -> dict[str, tuple[int, int]]:
    """Score of the classifier: number of examples of the direct panel path that a rule removes, and of all such, by
    code policy."""
    dropped, panel = ~rule(examples), examples.kind == PathKind.RIS
    rows = {name: panel & (examples.policy == number) for number, name in enumerate(POLICIES)}
    return {name: (int(np.sum(dropped & own)), int(np.sum(own))) for name, own in rows.items()}


def f1(keep: Booleans, kept: Booleans) -> float:
    """F1 of the components kept against those to keep, both (N,)."""
    return float(_f1(_counts(kept, keep)[None])[0])


def _tables(examples: Examples, kept: Booleans) -> Integers:
    """Confusion counts (walks, 4) of the classifier in each walk as `_counts` gives them, clutter left out."""
    walks = (examples.labelled & (examples.walk == walk) for walk in np.unique(examples.walk))
    return np.array([_counts(kept[rows], examples.keep[rows]) for rows in walks])


def _counts(kept: Booleans, keep: Booleans) -> Integers:
    """Confusion counts (4,) of the classifier: kept rightly, kept wrongly, removed wrongly, removed rightly."""
    return np.bincount(2 * ~kept + ~keep, minlength=4)


def _f1(tables: Any) -> Floats:
    """F1 of the classifier's confusion counts (..., 4)."""
    hit, false, missed = tables[:, 0], tables[:, 1], tables[:, 2]
    return np.asarray(np.where(hit + false + missed > 0, 2.0 * hit / np.maximum(2 * hit + false + missed, 1), 1.0))


def _share(part: float, whole: float) -> float:
    """Ratio of two counts of the classifier's score; 1 of none."""
    return float(part / whole) if whole else 1.0
