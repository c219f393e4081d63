"""Result of a run: for each scheme, everything cycle by cycle, and all that is needed to repeat it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers, freeze
from rislam_rt.model.estimate import MapEstimate
from rislam_rt.model.paths import Paths
from rislam_rt.model.plan_view import html_with
from rislam_rt.model.scene import Scene

STEPS = ("optimise", "communicate", "measure", "localise")
"""The four steps of a cycle, in their order."""

NOTHING = -9
"""Value in `SchemeResult.component_path` and `.component_landmark` of a column that holds no component."""


@dataclass(frozen=True, slots=True, eq=False)
class SchemeResult:
    """Result of one scheme (filter and code policy) over K cycles, with P path identities, I landmarks ever held, and
    up to M components a cycle."""

    scheme: str
    """Name of the scheme."""
    time: Floats
    """(K,) [s] of the cycle's measurement."""
    position: Floats
    """(K, 3) [m] estimated positions of the agent."""
    velocity: Floats
    """(K, 3) [m/s] estimated velocities of the agent."""
    heading: Floats
    """(K,) [rad] headings of the agent."""
    covariance: Floats
    """(K, 6, 6) covariance of position and velocity, as the filter believes."""
    sent: Integers
    """(K, N, M) code that the agent sent; (K, 0, 0) without a panel."""
    applied: Integers
    """(K, N, M) code that the panel was set to while the signals were taken."""
    levels: int
    """H, the number of phase levels of both."""
    gain: Complexes
    """(K, P) true path gains under the applied code."""
    component_path: Integers
    """(K, M) truth, for scoring only: path column of each component, -1 for clutter, `NOTHING` beyond their number."""
    component_landmark: Integers
    """(K, M) number of the landmark, wall, image or pair of walls that the agent took each component for, as
    docs/files.md says; -1 clutter or unused, -2 removed as LOS or wall return, `NOTHING` beyond their number."""
    ident: Integers
    """(I,) numbers of all landmarks that were ever held."""
    parent: Integers
    """(I,) number of the landmark whose mirror image this is, -1 for a point."""
    held: Booleans
    """(K, I) whether the landmark was in the map."""
    landmark_position: Floats
    """(K, I, 3) its estimated position [m], zero where it was not held."""
    ris_probability: Floats
    """(K, I) probability that the landmark is a RIS panel."""
    seconds: Floats
    """(K, 4) time [s] that each of `STEPS` took."""
    info: Mapping[str, Floats]
    """Diagnostics of the filter, (K,) each."""
    outcome: tuple[str, ...]
    """(K,) how each cycle went, by the filter's own word."""
    map: MapEstimate
    """Estimated map after the last cycle."""
    panel: Any = None
    """(K, I) which of several RIS panels `ris_probability` is about; None: there is one."""
    smoothed: Any = None
    """(K, 3) [m] positions smoothed with later measurements, of filters that do so (`slam.filter = "window"`: 40 cycles
    later, fewer at the end); None of others, and of runs in slices."""
    start_position: Any = None
    """(3,) [m] position that the estimator was told at the start, its prior's mean; None where that is not known."""
    given: Any = None
    """What the estimator was given, cycle by cycle, and the seed that it drew from
    (`rislam_rt.pipeline.recordings.inputs.RecordedInputs`); None where the result was read from a file: it
    lies in one of its own."""

    def __post_init__(self) -> None:
        cycles, held = np.shape(self.position)[0], len(np.asarray(self.ident))
        freeze(self, np.float64, time=(cycles,), position=(cycles, 3), velocity=(cycles, 3), heading=(cycles,))
        freeze(self, np.float64, covariance=(cycles, 6, 6))
        freeze(self, np.int64, sent=(cycles, None, None), applied=(cycles, None, None))
        freeze(self, np.complex128, gain=(cycles, None))
        freeze(self, np.int64, component_path=(cycles, None), component_landmark=(cycles, None))
        freeze(self, np.int64, ident=(held,), parent=(held,))
        freeze(self, np.bool_, held=(cycles, held))
        freeze(self, np.float64, landmark_position=(cycles, held, 3), ris_probability=(cycles, held))
        freeze(self, np.float64, seconds=(cycles, len(STEPS)))
        if self.panel is not None:
            freeze(self, np.int64, panel=(cycles, held))
        if self.smoothed is not None:
            freeze(self, np.float64, smoothed=(cycles, 3))
        if self.start_position is not None:
            freeze(self, np.float64, start_position=(3,))

    def named(self, panel: int) -> Booleans:
        """Whether (K, I) each landmark of a scheme's result was identified as a RIS panel (above one half)."""
        return (self.ris_probability > 0.5) & (panel == (0 if self.panel is None else self.panel))

    def __repr__(self) -> str:
        ended = self.outcome[-1] if self.outcome else "before it began"
        return f"SchemeResult '{self.scheme}': {len(self.position)} cycles, ended {ended}; {self.map!r}"


@dataclass(frozen=True, slots=True, eq=False)
class SlamResult:
    """Result of a whole run: true scene and paths, each scheme's result, and all that is needed to repeat it."""

    name: str
    """Name of the pipeline."""
    scene: Scene
    """The true room, with the trajectory cut to the cycles of the run."""
    paths: Paths
    """The true paths, panel at level 0; each scheme holds its own gains."""
    schemes: Mapping[str, SchemeResult]
    """Result of each scheme, by name."""
    config: Mapping[str, Any]
    """The whole specification of the run, defaults filled in."""
    seed: int | None
    """Seed of the run; None if the caller gave a generator of another origin."""
    versions: Mapping[str, str]
    """Versions of this package, of Python and of the libraries that numbers depend on."""
    seconds: Mapping[str, float] = field(default_factory=dict)
    """Time [s] of the stages that all schemes share."""
    warnings: tuple[str, ...] = ()
    """Warnings of formulas used outside their range of validity, one line each."""

    def __repr__(self) -> str:
        errors = ", ".join(f"{name} {self._rmse(scheme):.3g} m" for name, scheme in self.schemes.items())
        seed = "no seed" if self.seed is None else f"seed {self.seed}"
        about = f"SlamResult '{self.name}' in '{self.scene.name}', {seed}, {len(self.scene.agent)} cycles"
        return f"{about}; RMSE: {errors}"

    def _repr_html_(self) -> str:
        ways = ((name, scheme.position) for name, scheme in self.schemes.items())
        return html_with(repr(self), self.scene.plan(("true way", self.scene.agent.position), *ways))

    def _rmse(self, scheme: SchemeResult) -> float:
        """Root mean square of the horizontal position error [m] of a scheme in the result, over all cycles."""
        error = (scheme.position - self.scene.agent.position)[:, :2]
        return float(np.sqrt(np.mean(np.sum(error**2, axis=1)))) if len(error) else 0.0
