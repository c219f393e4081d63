"""Constants of the filters' model: physical quantities and stated levels, each with its source.

The window filter's; the nested filter shares those of a landmark's identity.
"""

from typing import NamedTuple

import numpy as np


class ModelConstants(NamedTuple):
    """SI units; probabilities are a cycle's unless said otherwise."""

    window: int = 40
    """Poses that are re-linearised: a batch over 40 cycles does what one over the run does."""
    rare: float = 0.02
    """Probability of what happens every 5 s: the motion mode changes; something comes to stand in a path's way."""
    tail: float = 4.0
    """Degrees of freedom of Student's t, where the receiver tells no tails: neighbours that the map lacks."""
    wall_ratio: float = -0.6
    """Mean log amplitude reflection of a wall: concrete to plasterboard at 10 GHz, ITU-R P.2040."""
    wall_ratio_std: float = 0.5
    """Its spread over building materials."""
    fading: float = 0.3
    """Spread of one amplitude about its law: angle of incidence, neighbours."""
    strength: float = 0.15
    """Median root of a scatterer's cross-section [m]: a sphere of 0.08 m radius."""
    strength_std: float = 1.2
    """Spread of its logarithm."""
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
    """Posterior probability of a kind from which on a feature enters the map."""
    fit: float = 3.0
    """Standard deviations of its cost above which a hypothesis does not fit at all."""
    company: float = 0.25
    """Probability that a new track shares its cell with another path: 0.2 to 0.35 of traced components, whatever their
    SNR (docs/slam_measured.md)."""
    memory: float = 4.0
    """Cycles over which the pull of such neighbours keeps its sign: phases turn once in half a wavelength of motion."""
    cleared: float = 0.05
    """Probability that in a cycle what stands in the way of a path goes away again."""
    depth: float = 0.15
    """Distance [m] beyond a wall from which on a thing is behind it, and not on it: furniture, frames."""
    shown: float = 0.95
    """Probability that a path above the threshold with nothing in its way is reported by itself."""
    law: float = 0.05
    """Relative error of predicted amplitudes: geometry, and what the amplitude law leaves out."""
    walk: float = 1.0
    """Standard deviation [m/s] of a velocity of which nothing is known; as far [m] an agent goes astray."""
    level: float = 0.001
    """Standard deviation [m/s^2] of the vertical acceleration in the calmest motion mode: wheels on a level floor."""
    calmest: float = 0.003
    """The same of the horizontal one: a rail car..."""
    liveliest: float = 1.0
    """...and in the liveliest mode: a person who turns on the spot."""

    @property
    def stay(self) -> float:
        """Probability that a step is as lively as the one before."""
        return 1.0 - self.rare

    @property
    def dead(self) -> float:
        """Probability of existence below which a feature is taken back."""
        return self.rare

    @property
    def log_lost(self) -> float:
        """Log probability that a cycle is the one in which the agent is lost: two rare things at once."""
        return 2.0 * self.log_rare

    @property
    def max_log_ratio(self) -> float:
        """Most that one observation may add to log odds: what was observed is a rare thing of another kind."""
        return -self.log_rare

    @property
    def log_born(self) -> float:
        """Log odds from which on a thing is held for true."""
        return float(np.log(self.born / (1.0 - self.born)))

    @property
    def log_rare(self) -> float:
        """Of an unannounced manoeuvre; of a thing behind a wall; of two walls neither of which is heard by itself."""
        return float(np.log(self.rare))

    @property
    def dip(self) -> float:
        """Sine of the depth below the horizon from which a return still arrives, for every wall on its way: each
        leans, and turns the ray by twice that."""
        return 2.0 * self.lean

    @property
    def weaker(self) -> float:
        """Share of the weaker of two paths that are a wall's loss apart in the place of both, and its spread."""
        return float(1.0 / (1.0 + np.exp(-self.wall_ratio)))

    @property
    def steady(self) -> float:
        """Probability that nothing stands in the way of a leg that was not looked for before."""
        return self.cleared / (self.cleared + self.rare)

    @property
    def crowd(self) -> float:
        """Mean square of a residual in reported deviations beforehand: as much as still fits."""
        return self.fit**2

    @property
    def against(self) -> float:
        """Median squared residual (3 dof, half are below 2.4) from which on measurements contradict a feature."""
        return self.fit**2

    @property
    def log_volume(self) -> float:
        """Of the space in which features are looked for [m^3]."""
        return float(np.log(4.0 / 3.0 * np.pi * self.size**3))

    @property
    def log_upright(self) -> float:
        """Log odds of an upright or level surface."""
        return float(np.log(self.upright / (1.0 - self.upright)))


CONSTANTS = ModelConstants()
