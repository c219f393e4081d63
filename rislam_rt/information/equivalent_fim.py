"""Equivalent information: what is left for the agent when landmarks, heading, clock or walls are unknown too."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.information.outcome import Outcome


class EquivalentPosition(NamedTuple):
    """Information on the agent with the nuisance eliminated."""

    information: Floats
    """(..., D, D)."""
    outcome: Integers
    """(...,) `DEGENERATE` where the nuisance itself is not observable; its unseen part then carries nothing."""


def equivalent_information(
    agent: Floats, nuisance: Floats, weight: Floats, nuisance_prior: Floats
) -> EquivalentPosition:
    """Information (..., D, D) on the agent from M measurements that also depend on N unknowns.

    Parameters
    ----------
    agent
        (..., M, D) derivatives of the measurements with respect to the agent.
    nuisance
        (..., M, N) derivatives with respect to the unknowns: landmarks (`landmark_gradient`), heading
        (`heading_gradient`), a clock offset (ones, in metres).
    weight
        (..., M) information of each measurement, e.g. `range_information`.
    nuisance_prior
        (..., N, N) information on the unknowns beforehand; zeros if there is none.

    Block elimination (Schur complement) with a pseudo-inverse, so that an unknown that nothing sees costs nothing.
    """
    weighted = agent * weight[..., None]
    own = np.swapaxes(weighted, -1, -2) @ agent
    cross = np.swapaxes(weighted, -1, -2) @ nuisance
    block = np.swapaxes(nuisance * weight[..., None], -1, -2) @ nuisance + nuisance_prior
    scale = np.sqrt(np.diagonal(block, axis1=-2, axis2=-1))
    scale = np.where(scale > 0.0, scale, 1.0)
    unit_diagonal = block / scale[..., :, None] / scale[..., None, :]
    value, vector = np.linalg.eigh(unit_diagonal)
    seen = value > 1e-12
    inverse = np.where(seen, 1.0 / np.where(seen, value, 1.0), 0.0)
    projected = (cross / scale[..., None, :]) @ vector
    reduced = own - (projected * inverse[..., None, :]) @ np.swapaxes(projected, -1, -2)
    outcome = np.where(seen.all(axis=-1), int(Outcome.OK), int(Outcome.DEGENERATE))
    return EquivalentPosition(0.5 * (reduced + np.swapaxes(reduced, -1, -2)), outcome)


def uncertain_range_information(information: Floats, gradient: Floats, covariance: Floats) -> Floats:
    """Information (...,) [1/m^2] on an agent's range when the landmark is known to a covariance (..., 3, 3) [m^2].

    `1 / (1/w + h^T C h)` with the landmark's gradient h (..., 3): exact for one path a landmark.
    """
    spread = np.einsum("...i,...ij,...j->...", gradient, covariance, gradient)
    return information / (1.0 + information * spread)
