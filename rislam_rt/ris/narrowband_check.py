"""Narrowband check of a panel: whether delays over its elements differ by less than the band resolves."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model.ris import RisSpec


def delay_spread(spec: RisSpec, center: Floats, tx: Floats, rx: Floats) -> Floats:
    """Delay spread (...,) [s] over a panel: largest difference between elements of the delay from tx (..., 3) over the
    element to rx (..., 3)."""
    elements = np.asarray(center) + spec.offsets().reshape(-1, 3)
    length = sum(np.linalg.norm(np.asarray(end)[..., None, :] - elements, axis=-1) for end in (tx, rx))
    return np.ptp(length, axis=-1) / SPEED_OF_LIGHT


def delay_spread_warnings(spec: RisSpec, center: Floats, tx: Floats, rx: Floats, bandwidth: float) -> tuple[str, ...]:
    """Warning if delays over a panel spread by more than 1 / B, so that a path over it has no single delay; else
    none."""
    spread = float(np.max(delay_spread(spec, center, tx, rx), initial=0.0))
    if spread * bandwidth <= 1.0:
        return ()
    return (
        f"ris: delays over the panel spread by up to {spread * 1e9:.3g} ns, more than 1 / B = "
        f"{1e9 / bandwidth:.3g} ns; take a smaller panel or a smaller bandwidth",
    )
