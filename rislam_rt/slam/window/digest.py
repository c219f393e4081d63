"""Histories of tracks, condensed: at most eight normal points each, with the scatter that they show themselves.

What the map lacks shares cells with what a track is, and moves its measurements about, now here, now there, as phases
turn. Their scatter about a smooth path tells by how much more than the receiver reports.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import Body
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.window.gauss import Window, now, poses
from rislam_rt.slam.window.levels import LEVELS
from rislam_rt.slam.window.log import Log

TOGETHER = 10.0
"""Measurements over which the pull of neighbours keeps its sign."""
POINTS = 8
"""Most normal points of a history."""


class Digest(NamedTuple):
    """T tracks, B normal points each; where `weight` is 0 there is none."""

    seen: Floats
    """(T, B, 3) length [m] and two cosines."""
    weight: Floats
    """(T, B, 3) one over the standard deviation, 0 for padding."""
    time: Floats
    """(T, B) [s] from the present."""
    tx: Floats
    """(T, B, 3) [m]."""
    rx: Floats
    """(T, B, 3) [m]."""
    heading: Floats
    """(T, B) [rad]."""
    doubt: Floats
    """(T, B, 3, 6) square root of the covariance of the poses' common errors of place and velocity."""
    log_amplitude: Floats
    """(T,) mean."""
    scatter: Floats
    """(T, 3) factor on the reported standard deviations."""
    middle: Floats
    """(3,) where the agent is now: the anchor of new walls."""
    speed: float
    """[m/s] of the agent, and something for its doubt."""

    @property
    def mean(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Averages: what is seen, Tx and Rx (T, 3), heading (T,)."""
        weight = self.weight[..., :1] ** 2
        weight = weight / weight.sum(axis=1, keepdims=True)
        heading = np.arctan2(
            (weight[..., 0] * np.sin(self.heading)).sum(axis=1), (weight[..., 0] * np.cos(self.heading)).sum(axis=1)
        )
        return (*((weight * field).sum(axis=1) for field in (self.seen, self.tx, self.rx)), heading)

    @property
    def direction(self) -> Floats:
        """(T, 3) mean directions of arrival in the room's axes."""
        seen, _, _, heading = self.mean
        flat = seen[:, 1:] / np.maximum(1.0, np.linalg.norm(seen[:, 1:], axis=1))[:, None]
        up = np.sqrt(np.maximum(1.0 - np.sum(flat**2, axis=1), 0.0))
        cos, sin = np.cos(heading), np.sin(heading)
        return np.stack([cos * flat[:, 0] - sin * flat[:, 1], sin * flat[:, 0] + cos * flat[:, 1], up], axis=1)


def digest(log: Log, rows: list[Integers], window: Window, body: Body, heading: Floats, cycle: int) -> Digest:
    """The histories `rows` of T tracks (rows of the log each, in time)."""
    mean, covariance = now(window)
    place, time = poses(window), np.concatenate([[0.0], np.cumsum(window.step)])
    first = cycle - window.num_poses + 1
    count = len(rows)
    seen, weight = np.zeros((count, POINTS, 3)), np.zeros((count, POINTS, 3))
    lag, spot, turned = np.zeros((count, POINTS)), np.zeros((count, POINTS, 3)) + mean[:3], np.zeros((count, POINTS))
    scatter = np.ones((count, 3))
    level = np.zeros(count)
    for row, at in enumerate(rows):
        scatter[row] = scatter_of(log.seen[at], log.std[at], time[log.cycle[at] - first])
    # what the others show is what a short history has yet to show; it counts as much as four measurements
    crowd = max(LEVELS.crowd, float(np.mean(np.minimum(scatter, 10.0) ** 2)))
    number = np.array([len(at) for at in rows])[:, None]
    scatter = np.sqrt((4.0 * crowd + number * scatter**2) / (4.0 + number))
    for row, at in enumerate(rows):
        slot = log.cycle[at] - first
        std = log.std[at] * scatter[row]
        bins = np.arange(len(at)) * min(POINTS, len(at)) // len(at)
        start = np.searchsorted(bins, np.arange(bins[-1] + 1))
        inside = std**-2.0
        total = np.add.reduceat(inside, start)
        used = len(start)
        number = np.diff(start, append=len(at)).astype(np.float64)
        alone = max(len(at) / TOGETHER, 1.0) / used  # how many of a point's errors are its own
        seen[row, :used] = np.add.reduceat(inside * log.seen[at], start) / total
        own = np.add.reduceat(log.std[at] ** 2, start) / number[:, None]
        weight[row, :used] = (own / number[:, None] + own * (scatter[row] ** 2 - 1.0) / alone) ** -0.5
        lag[row, :used] = np.add.reduceat(time[slot] - time[-1], start) / number
        spot[row, :used] = np.add.reduceat(place[slot, :3], start) / number[:, None]
        turned[row, :used] = np.add.reduceat(np.unwrap(heading[slot] + place[slot, 3]), start) / number
        level[row] = log.log_amplitude[at].mean()
    scale = np.maximum(np.diag(covariance)[:6], 1e-14)
    root = np.linalg.cholesky(covariance[:6, :6] + np.diag(1e-6 * scale + 1e-14))
    doubt = np.asarray(root[:3] + lag[..., None, None] * root[3:6], dtype=np.float64)
    ends = poses_of(spot, turned, body)
    speed = float(np.linalg.norm(mean[3:6])) + 0.05
    return Digest(seen, weight, lag, ends.tx, ends.rx, turned, doubt, level, scatter, mean[:3].copy(), speed)


def scatter_of(seen: Floats, std: Floats, time: Floats) -> Floats:
    """(3,) root mean square about a quadratic in time (a line, for short ones), in reported deviations; 1 at least.

    Weights of Student's t keep single outliers from speaking for all.
    """
    order = 3 if len(time) >= 9 else 2
    x = time - time.mean()
    rows = np.stack([x**power for power in range(order)], axis=1)
    trust = np.ones(len(time))
    for _ in range(2):
        squared = np.zeros((len(time), 3))
        for axis in range(3):
            weight = trust / std[:, axis] ** 2
            normal = (rows * weight[:, None]).T @ rows
            best = np.linalg.solve(normal + 1e-12 * np.eye(order), (rows * weight[:, None]).T @ seen[:, axis])
            squared[:, axis] = ((seen[:, axis] - rows @ best) / std[:, axis]) ** 2
        chi = (trust[:, None] * squared).sum(axis=0) / max(len(time) - order, 1)
        trust = (LEVELS.tail + 3.0) / (LEVELS.tail + (squared / np.maximum(chi, 1.0)).sum(axis=1))
    return np.sqrt(np.maximum(chi, 1.0))
