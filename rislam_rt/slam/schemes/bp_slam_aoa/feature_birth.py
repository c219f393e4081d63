"""Births: what a component may be the first sight of, how often, and where it would then be."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.schemes.bp_slam_aoa.config import BpSlamAoaConfig
from rislam_rt.slam.schemes.bp_slam_aoa.gaussian_features import POINT, WALL, WANDERER, Ends, GaussianFeatures
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory

NUDGE = 1e-6
"""Step of differences [m, rad]."""
LEAST_VARIANCE = 1e-10
"""Of a new feature's place along any axis [m^2]."""
SLICES = 5
"""Gaussians over the elevation of a path whose cosines do not tell it."""
UPRIGHT, LEVEL = 0.7, 0.2
"""Shares of upright and of level surfaces; the rest slopes."""
OTHER_RATIO, OTHER_RATIO_STD = -2.5, 1.2
"""Log amplitude of a wanderer over that of free space of the same length, and its spread."""


class ComponentScan(NamedTuple):
    """What the receiver reported in one cycle, without what is no path of the room."""

    seen: Floats
    """(M, 3) length [m] and two cosines."""
    std: Floats
    """(M, 3)."""
    log_amplitude: Floats
    """(M,)."""
    log_std: Floats
    """(M,)."""
    false: Floats
    """(M,) false components expected per metre, unit of each cosine and e-fold, where each lies."""


class BirthHypotheses(NamedTuple):
    """G Gaussians that one component may be the first sight of."""

    kind: Integers
    """(G,)."""
    density: Floats
    """(G,) expected ones per metre, unit of each cosine and e-fold of amplitude."""
    polar: Floats
    """(G, 3) length [m], azimuth and elevation of the arrival, room axes [rad]."""
    std: Floats
    """(G, 3) their standard deviations."""
    strength: Floats
    """(G,) log amplitude above the law of the kind."""
    strength_std: Floats
    """(G,)."""


def log_normal(miss: Floats, variance: Floats) -> Floats:
    """Logarithm of a scalar normal density, by which births are weighed."""
    return -0.5 * (miss**2 / variance + np.log(2.0 * np.pi * variance))


def elevations(radial: float, std: float) -> tuple[Floats, Floats, Floats]:
    """Elevations (E,) [rad] that a feature may be born at, deviations, and each slice's weight by its likelihood.

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
    """Hypotheses of what feature component `row` may be born of; `window` is the longest length reported [m]."""
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
    found: list[BirthHypotheses],
    existence: Floats,
    course: AgentTrajectory,
    ends: Ends,
    first: int,
    config: BpSlamAoaConfig,
) -> GaussianFeatures:
    """Features that are born, one for each set of hypotheses."""
    owner = np.repeat(np.arange(len(found)), [len(each.kind) for each in found])
    parts = BirthHypotheses._make(np.concatenate(column) for column in zip(*found, strict=True))
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
    """Places (G, 3) of features at birth, and derivatives (G, 3, 3) by agent, and by length, azimuth and elevation."""
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
