"""How a walk sets the panel: codes of several policies, the same for all scores."""

import numpy as np

from rislam_rt.design import focus_codes
from rislam_rt.model import DataSheet, PathKind, Paths, RisCode
from rislam_rt.ris import rephase

POLICIES = ("random", "held", "aimed", "exact")
"""A random code each cycle; one random code; the best for the direct path from the middle of the walk, held; the best
for the direct path in each cycle."""
AIMED = tuple(POLICIES.index(name) for name in ("aimed", "exact"))
"""Those that know where the agent is."""


def set_codes(paths: Paths, panel: DataSheet | None, policy: str, *, rng: np.random.Generator) -> Paths:
    """The paths of a walk under the codes of a policy; as they are without a panel.

    With no direct path among them, the policies that aim take one random code.
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
    """Cycle at which a code is aimed: the middle one of those with a direct path over the panel."""
    there = np.flatnonzero(paths.valid[:, paths.kind == PathKind.RIS].any(axis=1))
    return int(there[len(there) // 2]) if len(there) else 0
