"""Replay of recorded inputs through an estimator, cycle by cycle, and the estimates that it returns."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.blas_threads import in_one_blas_thread
from rislam_rt.errors import ConfigError, GeometryError, expect
from rislam_rt.model import Body, DataSheet, MapEstimate, Measurement, RisCode, SlamEstimate, empty_map
from rislam_rt.pipeline.assumed_model import tell_settings
from rislam_rt.pipeline.estimate_checks import check_estimate
from rislam_rt.pipeline.estimators import ESTIMATORS, Estimator, OwnDiagnostics
from rislam_rt.pipeline.recordings.inputs import Inputs
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings
from rislam_rt.pipeline.specification.read_pipeline import Table, build_spec
from rislam_rt.progress import Tell, tell_nobody
from rislam_rt.slam import StartPrior
from rislam_rt.toml import put_dotted


class Answers(NamedTuple):
    """Estimates, diagnostics and computing time of an estimator over the cycles of a recording."""

    estimates: tuple[SlamEstimate, ...]
    """(K,) pose and map after each cycle."""
    infos: tuple[Any, ...]
    """(K,) diagnostics; of each, `landmark` and `outcome` are read."""
    seconds: float
    """Mean CPU time [s] of a cycle, step and estimate."""
    maps_over_time: bool = True
    """Whether each estimate has the map of its cycle. Else the last alone has one: when a landmark came into the map,
    and what was in it and is no more, is not known."""


def answers_from_arrays(
    inputs: Inputs, position: Floats, covariance: Floats | None = None, maps: Sequence[MapEstimate] | None = None,
    lost: Booleans | None = None, landmark: Sequence[Integers] | None = None,
) -> Answers:  # fmt: skip
    """Answers of an external estimator to a recording, from plain arrays of positions and maps, so they can be scored.

    Parameters
    ----------
    position
        (K, 3) estimates [m].
    covariance
        (K, 3, 3) of the position [m^2]; without it there is no NEES.
    maps
        (K,) one a cycle, or the last one alone, from which neither delays nor births can be scored; without them the
        map is empty.
    lost
        (K,) whether the estimator holds itself for lost.
    landmark
        (K,) numbers (M,) of the landmarks, as in the maps, that each cycle's components were associated with.

    Raises
    ------
    ConfigError
        An array is of another shape, or a covariance or map cannot be; the line names it.
    """
    if isinstance(maps, MapEstimate):
        raise ConfigError("maps: one MapEstimate received; give a list, of one a cycle or of the last alone")
    cycles, known = len(inputs.time), list(maps or [])
    for name, given, wanted in (
        ("position", position, (cycles, 3)), ("covariance", covariance, (cycles, 3, 3)), ("lost", lost, (cycles,)),
    ):  # fmt: skip
        if given is not None and np.shape(given) != wanted:
            raise ConfigError(f"{name}: shape {np.shape(given)} received; give {wanted}, a row a cycle")
    if len(known) not in (0, 1, cycles):
        raise ConfigError(f"maps: {len(known)} received; give {cycles}, one a cycle, or the last one alone")
    if landmark is not None and len(landmark) != cycles:
        raise ConfigError(f"landmark: {len(landmark)} received; give {cycles}, one a cycle")
    for cycle, (own, heard) in enumerate(zip(landmark or (), inputs.measurements, strict=False)):
        if np.shape(own) != (len(heard),):
            raise ConfigError(
                f"landmark: cycle {cycle}: shape {np.shape(own)} received; give ({len(heard)},), one a component"
            )
    found = (cycles - len(known)) * [empty_map()] + known
    spread = np.zeros((cycles, 6, 6))
    if covariance is not None:
        spread[:, :3, :3] = covariance
    known_heading = np.where(np.isnan(inputs.heading), inputs.start.heading, inputs.heading)
    rows = zip(position, known_heading, spread, found, strict=True)
    estimates = []
    for cycle, (place, heading, cov, one) in enumerate(rows):
        try:
            made = SlamEstimate(place, np.zeros(3), float(heading), cov, np.zeros((0, 3)), inputs.body, one)
        except GeometryError as error:
            raise ConfigError(f"cycle {cycle}: {str(error).removeprefix('SlamEstimate.')}") from None
        estimates.append(check_estimate(made, f"cycle {cycle}"))
    none = [np.full(len(m), -1) for m in inputs.measurements]
    said = np.zeros(cycles, dtype=np.bool_) if lost is None else lost
    told = zip(landmark or none, said, strict=True)
    infos = tuple(OwnDiagnostics(np.asarray(own), "diverged" if is_lost else "ok") for own, is_lost in told)
    return Answers(tuple(estimates), infos, 0.0, maps_over_time=len(known) != 1 or cycles == 1)


class Recorder:
    """Wrapper of an estimator that records its inputs, estimates, diagnostics and computing time."""

    def __init__(self, inner: Estimator) -> None:
        self.inner = inner
        self.begin: tuple[StartPrior, Body, DataSheet | None]
        self.steps: list[tuple[Measurement, RisCode | None, float, float]] = []
        self.estimates: list[SlamEstimate] = []
        self.infos: list[Any] = []
        self.seconds = 0.0

    @property
    def estimator(self) -> Estimator:
        """Functions to be used in place of the wrapped estimator's, which record for a replay what passes."""
        return self.inner._replace(init=self._init, step=self._step, estimate=self._estimate)

    @property
    def inputs(self) -> Inputs:
        """All inputs that the estimator got so far, for its replay."""
        measurements, codes, dt, heading = zip(*self.steps, strict=True)
        return Inputs(*self.begin, np.cumsum(dt), np.array(heading, dtype=np.float64), measurements, codes)

    @property
    def answers(self) -> Answers:
        """All estimates and diagnostics that the wrapped estimator returned so far, and its mean time, as recorded for
        a replay."""
        return Answers(tuple(self.estimates), tuple(self.infos), self.seconds / max(len(self.steps), 1))

    def _init(
        self, start: StartPrior, body: Body, panel: DataSheet | None, *settings: Any, rng: np.random.Generator
    ) -> Any:
        self.begin = start, body, panel
        return self.inner.init(start, body, panel, *settings, rng=rng)

    def _step(
        self, state: Any, measurement: Measurement, code: RisCode | None, dt: float, heading: float, config: Any,
        *, rng: np.random.Generator,
    ) -> Any:  # fmt: skip
        self.steps.append((measurement, code, dt, heading))
        begin = process_time()
        state, info = self.inner.step(state, measurement, code, dt, heading, config, rng=rng)
        self.seconds += process_time() - begin
        self.infos.append(info)
        return state, info

    def _estimate(self, state: Any, config: Any) -> SlamEstimate:
        begin = process_time()
        found: SlamEstimate = self.inner.estimate(state, config)
        self.seconds += process_time() - begin
        self.estimates.append(found)
        return found


