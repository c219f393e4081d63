"""Feature birth in BP-SLAM with angles: what features a component may be the first of, how likely, and where."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, join_rows
from rislam_rt.slam.schemes.bp_slam_aoa.config import BpSlamAoaConfig
from rislam_rt.slam.schemes.bp_slam_aoa.gaussian_features import POINT, WALL, WANDERER, Ends, GaussianFeatures
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory

NUDGE = 1e-6
"""Step of differences [m, rad]."""
LEAST_VARIANCE = 1e-10
"""Least variance [m^2] of a new feature's place along any axis."""
SLICES = 5
"""Number of Gaussians over the elevation of a path whose cosines do not tell it."""
UPRIGHT, LEVEL = 0.7, 0.2
"""Shares of upright and of level surfaces; the rest slopes."""
OTHER_RATIO, OTHER_RATIO_STD = -2.5, 1.2
"""Mean log amplitude of a wandering feature over that of free space of the same length, and its deviation."""


class ComponentScan(NamedTuple):
    """M components of one cycle that BP-SLAM with angles uses, without the direct path."""

    seen: Floats
    """Lengths [m] and two cosines (M, 3)."""
    std: Floats
    """Standard deviations (M, 3) of length and cosines."""
    log_amplitude: Floats
    """Log amplitudes (M,)."""
    log_std: Floats
    """Standard deviations (M,) of the log amplitudes."""
    false: Floats
    """Density (M,) of false components per metre, unit of each cosine and e-fold of amplitude, at each one."""


class BirthHypotheses(NamedTuple):
    """G Gaussians of features of which one component may be the first detection."""

    kind: Integers
    """Kind (G,) of the feature: WALL, POINT or WANDERER."""
    density: Floats
    """Expected number (G,) of them per metre, unit of each cosine and e-fold of amplitude."""
    polar: Floats
    """Length [m], azimuth and elevation [rad] of the arrival in room axes (G, 3)."""
    std: Floats
    """Standard deviations (G, 3) of length, azimuth and elevation."""
    strength: Floats
    """Log amplitude (G,) above the law of the kind."""
    strength_std: Floats
    """Standard deviation (G,) of that log amplitude."""


def log_normal(miss: Floats, variance: Floats) -> Floats:
    """Log density of a scalar normal for a feature's birth, from the deviation from the mean and the variance."""
    return -0.5 * (miss**2 / variance + np.log(2.0 * np.pi * variance))


def elevations(radial: float, std: float) -> tuple[Floats, Floats, Floats]:
    """Elevations (E,) [rad] at which a feature may be born, their deviations, and the weight of each by its likelihood.

    The horizontal part of an arrival tells its elevation by the cosine: well from above, badly near the horizon.
    """
    sine = np.sqrt(max(1.0 - radial**2, 0.0))
    if sine > 4.0 * std / radial:
        return np.array([np.arccos(radial)]), np.array([std / sine]), np.array([1.0 / sine])
    top = np.arccos(np.clip(radial - 3.0 * std, 0.0, 1.0))
    middle = (np.arange(SLICES) + 0.5) * top / SLICES
    weight = np.exp(log_normal(radial - np.cos(middle), np.array(std**2))) * np.cos(middle) * top / SLICES
    return middle, np.full(SLICES, 0.5 * top / SLICES), weight / radial


