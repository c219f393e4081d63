"""Settings of the filter, and what the agent is told about its start."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats, freeze
from rislam_rt.errors import ConfigError
from rislam_rt.slam.nested.config import ENGINES, WEIGHTINGS

FILTERS = ("rao_blackwellised", "nested", "window")
"""Filters with the same inputs and outputs."""
CLASSIFIERS = ("amplitude", "geometric", "network")
"""Rules by which components are taken for wall returns."""


MAX_BYTES = 1_000_000_000
"""Of the covariances of pose and trail, in all Gaussian particles together: what a small machine has to spare."""
MOST = {"num_particles": 100_000, "window": 10_000, "num_samples": 10_000, "agent_particles": 1_000_000,
        "landmark_particles": 1_000_000}  # fmt: skip
"""Largest counts: ten times and more what any study of this package takes."""


@dataclass(frozen=True, slots=True)
class SlamConfig:
    """Everything that the filter is free to choose. SI units."""

    filter: str = "window"
    """Who localises and maps; all filters have the same inputs and outputs."""
    num_particles: int = 1
    """Gaussian particles that the start prior is split into: more where it is too wide to be linear in."""
    particle_share: float = 0.5
    """Share of the start's variance that lies between the particles, if there are several; the rest is within them."""
    sigma_a: float = 0.01
    """Standard deviation of the white acceleration [m/s^2]."""
    motion: str = "learnt"
    """`learnt`: how lively each step is, `sigma_a` being where to begin; `told`: white acceleration of `sigma_a`."""
    use_vt: bool = True
    """Whether wall returns (virtual transmitters) join the map as planes, or are thrown away as in the paper."""
    heading: str = "known"
    """`known` by a compass, along the `velocity`, or `estimated` as a random walk."""
    turn_std: float = 0.01
    """Random walk of an estimated heading [rad/sqrt(s)]."""
    height: str = "known"
    """`known` keeps the height and the vertical velocity of the start, `estimated` filters them."""
    max_bounces: int = 2
    """Largest number of wall bounces, both legs together, of a landmark path that the agent looks for."""
    gate: float = 16.3
    """Largest squared Mahalanobis distance of delay and two cosines that still associates (chi^2, 3 dof: 0.999)."""
    new_density: float = 0.016
    """Expected components of paths that the map lacks, per metre of length, unit of each cosine, and e-fold of
    amplitude; false ones come on top, as many as the agent is told of its receiver."""
    specular_ratio: float = 0.35
    """Amplitude over that of free space of the same length, above which a component is a wall return."""
    classifier: str = "amplitude"
    """Who tells wall returns from landmark paths: the rule above, `geometric`, or the trained `network`."""
    birth_cycles: int = 12
    """Cycles of history that a track needs before a landmark can come of it, two in three of them with a measurement;
    all of them where the panel's codes may make the gaps."""
    window: int = 40
    """Cycles of history that are kept."""
    birth_margin: float = 9.0
    """By how much chi^2 a hypothesis must win over the next one."""
    max_misses: int = 4
    """Cycles without a component after which a track dies, unless its past lets expect longer gaps."""
    merge_distance: float = 9.0
    """Squared Mahalanobis distance below which two landmarks are one."""
    resample_below: float = 0.5
    """Fraction of the particles that the effective sample size must not fall below."""
    num_samples: int = 32
    """Positions handed to the phase design."""
    agent_particles: int = 2000
    """Agent particles of the nested filter, the most of them while it is adaptive."""
    landmark_particles: int = 6000
    """Its landmark particles, of every landmark for each agent particle; also the most of them."""
    adaptive: bool = True
    """Whether the nested filter takes only as many particles as the spread of its belief needs."""
    weighting: str = "crlb"
    """How amplitudes count in the nested filter: `crlb`, `power`, or `paper`."""
    machine: str = "auto"
    """Where the nested filter runs: `drjit`, `numpy`, or `auto` for Dr.Jit if it can."""

    def __post_init__(self) -> None:
        for name, value, allowed in (
            ("filter", self.filter, FILTERS),
            ("heading", self.heading, ("known", "velocity", "estimated")),
            ("motion", self.motion, ("learnt", "told")),
            ("height", self.height, ("known", "estimated")),
            ("weighting", self.weighting, WEIGHTINGS),
            ("classifier", self.classifier, CLASSIFIERS),
            ("machine", self.machine, ENGINES),
        ):
            if value not in allowed:
                raise ConfigError(f"slam.{name}: '{value}' received; give one of {', '.join(allowed)}")
        for name in ("num_particles", "birth_cycles", "window", "num_samples", "agent_particles", "landmark_particles"):
            if getattr(self, name) < 1:
                raise ConfigError(f"slam.{name}: {getattr(self, name)} received; give at least 1")
        for name, most in MOST.items():
            if getattr(self, name) > most:
                raise ConfigError(f"slam.{name}: {getattr(self, name)} received; give at most {most}")
        size = 8 * self.num_particles * (7 + 4 * self.window) ** 2
        if self.filter == "rao_blackwellised" and size > MAX_BYTES:
            raise ConfigError(
                f"slam.window: {self.window} received with {self.num_particles} particles; covariances would take "
                f"{size / 1e9:.3g} GB of at most {MAX_BYTES / 1e9:g}, give a shorter window or fewer particles"
            )
        if self.window < self.birth_cycles:
            raise ConfigError(f"slam.window: {self.window} received; give at least birth_cycles, {self.birth_cycles}")
        for name in ("sigma_a", "gate", "new_density", "specular_ratio"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise ConfigError(f"slam.{name}: {value} received; give a positive number")
        for name in ("particle_share", "turn_std"):
            value = getattr(self, name)
            if not (np.isfinite(value) and 0.0 <= value < (1.0 if name == "particle_share" else np.inf)):
                raise ConfigError(f"slam.{name}: {value} received; give a share below 1, a spread of at least 0")
        if self.filter == "window" and self.heading == "velocity":
            raise ConfigError("slam.heading: 'velocity' received; the filter 'window' takes 'known' or 'estimated'")
        if not 0.0 < self.resample_below <= 1.0:
            raise ConfigError(f"slam.resample_below: {self.resample_below} received; give a number in (0, 1]")
        if not 0 <= self.max_bounces <= 2:
            raise ConfigError(f"slam.max_bounces: {self.max_bounces} received; give 0, 1 or 2")

    @property
    def axes(self) -> Floats:
        """(3,) ones for the axes that are filtered."""
        return np.array([1.0, 1.0, 1.0 if self.height == "estimated" else 0.0])


@dataclass(frozen=True, slots=True, eq=False)
class StartPrior:
    """What the agent is told about its first pose: a Gaussian about it."""

    position: Floats
    """(3,) [m]."""
    velocity: Floats
    """(3,) [m/s]."""
    heading: float
    """[rad]."""
    position_std: float = 0.01
    """[m], each axis; the height is exact when it is known."""
    velocity_std: float = 0.01
    """[m/s], each axis."""
    heading_std: float = 0.0
    """[rad], where the heading is estimated."""

    def __post_init__(self) -> None:
        freeze(self, "position", np.float64, (3,))
        freeze(self, "velocity", np.float64, (3,))
        for name in ("position_std", "velocity_std", "heading_std"):
            if not getattr(self, name) >= 0.0:
                raise ConfigError(f"start.{name}: {getattr(self, name)} received; give a number that is not negative")
