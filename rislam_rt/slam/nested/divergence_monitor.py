"""Monitor of divergence: does the filter still follow the room, and what does the motion model make of it?

An agent that turns harder than its motion model allows shows first in the innovations, then its landmarks stop showing
where they are expected. Either makes the model livelier until measurements fit again.
"""

from typing import NamedTuple

SLOW, QUICK = 0.05, 0.2
"""Shares of the latest cycle in the running means."""
MAX_STRAIN, MAX_QUICK, MIN_FOUND = 3.0, 1.8, 0.5
"""NIS per degree of freedom beyond which the filter counts as diverged, and beyond which the motion model is too tame;
share of the certain returns below which it counts as lost."""
SPUR, CALM, MAX_HASTE = 1.3, 0.95, 30.0
"""Factors a cycle by which the motion model becomes livelier and tamer again, and its limit."""


class DivergenceMonitor(NamedTuple):
    """Running means of how well measurements fit."""

    strain: float = 1.0
    """NIS per degree of freedom, slowly: 1 when all is well."""
    quick: float = 1.0
    """The same, quickly."""
    found: float = 1.0
    """Share of the returns that should certainly show, and did."""
    haste: float = 1.0
    """Factor on the standard deviation of the acceleration."""

    @property
    def diverged(self) -> bool:
        """Whether the filter has diverged: measurements contradict the belief, or have lost touch with it."""
        return self.strain > MAX_STRAIN or self.found < 0.2


def check(monitor: DivergenceMonitor, nis: float, dof: int, seen: float, due: float) -> DivergenceMonitor:
    """The divergence monitor after a cycle whose NIS has `dof` degrees, in which `seen` of `due` sure returns showed.

    Both count a return by the share of the cycles in which it showed lately: what has long been silent is blocked, or
    was never there, and says nothing of the agent.
    """
    ratio = nis / dof if dof else monitor.quick
    strain = monitor.strain + SLOW * (ratio - monitor.strain)
    quick = monitor.quick + QUICK * (ratio - monitor.quick)
    found = monitor.found + QUICK * (seen / due - monitor.found) if due else monitor.found
    tame = quick > MAX_QUICK or found < MIN_FOUND
    haste = min(monitor.haste * SPUR, MAX_HASTE) if tame else max(monitor.haste * CALM, 1.0)
    return DivergenceMonitor(strain, quick, found, haste)
