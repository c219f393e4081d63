"""Scores of data association: how well measurements were assigned to landmarks, by true identities."""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Integers

NONE = -1
"""Identity of clutter in the truth, and label of "no landmark" in the filter's answer."""


class AssociationScore(NamedTuple):
    """Scores of a run's data association: fractions of its measurements."""

    accuracy: float
    """Fraction of the measurements whose label is right; clutter that was left alone counts as right."""
    precision: float
    """Fraction of the measurements with a label whose label stands for their true identity."""
    recall: float
    """Fraction of the measurements with a true identity whose label stands for it."""


def association_score(label: Integers, truth: Integers) -> AssociationScore:
    """Score of data association: the labels (T,) that a filter gave measurements against their true identities (T,); -1
    is none.

    Labels are numbers of the agent's own. Each is first given the identity with which it agrees most often, one to one
    (the assignment that gets the most measurements right), so a split or merged track costs what it loses.
    """
    labels, rows = np.unique(label, return_inverse=True)
    identities, cols = np.unique(truth, return_inverse=True)
    counts = np.zeros((len(labels), len(identities)), dtype=np.int64)
    np.add.at(counts, (rows, cols), 1)
    return association_fractions(labels, identities, counts)


def association_fractions(labels: Integers, identities: Integers, counts: Integers) -> AssociationScore:
    """Score of data association from counts (L, I) of how often label (L,) met identity (I,); -1 is none."""
    own = counts[np.ix_(labels != NONE, identities != NONE)]
    right = int(own[scipy.optimize.linear_sum_assignment(own, maximize=True)].sum()) if own.size else 0
    left_alone = int(counts[np.ix_(labels == NONE, identities == NONE)].sum())
    parts = (right + left_alone, counts), (right, counts[labels != NONE]), (right, counts[:, identities != NONE])
    return AssociationScore._make(part / int(of.sum()) if of.sum() else 1.0 for part, of in parts)
