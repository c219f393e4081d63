"""One cycle of the protocol: optimise, communicate, measure, localise and map.

The agent's side of it (design and filter) gets the measurement, the code that it holds to be applied, the time step and
its heading; paths and poses stay on the room's side.
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
from rislam_rt.pipeline.specification.spec import PipelineSpec, Settings
from rislam_rt.ris import PanelErrors, rephase


class CycleGenerators(NamedTuple):
    """Generators of one cycle."""

    design: np.random.Generator
    control: np.random.Generator
    noise: np.random.Generator
    filter: np.random.Generator


class GroundTruth(NamedTuple):
    """The true side of a run."""

    paths: Paths
    """As the array hears them (`assumed_model.perceived_paths`)."""
    trajectory: Trajectory
    doppler: Floats
    """(K, P) shifts [Hz]: what paths turn by within the measurement slot."""
    faults: PanelErrors | None = None
    """What the panel does wrong; None without a panel."""
    first: int = 0
    """The cycle that the paths begin at; the trajectory is the whole one."""
    front_end: FrontEnd | None = None
    """What the receiver does wrong; None for an ideal one."""
    clutter: Clutter | None = None
    """What is heard besides, and has no identity."""

    def at(self, cycle: int) -> Paths:
        """The paths of one cycle alone."""
        return self.paths.of_cycle(cycle - self.first)

    def clutter_at(self, cycle: int) -> Clutter | None:
        """What is heard besides in one cycle."""
        row = cycle - self.first
        return None if self.clutter is None else self.clutter.of_cycle(row)


class Agent(NamedTuple):
    """What the agent carries from cycle to cycle, with its control channel."""

    state: Any
    link: ControlLink | None
    """None without a panel."""
    heard: Measurement | None = None
    """What the receiver found in the cycle before."""


class Receptions(dict[tuple[int, bytes, int], tuple[Measurement | None, Measurement, PathTruth, float]]):
    """What the receiver made of cycles, kept for the schemes of one specification and room that heard the same.

    A cycle's noise is the same for all schemes. What else its components depend on is the code that was applied, and
    the cycle before, which the search begins with: the very same record of it means the same codes all along.
    """

    def measure(
        self,
        cycle: int,
        code: bytes,
        previous: Measurement | None,
        receive: Callable[[], tuple[Measurement, PathTruth]],
    ) -> tuple[Measurement, PathTruth, float]:
        """Components of a cycle, which paths they were, and the seconds that finding them took the first time."""
        key = cycle, code, id(previous)
        if key not in self:
            begin = perf_counter()
            found = receive()
            self[key] = previous, *found, perf_counter() - begin  # that holds `previous`, so that no other has its id
        return self[key][1:]


class RunContext(NamedTuple):
    """What leads a scheme through its cycles, the same in all of them."""

    panel: DataSheet | None
    designer: "CodePolicy | None"
    estimator: Estimator
    spec: PipelineSpec
    settings: Settings
    """True ones: what the room and the receiver go by."""
    told: AssumedModel
    """What filter and design go by."""
    receptions: Receptions | None = None
    """Of the schemes before this one that may have heard the same; None to keep nothing."""


class Cycle(NamedTuple):
    """What one cycle left behind."""

    estimate: SlamEstimate
    info: Any
    measurement: Measurement
    truth: PathTruth
    gain: Any
    """(P,) true path gains under the applied code."""
    sent: RisCode | None
    applied: RisCode | None
    seconds: tuple[float, float, float, float]
    believed: RisCode | None = None
    """What the agent holds to be applied."""


class CodePolicy(Protocol):
    """Chooses a code from the predicted belief."""

    def __call__(
        self, belief: Callable[[], SlamEstimate], cycle: int, room: GroundTruth, *, rng: np.random.Generator
    ) -> RisCode:
        """`belief` is worked out on being called, for not all need it; `room` is for the one that knows the truth."""
        ...


def run_cycle(
    agent: Agent, room: GroundTruth, cycle: int, context: RunContext, *, rng: CycleGenerators
) -> tuple[Agent, Cycle]:
    """One cycle of one scheme."""
    control, estimator, told = context.spec.control, context.estimator, context.told
    config = estimator.config(told.settings)
    dt = float(told.time[cycle] - told.time[cycle - 1]) if cycle else 0.0
    clock = [perf_counter()]

    link, sent = agent.link, None
    if link is not None and context.designer is not None:
        ahead = dt + control.delay_cycles * usual_step(told.time)
        sent = context.designer(partial(estimator.predict, agent.state, ahead, config), cycle, room, rng=rng.design)
    clock.append(perf_counter())

    air = 0.0
    if link is not None and sent is not None and context.panel is not None:
        link = send_code(link, sent, control, rng=rng.control, bit_flip=context.spec.panel.bit_flip)
        air = message_seconds(context.panel, control)
    clock.append(perf_counter())

    paths, applied = room.at(cycle), None
    if link is not None:
        applied = link.applied if room.faults is None else room.faults.applied(link.applied)
        paths = rephase(paths, applied, 1.0 if room.faults is None else room.faults.weight)
    kept = Receptions() if context.receptions is None else context.receptions
    measurement, truth, acquired = kept.measure(
        cycle, b"" if applied is None else applied.index.tobytes(), agent.heard,
        lambda: measure(
            paths, 0, float(room.trajectory.heading[cycle]), context.settings.radio, context.settings.receiver,
            agent.heard, room.doppler[cycle - room.first], room.front_end, room.clutter_at(cycle), rng=rng.noise,
        ),
    )  # fmt: skip
    clock.append(perf_counter())

    believed = link.believed if link is not None else None
    reported = tell_measurement(measurement, context.spec.told)
    heading = float(told.heading[cycle])
    state, info = estimator.step(agent.state, reported, believed, dt, heading, config, rng=rng.filter)
    belief = estimator.estimate(state, config)
    clock.append(perf_counter())

    optimise, communicate, _, localise = np.diff(clock)
    outcome = Cycle(
        belief, info, reported, truth, paths.gain[0], sent, applied,
        (optimise, communicate + air, acquired, localise), believed,
    )  # fmt: skip
    return Agent(state, link, measurement), outcome


def usual_step(time: Floats) -> float:
    """Cycle time [s] of times (K,), which a recording's clock keeps only nearly: the median; 0 for a single cycle."""
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0
