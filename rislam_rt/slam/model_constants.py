"""Constants of the filters' model: physical quantities and stated levels, each with its source.

The window filter's; the nested filter shares those of a landmark's identity.
"""

from typing import NamedTuple

import numpy as np


class ModelConstants(NamedTuple):
    """Constants of the SLAM filters' model, in SI units; probabilities are a cycle's unless said otherwise."""

    window: int = 40
    """Number of poses that are re-linearised: a batch over 40 cycles does what one over the run does."""
    rare: float = 0.02
    """Probability of a rare event, one in 5 s: the motion mode changes; an obstacle comes to block a path."""
    tail: float = 4.0
    """Degrees of freedom of the residuals' Student's t, where the receiver tells none: neighbours the map lacks."""
    wall_ratio: float = -0.6
    """Mean log amplitude reflection of a wall: concrete to plasterboard at 10 GHz, ITU-R P.2040."""
    wall_ratio_std: float = 0.5
    """Standard deviation of a wall's log amplitude reflection over building materials."""
    fading: float = 0.3
    """Standard deviation of one log amplitude about its law: angle of incidence, neighbours."""
    strength: float = 0.15
    """Median root of a scatterer's cross-section [m]: a sphere of 0.08 m radius."""
    strength_std: float = 1.2
    """Standard deviation of the logarithm of the root of a scatterer's cross-section."""
    panels: float = 0.1
    """Panels per scatterer, where there is a panel at all: one in a room, among what is found in it."""
    lean: float = 0.01
    """Standard deviation [rad] of an upright wall's lean: building tolerance, as level returns do not tell it."""
    square: float = 0.7
    """Share of upright walls that stand at right angles to another."""
    upright: float = 0.9
    """Share of upright or level surfaces among those that are seen level or from below."""
    size: float = 15.0
    """Radius [m] of the volume in which features are looked for."""
    born: float = 0.95
    """Posterior probability of a birth hypothesis from which on its feature enters the map."""
    fit: float = 3.0
    """Standard deviations of its cost above which a birth hypothesis does not fit at all."""
    company: float = 0.25
    """Probability that a new track, or a return that is missed, shares the cell of another path: 0.2 to 0.35 of traced
    components do, whatever their SNR (docs/slam_measured.md)."""
    memory: float = 4.0
    """Cycles over which an unresolved neighbour's pull keeps its sign: phases turn once in half a wavelength moved."""
    cleared: float = 0.05
    """Probability that an obstacle which blocks a path goes away again in a cycle."""
    depth: float = 0.15
    """Distance [m] beyond a wall from which on a thing is behind it, and not on it: furniture, frames."""
    shown: float = 0.95
    """Probability that a path above the threshold and not occluded is reported as a component of its own."""
    law: float = 0.05
    """Relative error of predicted amplitudes: geometry, and what the amplitude law leaves out."""
    walk: float = 1.0
    """Standard deviation [m/s] of a velocity of which nothing is known, and [m] of the position of a lost agent."""
    level: float = 0.001
    """Standard deviation [m/s^2] of the vertical acceleration in the calmest motion mode: wheels on an uneven floor."""
    calmest: float = 0.003
    """Standard deviation [m/s^2] of the horizontal acceleration in the calmest motion mode: a rail car."""
    liveliest: float = 1.0
    """Standard deviation [m/s^2] of the horizontal acceleration in the liveliest mode: a person turns on the spot."""

    @property
    def stay(self) -> float:
        """Model constant: probability that the motion mode of a step is that of the step before."""
        return 1.0 - self.rare

    @property
    def dead(self) -> float:
        """Model constant: probability of existence below which a feature is removed from the map."""
        return self.rare

    @property
    def log_lost(self) -> float:
        """Model constant: log prior probability that the agent is lost in a cycle, two rare events at once."""
        return 2.0 * self.log_rare

    @property
    def max_log_ratio(self) -> float:
        """Model constant: largest change of log odds by one observation, which may be a rare event of another kind."""
        return -self.log_rare

    @property
    def log_born(self) -> float:
        """Model constant: log odds above which a hypothesis is held for true."""
        return float(np.log(self.born / (1.0 - self.born)))

    @property
    def log_rare(self) -> float:
        """Model constant: log probability of an unannounced manoeuvre, a thing behind a wall, two walls neither of
        which is heard, a new wall that is small."""
        return float(np.log(self.rare))

    @property
    def dip(self) -> float:
        """Model constant: sine of the depth below the horizon from which a return still arrives, for every wall on its
        way: each leans, and turns the ray by twice that."""
        return 2.0 * self.lean

    @property
    def sway(self) -> float:
        """Model constant: largest standard deviation [rad] of the body's attitude; of more, level returns would not be
        looked for."""
        return self.dip

    @property
    def weaker(self) -> float:
        """Model constant: weight of the weaker of two unresolved paths, a wall's loss apart, in their component; and
        its deviation."""
        return float(1.0 / (1.0 + np.exp(-self.wall_ratio)))

    @property
    def steady(self) -> float:
        """Model constant: prior probability that nothing blocks a leg that was not looked for before."""
        return self.cleared / (self.cleared + self.rare)

    @property
    def crowd(self) -> float:
        """Model constant: prior mean square of a residual in reported standard deviations, as much as still fits."""
        return self.fit**2

    @property
    def against(self) -> float:
        """Model constant: median squared residual (3 dof, half are below 2.4) that contradicts a feature."""
        return self.fit**2

    @property
    def log_volume(self) -> float:
        """Model constant: logarithm of the volume [m^3] in which features are looked for."""
        return float(np.log(4.0 / 3.0 * np.pi * self.size**3))

    @property
    def log_upright(self) -> float:
        """Model constant: prior log odds that a surface is upright or level."""
        return float(np.log(self.upright / (1.0 - self.upright)))


CONSTANTS = ModelConstants()
"""The constants of the model that all filters use."""
