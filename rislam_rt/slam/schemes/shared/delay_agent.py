"""What the filters that hear delays alone have in common: the agent, what they are told of it, and its ranges."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Body, MapEstimate, Measurement, SensorModel, SlamEstimate
from rislam_rt.slam.observations import is_los, observations_of
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory, Step, advance, begin
from rislam_rt.slam.schemes.shared.bistatic_ranges import Bistatic
from rislam_rt.slam.schemes.shared.delay_config import DelayConfig
from rislam_rt.slam.schemes.shared.gauge import over_all_turns
from rislam_rt.slam.schemes.shared.range_scan import Scan
from rislam_rt.slam.schemes.shared.report import Points, lift, position_errors
from rislam_rt.slam.schemes.shared.sum_correction import is_strong
from rislam_rt.slam.start_prior import StartPrior


class DelayAgent(NamedTuple):
    """The agent as a filter of delays knows it."""

    course: AgentTrajectory
    height: Floats
    """(2,) height [m] and vertical velocity [m/s], where they are known."""
    heading: float
    """[rad]."""
    body: Body
    sensor: SensorModel
    """What the agent is told of its receiver."""
    cycle: int = 0
    strain: float = 1.0
    """Running mean of the NIS per degree of freedom: 1 when all is well."""

    @property
    def pose(self) -> Floats:
        """(2, 3) position [m] and velocity [m/s] of the agent that the filter of delays works at."""
        return lift(self.course.mean[: self.course.width], self.height)

    def strained(self, nis: float, dof: int, rate: float) -> "DelayAgent":
        """The agent after a cycle of that NIS, which has the share `rate` in the running mean."""
        return self._replace(strain=self.strain + rate * (nis / dof - self.strain)) if dof else self


def begin_agent(start: StartPrior, axes: int, body: Body, sensor: SensorModel) -> DelayAgent:
    """The agent at its start, of which 2 or 3 axes are filtered."""
    course = begin(start.position[:axes], start.velocity[:axes], start.position_std, start.velocity_std)
    height = np.array([start.position[2], start.velocity[2]])
    return DelayAgent(course, height, float(start.heading), body, sensor)


def move_agent(agent: DelayAgent, dt: float, sigma_a: float, stride: int) -> tuple[DelayAgent, Step]:
    """The agent after `dt` [s] of white acceleration; its past state of every `stride` cycles is kept."""
    keep = len(agent.course.mean) == agent.course.width or agent.cycle % stride == 0
    course, step = advance(agent.course, dt, np.full(agent.course.axes, sigma_a), keep)
    height = agent.height + np.array([dt * agent.height[1], 0.0])
    return agent._replace(course=course, height=height, cycle=agent.cycle + 1), step


def hear_ranges(
    agent: DelayAgent, measurement: Measurement, config: DelayConfig
) -> tuple[Integers, Scan, Booleans, Bistatic]:
    """Rows (M,) of a measurement that the agent uses, their ranges, which are wall returns, and how ranges come about.

    The direct path is left out; wall returns too, with `config.planes` False.
    """
    observed = observations_of(measurement, agent.sensor.radio)
    strong, free = is_strong(observed.ratio, config.specular_ratio), ~is_los(observed, agent.body)
    rows = np.flatnonzero(free if config.planes else free & ~strong)
    scan = Scan(observed.seen[rows, 0], np.maximum(observed.std[rows, 0], config.smallest_std))
    turn = rotation_z(np.asarray(agent.heading))
    return rows, scan, strong[rows], Bistatic(turn @ agent.body.tx_offset, turn @ agent.body.rx_offset)


def reported(agent: DelayAgent, points: Points, num_samples: int) -> SlamEstimate:
    """The estimate of a filter of delays: mean and covariance of the pose, samples of it, and the map."""
    belief, axes = over_all_turns(agent.course), agent.course.axes
    position, velocity = lift(belief.mean, agent.height)
    rows = np.r_[0:axes, 3 : 3 + axes]
    covariance = np.zeros((6, 6))
    covariance[np.ix_(rows, rows)] = belief.covariance
    samples = position + position_errors(covariance, num_samples)
    samples[:, axes:] = position[axes:]
    return SlamEstimate(position, velocity, agent.heading, covariance, samples, agent.body, _map(points))


def _map(points: Points) -> MapEstimate:
    count = len(points.ident)
    return MapEstimate(
        points.ident, points.mean, points.covariance, np.full(count, -1), np.zeros(count), np.zeros(count),
        np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2)),
    )  # fmt: skip
