"""What the front end (association, births, map keeping) asks of an engine, and the engines there are."""

from typing import Any, NamedTuple, Protocol

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.model import Body
from rislam_rt.slam import gaussian
from rislam_rt.slam.birth import Birth
from rislam_rt.slam.config import SlamConfig, StartPrior
from rislam_rt.slam.moments import Moments
from rislam_rt.slam.nested import operations as nested
from rislam_rt.slam.returns import Returns


class Told(NamedTuple):
    """What an update says about itself; every engine's update has at least these fields."""

    particles: Any
    log_evidence: float
    """Log density of the measurements given all before."""
    white: Floats
    """(A, 3) innovation of each return by itself, whitened: standard normal when all is well."""
    nis: float
    """Squared innovation of the mean belief, normalised; chi^2 with 3 A degrees of freedom."""


class Engine(Protocol):
    """A representation of the belief over pose, recent poses and features. Pure: every operation returns a new one."""

    def begin(self, start: StartPrior, config: SlamConfig, *, rng: np.random.Generator) -> Any:
        """The start prior, without features."""

    def furnish(self, particles: Any, features: Floats, covariance: Floats) -> Any:
        """F features (F, 3) known beforehand, with a covariance (3F, 3F)."""

    def propagate(
        self,
        particles: Any,
        dt: float,
        accelerate: Floats,
        heading: float,
        slot: int,
        config: SlamConfig,
        *,
        rng: np.random.Generator,
    ) -> Any:
        """White acceleration of standard deviations `accelerate` (3,) over `dt`; the new pose is kept in `slot`."""

    def moments(self, particles: Any) -> Moments:
        """Mean and covariance over pose and features."""

    def trail(self, particles: Any, slots: Integers) -> tuple[Floats, Floats]:
        """Mean positions (K, 3) and headings (K,) of past poses."""

    def update(
        self,
        particles: Any,
        returns: Returns,
        twin: Returns,
        anchor: Floats,
        body: Body,
        seen: Floats,
        std: Floats,
        *,
        rng: np.random.Generator,
    ) -> Any:
        """The belief after A returns were seen, and what `Told` lists.

        `twin` is the return that each came out as one with, halfway between; itself where it stands alone.
        """

    def settle(self, particles: Any, birth: Birth, body: Body, *, rng: np.random.Generator) -> Any:
        """One more feature, from the history of a track."""

    def drop(self, particles: Any, keep: Booleans) -> Any:
        """Only the features (F,) that are kept."""

    def thin(self, particles: Any, config: SlamConfig, *, rng: np.random.Generator) -> tuple[Any, bool]:
        """Resampled where that is due, and whether it was."""

    def effective_size(self, particles: Any) -> float:
        """Effective number of agent particles."""


ENGINES: dict[str, Engine] = {"rao_blackwellised": gaussian, "nested": nested}
"""By the name of `SlamConfig.filter`."""


def engine_of(config: SlamConfig) -> Engine:
    """The engine that the settings name."""
    return ENGINES[config.filter]
