"""Scores of association: how well measurements were told apart, by identities that only the scorer sees."""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Integers

NONE = -1
"""Label of clutter in the truth, and of "no landmark" in an answer."""


class AssociationScore(NamedTuple):
    """Fractions of measurements; `accuracy` counts clutter that was left alone as right."""

    accuracy: float
    precision: float
    """Of those associated, how many with the right identity."""
    recall: float
    """Of those with an identity, how many associated with it."""
    switches: int
    """How often an identity changed its label from one of its measurements to the next."""


def association_score(label: Integers, truth: Integers) -> AssociationScore:
    """Score labels (T,) given by the agent against identities (T,), both -1 for none, in the order of time.

    Labels are numbers of the agent's own. Each is first given the identity with which it agrees most often, one to one
    (the assignment that gets the most measurements right), so a split or merged track costs what it loses.
    """
    label, truth = np.asarray(label), np.asarray(truth)
    if not len(label):
        return AssociationScore(1.0, 1.0, 1.0, 0)
    labels, rows = np.unique(label, return_inverse=True)
    identities, cols = np.unique(truth, return_inverse=True)
    counts = np.zeros((len(labels), len(identities)), dtype=np.int64)
    np.add.at(counts, (rows, cols), 1)
    return AssociationScore(*association_fractions(labels, identities, counts), label_switches(label, truth))


def association_fractions(labels: Integers, identities: Integers, counts: Integers) -> tuple[float, float, float]:
    """Accuracy, precision and recall from how often (L, I) each label (L,) met each identity (I,); -1 for none."""
    own = counts[np.ix_(labels != NONE, identities != NONE)]
    right = int(own[scipy.optimize.linear_sum_assignment(own, maximize=True)].sum()) if own.size else 0
    left_alone = int(counts[np.ix_(labels == NONE, identities == NONE)].sum())
    total, answered, known = (
        int(counts.sum()),
        int(counts[labels != NONE].sum()),
        int(counts[:, identities != NONE].sum()),
    )
    return (
        (right + left_alone) / total if total else 1.0,
        right / answered if answered else 1.0,
        right / known if known else 1.0,
    )


def label_switches(label: Integers, truth: Integers) -> int:
    """Times at which an identity's label differs from the label it last had; -1 on either side does not count."""
    switches = 0
    both = (np.asarray(label) != NONE) & (np.asarray(truth) != NONE)
    for identity in np.unique(np.asarray(truth)[both]):
        own = np.asarray(label)[both & (np.asarray(truth) == identity)]
        switches += int(np.sum(own[1:] != own[:-1]))
    return switches