def hypothesise(
    scan: ComponentScan, row: int, rotation: Floats, free: float, window: float, config: BpSlamAoaConfig
) -> BirthHypotheses:
    """Birth hypotheses of component `row`: what features it may be the first of; `window` [m] is the longest length."""
    length, level = float(scan.seen[row, 0]), scan.seen[row, 1:]
    std, turn = float(scan.std[row, 1:].mean()), rotation[:2, :2] @ level
    radial = float(np.clip(np.hypot(*turn), min(std, 1.0), 1.0))
    azimuth, rise, lean, solid = float(np.arctan2(turn[1], turn[0])), *elevations(radial, std)
    upright = np.exp(log_normal(np.array(radial - 1.0), np.array(std**2)))
    flat = np.exp(-0.5 * radial**2 / (std**2 + config.lean**2)) / (2.0 * np.pi * (std**2 + config.lean**2))
    count = len(rise)
    kind = np.concatenate([[WALL, WALL], np.full(count, WALL), np.full(count, POINT), np.full(count, WANDERER)])
    elevation = np.concatenate([[0.0, 0.5 * np.pi], rise, rise, rise])
    wide = np.concatenate([[config.lean, config.lean], lean, lean, lean])
    across = std / radial
    inside = float(length < 2.0 * config.region)
    wall, point = 0.5 * inside * config.walls / config.region, 0.125 * inside * config.points * length**2
    point /= 2.0 * np.pi * config.region**3 / 3.0
    density = np.concatenate([
        [UPRIGHT * wall * upright / (2.0 * np.pi * radial), LEVEL * wall * flat],
        (1.0 - UPRIGHT - LEVEL) * wall * solid / (2.0 * np.pi),
        point * solid,
        config.wanderers / window * solid / (2.0 * np.pi),
    ])  # fmt: skip
    crowd = np.sqrt(config.crowd)
    polar = np.stack([np.full(len(kind), length), np.full(len(kind), azimuth), elevation], axis=1)
    spread = np.stack(
        [np.full(len(kind), float(scan.std[row, 0]) * crowd), np.full(len(kind), across * crowd), wide], axis=1
    )
    law = np.where(kind == POINT, -2.0 * np.log(0.5 * length) - 0.5 * np.log(4.0 * np.pi), -np.log(length))
    strength = float(scan.log_amplitude[row]) - free - law
    usual = np.array([config.wall_ratio, np.log(config.strength), OTHER_RATIO])[kind]
    usual_std = np.array([config.wall_ratio_std, config.strength_std, OTHER_RATIO_STD])[kind]
    noise = config.fading**2 + float(scan.log_std[row]) ** 2
    loud = np.exp(log_normal(strength - usual, usual_std**2 + noise))
    gain = usual_std**2 / (usual_std**2 + noise)
    after = usual + gain * (strength - usual)
    return BirthHypotheses(kind, density * loud, polar, spread, after, np.sqrt(gain * noise))


def born(
    found: list[BirthHypotheses], existence: Floats, course: AgentTrajectory, ends: Ends, first: int,
    config: BpSlamAoaConfig,
) -> GaussianFeatures:  # fmt: skip
    """New features of BP-SLAM with angles as Gaussian sums, one feature for each set of birth hypotheses."""
    owner = np.repeat(np.arange(len(found)), [len(each.kind) for each in found])
    parts = join_rows(found)
    place, by_agent, by_polar = _placed(parts.kind, parts.polar, course.mean[:3], ends)
    root = by_polar * parts.std[:, None]
    covariance = root @ root.swapaxes(1, 2) + LEAST_VARIANCE * np.eye(3)
    level = (parts.kind == WALL) & (parts.polar[:, 2] > 0.5 * np.pi - 1e-9)  # such a surface leans either way
    covariance[level] += (config.lean * parts.polar[level, 0])[:, None, None] ** 2 * np.diag([1.0, 1.0, 0.0])
    slope = np.zeros((len(owner), 3, len(course.mean)))
    slope[:, :, :3] = by_agent
    total = np.bincount(owner, parts.density)
    return GaussianFeatures(
        existence, first + np.arange(len(found)), owner, parts.kind, parts.density / total[owner], place, slope,
        covariance, parts.strength, parts.strength_std**2, np.full(len(owner), np.log(config.crowd)),
    )  # fmt: skip


def _placed(kind: Integers, polar: Floats, agent: Floats, ends: Ends) -> tuple[Floats, Floats, Floats]:
    """Places (G, 3) [m] of features at birth, derivatives (G, 3, 3) by the agent and by length, azimuth, elevation."""
    tx, rx, is_wall = agent + ends.tx, agent + ends.rx, (kind == WALL)[:, None]
    length, azimuth, elevation = (polar + NUDGE * np.concatenate([np.zeros((1, 3)), np.eye(3)])[:, None]).T
    flat = np.cos(elevation)
    unit = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=-1)
    way = (length**2 - (rx - tx) @ (rx - tx)) / (2.0 * (length + unit @ (rx - tx)))
    image = rx + length[..., None] * unit
    normal = image - tx
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    mirrored = np.sum(normal * (image + tx), axis=-1, keepdims=True) * normal
    place = np.where(is_wall[:, None], mirrored, rx + way[..., None] * unit)
    normal = normal[:, 0]
    by_agent = np.where(is_wall[:, None], 2.0 * normal[:, :, None] * normal[:, None], np.eye(3))
    return place[:, 0], by_agent, np.moveaxis(place[:, 1:] - place[:, :1], 1, 2) / NUDGE
