"""How many particles a belief needs: KLD-sampling (Fox, 2003)."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.nested_config import NestedConfig

KLD_ERROR = 0.05
"""Largest Kullback-Leibler distance between the particles and what they stand for."""
KLD_QUANTILE = 2.33
"""Standard normal quantile of the probability (0.99) that it is kept."""


def kld_count(cells: float) -> float:
    """Number of particles for a belief that fills so many cells (Fox 2003, eq. 13; Wilson-Hilferty chi^2 quantile)."""
    free = max(cells - 1.0, 0.0)
    if free == 0.0:
        return 1.0
    ratio = 2.0 / (9.0 * free)
    return float(free / (2.0 * KLD_ERROR) * (1.0 - ratio + np.sqrt(ratio) * KLD_QUANTILE) ** 3)


def occupied_cells(covariance: Floats, cell: float) -> float:
    """Number of cells of edge `cell` [m] that a Gaussian fills within two standard deviations along its axes, for
    KLD-sampling."""
    std = np.sqrt(np.maximum(np.linalg.eigvalsh(covariance), 0.0))
    return float(np.prod(np.maximum(4.0 * std / cell, 1.0)))


def num_agents(covariance: Floats, config: NestedConfig) -> int:
    """Number of agent particles for a position of covariance (3, 3) [m^2], by KLD-sampling."""
    if not config.adaptive:
        return config.num_agents
    wanted = kld_count(occupied_cells(covariance, config.agent_cell))
    return int(np.clip(wanted, min(config.min_agents, config.num_agents), config.num_agents))


def num_points(covariance: Floats, agents: int, features: int, config: NestedConfig) -> int:
    """Number of particles of a landmark by KLD-sampling, a multiple of 4, by its covariance (3, 3) [m^2] for one agent
    particle.

    `capacity` is shared by `features` landmarks of `agents` agent particles each.
    """
    wanted: float = config.num_points
    if config.adaptive:
        wanted = max(kld_count(occupied_cells(covariance, config.point_cell)), config.min_points)
    most = min(config.num_points, config.capacity // (max(agents, 1) * max(features, 1)))
    count = int(min(wanted, most))
    step = 64 if count >= 64 else 4
    return max(-(-count // step) * step if count < most else most // 4 * 4, 4)
