"""Weights of the particles after a cycle: each return weighs one landmark's cloud; points first, then walls."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import Body
from rislam_rt.slam.nested.particles.landmark_cloud import CloudEngine
from rislam_rt.slam.nested.particles.particle_belief import Nested, absorb, gaussian, mean_covariances
from rislam_rt.slam.nested.particles.sightline import Sighting, trace_sightline
from rislam_rt.slam.nested_config import NestedConfig
from rislam_rt.slam.predicted_returns import NONE, Returns, linearise, poses_of
from rislam_rt.slam.window.smoother.motion_basis import HEAD

TAIL = 4.0
"""Degrees of freedom of Student's t, by which a return far off its prediction counts for less."""
FLOOR = np.array([5e-4, 2e-4, 2e-4])
"""Standard deviation [m, 1, 1] added to length and cosines: what the model leaves out."""
FUSED = 3
"""Largest number of returns weighed in one kernel."""


class Seen(NamedTuple):
    """The A observed returns of a cycle by which the particles are weighed."""

    returns: Returns
    """Paths of the A returns over the map's features."""
    anchor: Floats
    """Anchors (F, 3) [m] of walls."""
    body: Body
    """Places of Tx and Rx on the agent."""
    seen: Floats
    """Measured lengths [m] and cosines (A, 3)."""
    noise: Floats
    """Variances (A, 3) of the measurements."""


def update(belief: Nested, seen: Seen, config: NestedConfig, engine: CloudEngine) -> tuple[Nested, float, float]:
    """Weigh the particles of agent and landmarks by a cycle's observed returns (eqs. `landmarkRenew`, `agentRenew`).

    Also the log density of those measurements that the belief could explain, given all before, and the squared
    innovation of the mean belief, normalised: chi^2 with 3 A degrees of freedom.
    """
    if not len(seen.seen):
        return belief, 0.0, 0.0
    mean, covariance = gaussian(belief)
    poses = poses_of(mean[:3], mean[6], seen.body)
    linear = linearise(seen.returns, mean[HEAD:].reshape(-1, 3), seen.anchor, poses)
    gap, by_state = seen.seen - linear.seen, np.zeros((*linear.seen.shape, len(mean)))
    by_state[..., :3], by_state[..., 6] = linear.by_pose, linear.by_heading(poses, mean[:3])
    by_state[..., HEAD:] = linear.by_feature.reshape(*linear.seen.shape, -1)
    seen = seen._replace(noise=trusted(seen.noise, _innovations(gap, by_state, covariance, seen.noise)[0]))
    nis = _innovations(gap, by_state, covariance, seen.noise)[1]
    owner, walls = owners(seen.returns), seen.returns.legs[:, 1]
    over_wall = (walls[seen.returns.rx] != NONE) | (walls[seen.returns.tx] != NONE)
    total = 0.0
    for turn in (False, True):
        for feature in np.unique(owner[over_wall == turn]):
            rows = np.flatnonzero((owner == feature) & (over_wall == turn))
            for first in range(0, len(rows), FUSED):
                some = rows[first : first + FUSED]
                sightings = _sightings(belief, int(feature), some, seen, linear.by_feature, config)
                belief, evidence = absorb(belief, int(feature), sightings, engine)
                total += evidence if np.isfinite(evidence) else 0.0
    return belief, total, nis


def _innovations(gap: Floats, by_state: Floats, covariance: Floats, noise: Floats) -> tuple[Floats, float]:
    """Whitened innovation (A, 3) of each return that weighs particles, and the normalised innovation squared of all
    together."""
    rows, flat = np.arange(len(gap)), by_state.reshape(-1, len(covariance))
    total = flat @ covariance @ flat.T + np.diag(noise.ravel())
    blocks = total.reshape(len(gap), 3, len(gap), 3)[rows, :, rows, :]
    white = np.linalg.solve(np.linalg.cholesky(blocks), gap[..., None])[..., 0]
    return white, float(gap.ravel() @ np.linalg.solve(total, gap.ravel()))


def trusted(noise: Floats, white: Floats) -> Floats:
    """Variances (A, 3) for the update of weights, inflated where a return lies far off its prediction (Student's t)."""
    return noise * np.maximum(1.0, (TAIL + np.sum(white**2, axis=1)) / (TAIL + 3.0))[:, None]


def owners(returns: Returns) -> Integers:
    """Row (A,) of the landmark whose cloud each return weighs: its point if direct, else the wall next to the point."""
    walls = returns.legs[:, 1]
    first = np.where(walls[returns.rx] != NONE, walls[returns.rx], walls[returns.tx])
    return np.where(first == NONE, returns.point, first)


def _sightings(
    belief: Nested, owner: int, rows: Integers, seen: Seen, by_feature: Floats, config: NestedConfig
) -> list[Sighting]:
    """Returns `rows` that weigh the cloud of one landmark as likelihoods, sorted by kind, so that kernels recur."""
    # Other features' errors, given the trajectory, are the same every cycle, and their share must not average out: what
    # the n-th measurement of the owner carries of it counts n times.
    poses = poses_of(belief.position, belief.heading, seen.body)
    features = belief.mean.copy()
    features[:, owner] = belief.centre[:, owner]
    others = by_feature[rows]
    others[:, :, owner] = 0.0
    uncertainty = np.einsum("aifj,fjk,alfk->ail", others, mean_covariances(belief), others)
    strength = 1.0 / np.sqrt(seen.noise[:, 0])
    found, rho = [], strength / strength.mean()
    common = np.array([config.common_length_std, *[config.common_cosine_std] * 2]) ** 2
    for row, spread in zip(rows, float(belief.updates[owner] + 1) * uncertainty, strict=True):
        line = trace_sightline(seen.returns, int(row), owner, features, seen.anchor, poses)
        variance = seen.noise[row] if config.weighting == "crlb" else common
        power = float(rho[row]) if config.weighting == "power" else 1.0
        factor = float(np.log(rho[row])) if config.weighting == "paper" else 0.0
        found.append(Sighting(line, seen.seen[row], np.diag(variance) + spread, power, factor))
    return sorted(found, key=lambda sighting: sighting.line.kind)
