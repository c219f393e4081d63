"""One cycle of the protocol: design a phase code, send it to the panel, measure, update pose and map.

Designer and filter get the measurement, the code that the agent holds to be applied, the time step and the compass
heading; they never get the true paths and poses.
"""

from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import Any, NamedTuple, Protocol

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.measurement import Clutter, FrontEnd, measure
from rislam_rt.model import DataSheet, Measurement, Paths, PathTruth, RisCode, SlamEstimate, Trajectory
from rislam_rt.pipeline.assumed_model import AssumedModel, tell_measurement
from rislam_rt.pipeline.control_link import ControlLink, message_seconds, send_code
from rislam_rt.pipeline.estimators import Estimator
from rislam_rt.pipeline.seeds import Seeds, child
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, Settings
from rislam_rt.ris import PanelErrors, rephase


class GroundTruth(NamedTuple):
    """True paths, motion and hardware errors of a run, which the agent does not see."""

    paths: Paths
    """True paths as the array measures them (`assumed_model.perceived_paths`)."""
    trajectory: Trajectory
    """True motion over all cycles of the run."""
    doppler: Floats
    """(K, P) Doppler shifts [Hz], which turn the paths' phases within the measurement slot."""
    faults: PanelErrors | None = None
    """Hardware errors of the RIS panel; None without a panel."""
    first: int = 0
    """The cycle that `paths` begin at."""
    front_end: FrontEnd | None = None
    """Impairments of the receiver's front end; None for an ideal one."""
    clutter: Clutter | None = None
    """Diffuse and diffracted paths, received with the others; None if there are none."""

    def at(self, cycle: int) -> Paths:
        """True paths of one cycle of the protocol alone."""
        return self.paths.of_cycle(cycle - self.first)


class Agent(NamedTuple):
    """State that the agent carries from cycle to cycle: of its estimator, its control link and its receiver."""

    state: Any
    """Of the estimator."""
    link: ControlLink | None
    """Control link to the RIS panel; None without a panel."""
    heard: Measurement | None = None
    """Measurement of the cycle before, with which the receiver's search begins."""


class Receptions(dict[tuple[int, bytes, int], tuple[Measurement | None, Measurement, PathTruth, float]]):
    """Cache of the measurements of a run's cycles, shared by the schemes that applied the same phase codes.

    A cycle's noise is the same for all schemes. Its components depend besides on the applied code and on the
    measurement of the cycle before, with which the search begins: the very same object means the same codes so far.
    """

    def measure(
        self, cycle: int, code: bytes, previous: Measurement | None,
        receive: Callable[[], tuple[Measurement, PathTruth]],
    ) -> tuple[Measurement, PathTruth, float]:  # fmt: skip
        """Return a cycle's measurement, its true paths and the seconds it took; `receive` is called if none is kept."""
        key = cycle, code, id(previous)
        if key not in self:
            begin = perf_counter()
            found = receive()
            self[key] = previous, *found, perf_counter() - begin  # keeps `previous` alive: no other object has its id
        return self[key][1:]


class RunContext(NamedTuple):
    """What stays the same over all cycles of a scheme: panel, code policy, estimator, true settings, assumed model."""

    panel: DataSheet | None
    """True data sheet of the RIS panels; None without a panel."""
    designer: "CodePolicy | None"
    """Chooses the phase code of each cycle; None without a panel."""
    estimator: Estimator
    spec: PipelineSpec
    settings: Settings
    """True settings, for channel and receiver."""
    told: AssumedModel
    """Assumed model, for estimator and code design."""
    seeds: Seeds
    """Of the run; receiver and control messages draw from a child for each cycle."""
    filter_rng: np.random.Generator
    """Generator of the estimator, over all cycles."""
    design_rng: np.random.Generator
    """Generator of the code designer, over all cycles."""
    receptions: Receptions | None = None
    """Measurements of schemes that ran before with the same codes; None to keep none."""


class Cycle(NamedTuple):
    """Record of one cycle: estimate, diagnostics, measurement and its true paths, phase codes and times."""

    estimate: SlamEstimate
    info: Any
    """Diagnostics of the estimator."""
    measurement: Measurement
    """As the estimator got it."""
    truth: PathTruth
    """True path of each component."""
    gain: Any
    """(P,) true path gains under the applied code."""
    sent: RisCode | None
    applied: RisCode | None
    seconds: tuple[float, float, float, float]
    """Times [s] of optimise, communicate, measure, localise."""
    believed: RisCode | None = None
    """Phase code that the agent holds to be applied."""


class CodePolicy(Protocol):
    """Function that chooses the RIS panel's next phase code from the predicted belief."""

    def __call__(
        self, belief: Callable[[], SlamEstimate], cycle: int, room: GroundTruth, *, rng: np.random.Generator
    ) -> RisCode:
        """Return the phase code to send in a cycle.

        `belief` is a function that predicts the belief, as not all policies need it; `room` is for the genie alone.
        """
        ...


def run_cycle(agent: Agent, room: GroundTruth, cycle: int, context: RunContext) -> tuple[Agent, Cycle]:
    """Run one cycle of one scheme: design a code, send it, measure, update; return the agent and the cycle's record."""
    control, estimator, told = context.spec.control, context.estimator, context.told
    config = estimator.config(told.settings)
    dt = float(told.time[cycle] - told.time[cycle - 1]) if cycle else 0.0
    clock = [perf_counter()]

    link, sent = agent.link, None
    if link is not None and context.designer is not None:
        ahead = dt + control.delay_cycles * usual_step(told.time)
        belief = partial(estimator.predict, agent.state, ahead, config)
        sent = context.designer(belief, cycle, room, rng=context.design_rng)
    clock.append(perf_counter())

    air = 0.0
    if link is not None and sent is not None and context.panel is not None:
        message_rng = child(context.seeds.control, cycle)
        link = send_code(link, sent, control, rng=message_rng, bit_flip=context.spec.panel.bit_flip)
        air = message_seconds(context.panel, control)
    clock.append(perf_counter())

    paths, applied = room.at(cycle), None
    if link is not None:
        applied = link.applied if room.faults is None else room.faults.applied(link.applied)
        paths = rephase(paths, applied, 1.0 if room.faults is None else room.faults.weight)
    row = cycle - room.first
    clutter = None if room.clutter is None else room.clutter.of_cycle(row)
    kept = Receptions() if context.receptions is None else context.receptions
    measurement, truth, acquired = kept.measure(
        cycle, b"" if applied is None else applied.index.tobytes(), agent.heard,
        lambda: measure(
            paths, 0, float(room.trajectory.heading[cycle]), context.settings.radio, context.settings.receiver,
            agent.heard, room.doppler[row], room.front_end, clutter, rng=child(context.seeds.noise, cycle),
        ),
    )  # fmt: skip
    clock.append(perf_counter())

    believed = link.believed if link is not None else None
    reported = tell_measurement(measurement, context.spec.told)
    heading = float(told.heading[cycle])
    state, info = estimator.step(agent.state, reported, believed, dt, heading, config, rng=context.filter_rng)
    found = estimator.estimate(state, config)
    clock.append(perf_counter())

    optimise, communicate, _, localise = np.diff(clock)
    outcome = Cycle(
        found, info, reported, truth, paths.gain[0], sent, applied,
        (optimise, communicate + air, acquired, localise), believed,
    )  # fmt: skip
    return Agent(state, link, measurement), outcome


def usual_step(time: Floats) -> float:
    """Median time [s] between the protocol's cycles at `time` (K,), as a recording's vary; 0 for one cycle."""
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0