@in_one_blas_thread
def replay(
    inputs: Inputs, config: Mapping[str, Any], scheme: str, changes: Mapping[str, Any] | None = None,
    estimator: Estimator | None = None, *, rng: np.random.Generator, progress: Tell = tell_nobody,
) -> Answers:  # fmt: skip
    """Run an estimator on the recorded inputs of a run, cycle by cycle, and return its estimates; no paths are traced.

    Phase codes are those of the recording, even if the estimator's belief would have led to others. Where no component
    says whether it ran over a panel, the codes did not alternate, whatever `config` says.

    Parameters
    ----------
    config
        The specification of the recorded run.
    scheme
        Its name, which says whose estimator is run, unless `estimator` gives one; `module:Class` is one's own.
    changes
        Settings by dotted key, as `slam.filter`.
    progress
        Called after each cycle with `scheme`, the cycles done and their number.

    Raises
    ------
    ConfigError
        A setting is unknown, or its value unusable; `estimator` is none, or `rng` no generator.
    """
    if not isinstance(estimator, Estimator | None):
        raise ConfigError(
            f"estimator: {type(estimator).__name__} received; give an Estimator, or for a class of your own its name "
            "as the scheme, 'module:Class'"
        )
    expect("rng", rng, np.random.Generator)
    content = dict(config)
    for key, value in (changes or {}).items():
        content = put_dotted(content, key, value)
    spec = build_spec(Table(Path("settings of the replay"), content, ()), PipelineSpec, build_settings)
    alternated = any(one.from_panel is not None for one in inputs.measurements)
    panels = 1 if inputs.panel is None else len(inputs.panel.panels)
    settings = tell_settings(build_settings(spec, panels if alternated else 0), spec.told)
    recorder = Recorder(estimator or ESTIMATORS[SCHEMES[scheme].estimator])
    run = recorder.estimator
    own = run.config(settings)
    state = run.init(inputs.start, inputs.body, inputs.panel, settings.sensor, own, rng=rng)
    steps = zip(inputs.measurements, inputs.codes, np.diff(inputs.time, prepend=0.0), inputs.heading, strict=True)
    for cycle, (measurement, code, dt, heading) in enumerate(steps):
        state, _ = run.step(state, measurement, code, float(dt), float(heading), own, rng=rng)
        run.estimate(state, own)
        progress(scheme, cycle + 1, len(inputs.time))
    return recorder.answers
