"""A track becomes a landmark: every agent particle fits it to its own trail, then measures it cycle by cycle."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import Body
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.nested.birth import Birth
from rislam_rt.slam.nested.hypotheses import POINT
from rislam_rt.slam.nested.particles.belief import Nested, absorb, mean_covariances, renew
from rislam_rt.slam.nested.particles.belief import initialise_landmark as place
from rislam_rt.slam.nested.particles.cloud import CloudEngine
from rislam_rt.slam.nested.particles.sightline import Sighting, linear_sightline, trace_sightline
from rislam_rt.slam.nested.particles.update import FLOOR, trusted
from rislam_rt.slam.nested_config import NestedConfig
from rislam_rt.slam.returns import Returns, linearise

ITERATIONS = 4
"""Gauss-Newton steps of each agent particle's fit."""
SOUGHT, PARENT = 0, 1
"""Rows of the features that a birth's returns name."""


def initialise_landmark(
    belief: Nested,
    birth: Birth,
    body: Body,
    spans: Floats,
    config: NestedConfig,
    engine: CloudEngine,
    *,
    rng: np.random.Generator,
) -> Nested:
    """The belief with one more landmark.

    The history enters measurement by measurement, from the poses of the trail, as if the landmark had been there all
    along; agent particles are resampled in between, as what it tells of their past may be decisive.
    """
    mean, covariance, noise = _fit(belief, birth, body)
    wall = None if birth.verdict.kind is POINT else birth.anchor
    belief = place(belief, mean, covariance, config, engine, wall=wall, rng=rng)
    owner = len(belief.clouds) - 1
    belief, _ = absorb(belief, owner, [_prior(belief, birth)], engine)
    for row in range(len(birth.slots)):
        belief, _ = absorb(belief, owner, [_past_sighting(belief, birth, body, row, noise[row])], engine)
        belief, _ = renew(belief, spans, config, engine, rng=rng)
    return belief._replace(updates=np.append(belief.updates[:-1], len(birth.slots)))


def _fit(belief: Nested, birth: Birth, body: Body) -> tuple[Floats, Floats, Floats]:
    """Each agent particle's least-squares landmark (N, 3), its mean covariance (3, 3), and variances (K, 3)."""
    first = birth.verdict.fit.feature
    feature = np.broadcast_to(first, belief.position.shape).copy()
    information = np.linalg.inv(birth.prior)
    noise = birth.std**2 + FLOOR**2
    for _ in range(ITERATIONS):
        gap, by_feature, by_parent = _residuals(belief, birth, body, feature)
        spread = np.einsum("nkif,fg,nkig->nki", by_parent, _parent_covariance(belief, birth), by_parent)
        centre = np.einsum("n,nki->ki", belief.weight, gap)
        total = noise + spread.mean(axis=0) + np.einsum("n,nki->ki", belief.weight, (gap - centre) ** 2)
        trust = trusted(noise, centre / np.sqrt(total))
        weighted = by_feature / trust[:, :, None]
        normal = np.einsum("nkif,nkig->nfg", weighted, by_feature) + information
        slope = np.einsum("nkif,nki->nf", weighted, gap) - (feature - first) @ information
        feature = feature + np.linalg.solve(normal, slope[..., None])[..., 0]
    return feature, np.linalg.inv(normal).mean(axis=0), trust


def _residuals(belief: Nested, birth: Birth, body: Body, feature: Floats) -> tuple[Floats, Floats, Floats]:
    """Measured less predicted (N, K, 3), and derivatives (N, K, 3, 3) by the landmark sought and by its parent."""
    kind, parent = birth.verdict.kind, birth.verdict.parent
    past = np.swapaxes(belief.trail[birth.slots], 0, 1)
    poses = poses_of(past[..., :3], past[..., 3], body)
    known = feature if parent < 0 else belief.mean[:, parent]
    both = np.stack([feature, known], axis=1)[:, None]
    linear = linearise(kind, both, np.stack([birth.anchor, birth.anchor]), poses)
    by_feature = linear.by_feature.mean(axis=-4)
    return birth.seen - linear.seen.mean(axis=-2), by_feature[..., SOUGHT, :], by_feature[..., PARENT, :]


def _parent_covariance(belief: Nested, birth: Birth) -> Floats:
    """(3, 3) [m^2] of a new landmark's parent, zero without one."""
    parent = birth.verdict.parent
    return np.zeros((3, 3)) if parent < 0 else mean_covariances(belief)[parent]


def _prior(belief: Nested, birth: Birth) -> Sighting:
    """What is known of a new landmark before: a floor is level."""
    offset = belief.centre[:, -1] - birth.verdict.fit.feature
    return Sighting((linear_sightline(offset, np.zeros(3)),), np.zeros(3), birth.prior)


def _past_sighting(belief: Nested, birth: Birth, body: Body, row: int, noise: Floats) -> Sighting:
    """A past measurement as the new landmark's cloud sees it."""
    parent, kind = birth.verdict.parent, birth.verdict.kind
    past = belief.trail[birth.slots[row]]
    poses = poses_of(past[:, :3], past[:, 3], body)
    known = belief.centre[:, -1] if parent < 0 else belief.mean[:, parent]
    features, anchors = np.stack([belief.centre[:, -1], known], axis=1), np.stack([birth.anchor, birth.anchor])
    lines = tuple(trace_sightline(kind, k, SOUGHT, features, anchors, poses) for k in range(len(kind.tx)))
    return Sighting(lines, birth.seen[row], np.diag(noise) + _past_uncertainty(belief, birth, body, kind, row))


def _past_uncertainty(belief: Nested, birth: Birth, body: Body, kind: Returns, row: int) -> Floats:
    """(3, 3) share of the parent's error in a new landmark's past measurement, counted as often as it repeats."""
    covariance = _parent_covariance(belief, birth)
    if not covariance.any():
        return covariance
    weight, slots = belief.weight, birth.slots[row]
    past, means = weight @ belief.trail[slots], np.einsum("n,nfi->fi", weight, belief.mean)
    poses = poses_of(past[:3], past[3], body)
    both = np.stack([means[-1], means[birth.verdict.parent]])
    by_parent = linearise(kind, both, np.stack([birth.anchor, birth.anchor]), poses).by_feature.mean(axis=0)[:, PARENT]
    return len(birth.slots) * by_parent @ covariance @ by_parent.T
