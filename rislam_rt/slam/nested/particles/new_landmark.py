"""Initialisation of a new landmark: every agent particle fits it to its own trail and absorbs its past measurements."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import Body
from rislam_rt.slam.nested.particles.landmark_cloud import CloudEngine
from rislam_rt.slam.nested.particles.particle_belief import Nested, absorb, mean_covariances, place_landmark, renew
from rislam_rt.slam.nested.particles.sightline import Sighting, linear_sightline, trace_sightline
from rislam_rt.slam.nested.particles.weights import FLOOR, trusted
from rislam_rt.slam.nested_config import NestedConfig
from rislam_rt.slam.predicted_returns import Returns, linearise, poses_of

ITERATIONS = 4
"""Gauss-Newton steps of each agent particle's fit."""


class LandmarkHistory(NamedTuple):
    """K past measurements of a landmark that the map lacks, all over the same path, and the landmark's prior."""

    returns: Returns
    """The one path, by rows of the G known landmarks on it; row G is the new landmark."""
    known: Integers
    """Rows (G,) of the known landmarks in the belief."""
    anchor: Floats
    """Anchors (G + 1, 3) [m] of these landmarks, where they are walls."""
    place: Floats
    """Prior mean (3,) [m] of the new landmark: about where it is."""
    prior: Floats
    """Prior covariance (3, 3) [m^2] of the new landmark: an upright wall is upright, the rest is anywhere."""
    slots: Integers
    """Rows (K,) of the trail at whose poses the measurements were made."""
    seen: Floats
    """Measured lengths [m] and cosines (K, 3)."""
    variance: Floats
    """Variances (K, 3) of the measurements."""


def initialise_landmark(
    belief: Nested, history: LandmarkHistory, body: Body, spans: Floats, config: NestedConfig, engine: CloudEngine,
    *, rng: np.random.Generator,
) -> Nested:  # fmt: skip
    """Particles with one more landmark, found from its history; `spans` (K,) [s] from each row of the trail to now.

    The history enters measurement by measurement, from the poses of the trail, as if the landmark had been there all
    along; agent particles are resampled in between, as what it tells of their past may be decisive.
    """
    mean, covariance, noise = _fit(belief, history, body)
    belief = place_landmark(belief, mean, covariance, config, engine, rng=rng)
    owner = len(belief.clouds) - 1
    offset = belief.centre[:, owner] - history.place
    belief, _ = absorb(
        belief, owner, [Sighting(linear_sightline(offset, np.zeros(3)), np.zeros(3), history.prior)], engine
    )
    for row in range(len(history.slots)):
        belief, _ = absorb(belief, owner, [_past_sighting(belief, history, body, row, noise[row])], engine)
        belief, _ = renew(belief, spans, config, engine, rng=rng)
    return belief._replace(updates=np.append(belief.updates[:-1], len(history.slots)))


def _fit(belief: Nested, history: LandmarkHistory, body: Body) -> tuple[Floats, Floats, Floats]:
    """Least-squares position (N, 3) of a new landmark for each agent particle, covariance (3, 3), variances (K, 3)."""
    feature = np.broadcast_to(history.place, belief.position.shape).copy()
    information, known = np.linalg.inv(history.prior), mean_covariances(belief)[history.known]
    noise = history.variance + FLOOR**2
    past = np.swapaxes(belief.trail[history.slots], 0, 1)
    poses = poses_of(past[..., :3], past[..., 3], body)
    for _ in range(ITERATIONS):
        every = np.concatenate([belief.mean[:, history.known], feature[:, None]], axis=1)[:, None]
        linear = linearise(history.returns, every, history.anchor, poses)
        gap, slopes = history.seen - linear.seen[..., 0, :], linear.by_feature[..., 0, :, :, :]
        others, own = slopes[..., :-1, :], slopes[..., -1, :]
        spread = np.einsum("nkigf,gfh,nkigh->nki", others, known, others)
        centre = np.einsum("n,nki->ki", belief.weight, gap)
        total = noise + spread.mean(axis=0) + np.einsum("n,nki->ki", belief.weight, (gap - centre) ** 2)
        trust = trusted(noise, centre / np.sqrt(total))
        weighted = own / trust[:, :, None]
        normal = np.einsum("nkif,nkig->nfg", weighted, own) + information
        slope = np.einsum("nkif,nki->nf", weighted, gap) - (feature - history.place) @ information
        feature = feature + np.linalg.solve(normal, slope[..., None])[..., 0]
    return feature, np.linalg.inv(normal).mean(axis=0), trust


def _past_sighting(belief: Nested, history: LandmarkHistory, body: Body, row: int, noise: Floats) -> Sighting:
    """Past measurement as a likelihood for a new landmark's cloud; errors of others count as often as they repeat."""
    past, sought = belief.trail[history.slots[row]], len(history.known)
    poses = poses_of(past[:, :3], past[:, 3], body)
    features = np.concatenate([belief.mean[:, history.known], belief.centre[:, -1:]], axis=1)
    line = trace_sightline(history.returns, 0, sought, features, history.anchor, poses)
    mean, middle = belief.weight @ past, np.einsum("n,nfi->fi", belief.weight, features)
    others = linearise(history.returns, middle, history.anchor, poses_of(mean[:3], mean[3], body)).by_feature[0, :, :-1]
    spread = np.einsum("ifj,fjk,lfk->il", others, mean_covariances(belief)[history.known], others)
    return Sighting(line, history.seen[row], np.diag(noise) + len(history.slots) * spread)
