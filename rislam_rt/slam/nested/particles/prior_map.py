"""Prior map of the nested filter: landmarks known beforehand, from another run."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.nested.particles import agents
from rislam_rt.slam.nested.particles.landmark_cloud import LEAST_STD, CloudEngine
from rislam_rt.slam.nested.particles.particle_belief import Nested, absorb, place_landmark
from rislam_rt.slam.nested.particles.sightline import Sighting, linear_sightline
from rislam_rt.slam.nested_config import NestedConfig


def set_prior_map(
    belief: Nested, features: Floats, covariance: Floats, config: NestedConfig, engine: CloudEngine,
    *, rng: np.random.Generator,
) -> Nested:  # fmt: skip
    """Give the particles a prior map: landmarks (F, 3) [m] with a joint covariance (3F, 3F) [m^2].

    Errors that landmarks have in common are spread over the agent particles, the rest over their clouds.
    """
    count = len(belief.log_weight)
    normal = agents.standardise(np.full(count, 1.0 / count), rng.standard_normal((count, features.size)))
    own = _own_part(covariance)
    means = features.ravel() + normal @ _root(covariance - own).T
    line = linear_sightline(np.zeros((count, 3)), np.zeros(3))
    for row in range(len(features)):
        block = own[3 * row : 3 * row + 3, 3 * row : 3 * row + 3] + LEAST_STD**2 * np.eye(3)
        belief = place_landmark(belief, means[:, 3 * row : 3 * row + 3], block, config, engine, rng=rng)
        belief, _ = absorb(belief, row, [Sighting(line, np.zeros(3), block)], engine)
    return belief


def _own_part(covariance: Floats) -> Floats:
    """Largest share of the diagonal blocks of a prior map's covariance that can be taken off and leave a covariance."""
    own = np.zeros_like(covariance)
    for row in range(0, len(covariance), 3):
        own[row : row + 3, row : row + 3] = covariance[row : row + 3, row : row + 3] + 1e-12 * np.eye(3)
    if not len(own):
        return own
    back = np.linalg.inv(np.linalg.cholesky(own))
    share = float(np.clip(0.95 * np.linalg.eigvalsh(back @ covariance @ back.T)[0], 0.0, 0.95))
    return share * own


def _root(covariance: Floats) -> Floats:
    """Symmetric square root of a prior map's covariance, negative rounding taken for zero."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)
