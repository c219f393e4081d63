"""Phase codes of the panel along the random walks on which the classifier is trained: several policies."""

import numpy as np

from rislam_rt.design import focus_codes
from rislam_rt.model import DataSheet, PathKind, Paths, RisCode
from rislam_rt.ris import rephase

POLICIES = ("random", "held", "aimed", "exact")
"""Code policies: a random code each cycle; one random code throughout; the best code for the direct panel path at the
middle of the walk, throughout; the best for that path in each cycle."""
AIMED = tuple(POLICIES.index(name) for name in ("aimed", "exact"))
"""Indices of the code policies that know where the agent is."""


def set_codes(paths: Paths, panel: DataSheet | None, policy: str, *, rng: np.random.Generator) -> Paths:
    """True paths of a walk with gains under the phase codes of a policy; unchanged without a RIS panel.

    Where no path over the panel is without walls, the policies that aim take one random code.
    """
    if panel is None or paths.ris is None:
        return paths
    shape = (paths.num_cycles, panel.rows, panel.cols)
    if policy in ("aimed", "exact") and np.any(paths.kind == PathKind.RIS):
        best = focus_codes(paths, panel.levels).index
        index = best if policy == "exact" else best[_middle(paths)]
    else:
        index = rng.integers(panel.levels, size=shape if policy == "random" else shape[1:])
    return rephase(paths, RisCode(index, panel.levels))


def _middle(paths: Paths) -> int:
    """Cycle at which the code of the policy `aimed` is designed: the middle one of those with a direct panel path."""
    there = np.flatnonzero(paths.valid[:, paths.kind == PathKind.RIS].any(axis=1))
    return int(there[len(there) // 2]) if len(there) else 0
