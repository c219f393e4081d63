"""The paper's panel in its ceiling, and paths over random legs to it."""

from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.model import Paths, RisLegs, RisSpec

WAVELENGTH = 299_792_458.0 / 10e9
CENTER = np.array([3.0, 3.0, 3.0])


def spec(rows=6, cols=6, **options):
    return RisSpec(
        rows, cols, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), **options
    )


def random_paths(pairs, shape, *, cycles=3, others=2, seed=0):
    """Paths over the pairs (tx leg, rx leg) in this order, behind `others` paths that do not meet the panel."""
    rng = np.random.default_rng(seed)

    def draw(*size):
        return rng.normal(size=size) + 1j * rng.normal(size=size)

    tx_leg, rx_leg = (np.array([-1] * others + [p[side] for p in pairs]) for side in (0, 1))
    count, none = len(tx_leg), np.full((len(tx_leg), 1), -1)
    legs = RisLegs(draw(cycles, tx_leg.max() + 1, *shape), draw(cycles, rx_leg.max() + 1, *shape), tx_leg, rx_leg)
    return Paths(
        kind=np.where(tx_leg < 0, 2, 4),
        landmark=np.where(tx_leg < 0, 0, 1),
        tx_walls=none,
        rx_walls=none,
        valid=rng.random((cycles, count)) < 0.8,
        tau=np.zeros((cycles, count)),
        departure=np.zeros((cycles, count, 3)),
        arrival=np.zeros((cycles, count, 3)),
        gain=draw(cycles, count),
        vertices=np.zeros((cycles, count, 1, 3)),
        num_vertices=np.ones(count, dtype=int),
        walls=(),
        landmarks=("sphere", "ris"),
        ris=legs,
    )


@pytest.fixture(scope="session")
def panels():
    """The builders above."""
    return SimpleNamespace(spec=spec, random_paths=random_paths, center=CENTER, wavelength=WAVELENGTH)
