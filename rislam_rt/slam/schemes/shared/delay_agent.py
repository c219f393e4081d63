"""The agent as the rival filters by delay alone hold it: its trajectory, what it is told, the ranges it measures."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Body, MapEstimate, Measurement, SensorModel, SlamEstimate
from rislam_rt.slam.observations import is_los, observations_of
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory, Step, advance, begin
from rislam_rt.slam.schemes.shared.delay_config import DelayConfig
from rislam_rt.slam.schemes.shared.gauge import over_all_turns
from rislam_rt.slam.schemes.shared.ranges import Bistatic, Scan
from rislam_rt.slam.schemes.shared.report import Points, lift, position_errors
from rislam_rt.slam.schemes.shared.sum_correction import is_strong
from rislam_rt.slam.start_prior import StartPrior


class DelayAgent(NamedTuple):
    """State of the agent in a rival filter by delay alone: trajectory, height, heading, body and receiver."""

    course: AgentTrajectory
    """The agent's trajectory."""
    height: Floats
    """Height [m] and vertical velocity [m/s] (2,), where they are known."""
    heading: float
    """Heading [rad]."""
    body: Body
    """Places of Tx and Rx on the agent."""
    sensor: SensorModel
    """What the agent is told of its receiver."""
    cycle: int = 0
    """Number of cycles with a time step so far."""
    strain: float = 1.0
    """Running mean of the NIS per degree of freedom: 1 when all is well."""

    @property
    def pose(self) -> Floats:
        """Mean position [m] and velocity [m/s] (2, 3) of the agent in a filter by delay alone."""
        return lift(self.course.mean[: self.course.width], self.height)

    def strained(self, nis: float, dof: int, rate: float) -> "DelayAgent":
        """Agent whose running mean of the NIS per degree of freedom has taken in a cycle's, of the weight `rate`."""
        return self._replace(strain=self.strain + rate * (nis / dof - self.strain)) if dof else self


def begin_agent(start: StartPrior, axes: int, body: Body, sensor: SensorModel) -> DelayAgent:
    """Agent of a filter by delay alone before the first cycle, from the start prior; 2 or 3 axes are filtered."""
    course = begin(start.position[:axes], start.velocity[:axes], start.position_std, start.velocity_std)
    height = np.array([start.position[2], start.velocity[2]])
    return DelayAgent(course, height, float(start.heading), body, sensor)


def move_agent(agent: DelayAgent, dt: float, sigma_a: float, stride: int) -> tuple[DelayAgent, Step]:
    """Agent of a filter by delay alone after `dt` [s] of white acceleration; every `stride` cycles a state is kept."""
    keep = len(agent.course.mean) == agent.course.width or agent.cycle % stride == 0
    course, step = advance(agent.course, dt, np.full(agent.course.axes, sigma_a), keep)
    height = agent.height + np.array([dt * agent.height[1], 0.0])
    return agent._replace(course=course, height=height, cycle=agent.cycle + 1), step


def hear_ranges(
    agent: DelayAgent, measurement: Measurement, config: DelayConfig
) -> tuple[Integers, Scan, Booleans, Bistatic]:
    """Rows (M,) of the components that an agent uses by delay alone, their ranges, which are wall returns, and the
    range model.

    The direct path is left out; wall returns too, with `config.planes` False.
    """
    observed = observations_of(measurement, agent.sensor.radio, agent.body)
    strong, free = is_strong(observed.ratio, config.specular_ratio), ~is_los(observed, agent.body)
    rows = np.flatnonzero(free if config.planes else free & ~strong)
    scan = Scan(observed.seen[rows, 0], np.maximum(observed.std[rows, 0], config.smallest_std))
    turn = rotation_z(np.asarray(agent.heading))
    return rows, scan, strong[rows], Bistatic(turn @ agent.body.tx_offset, turn @ agent.body.rx_offset)


def reported(agent: DelayAgent, points: Points, num_samples: int) -> SlamEstimate:
    """SLAM estimate of a filter by delay alone: mean, covariance and samples of the pose, and features as the map."""
    (mean, spread), axes = over_all_turns(agent.course), agent.course.axes
    position, velocity = lift(mean, agent.height)
    rows = np.r_[0:axes, 3 : 3 + axes]
    covariance = np.zeros((6, 6))
    covariance[np.ix_(rows, rows)] = spread
    samples = position + position_errors(covariance, num_samples)
    samples[:, axes:] = position[axes:]
    return SlamEstimate(position, velocity, agent.heading, covariance, samples, agent.body, _map(points))


def _map(points: Points) -> MapEstimate:
    """Map of an agent that filters by delay alone: points alone, none of them a panel, and no walls."""
    count = len(points.ident)
    return MapEstimate(
        points.ident, points.mean, points.covariance, np.full(count, -1), np.zeros(count), np.zeros(count),
        np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2)),
    )  # fmt: skip
