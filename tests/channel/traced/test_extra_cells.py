"""Rays without an identity, summed by the cells of the receiver."""

from dataclasses import replace

import numpy as np

from rislam_rt.channel.traced.diffuse_paths import DiffusePaths, as_paths
from rislam_rt.geometry.angles import unit
from rislam_rt.model import Body, RadioConfig, Trajectory

RADIO = RadioConfig()


def drawn(cycles: int, count: int, spread: float) -> tuple[DiffusePaths, Trajectory]:
    """Rays at random about one place of delay and sky each cycle, and poses that head anywhere."""
    rng = np.random.default_rng(4)
    cycle = np.sort(rng.integers(cycles, size=count))
    middle = unit(rng.normal(size=(cycles, 3)))
    arrival = unit(middle[cycle] + spread * rng.normal(size=(count, 3)))
    departure = unit(rng.normal(size=(count, 3)))
    tau = 2e-8 + spread * 1e-9 * rng.normal(size=count)
    gain = rng.normal(size=count) + 1j * rng.normal(size=count)
    extras = DiffusePaths(cycle, np.zeros(count, int), tau, departure, arrival, gain, rng.normal(size=(count, 1, 3)))
    place = np.zeros((cycles, 3))
    return extras, Trajectory(np.arange(float(cycles)), place, place, rng.uniform(-3, 3, cycles), Body())


def test_nothing_is_lost_and_nothing_is_moved_beyond_its_cell():
    """The sum over a cycle's cells is that of its rays; each cell's delay and cosines are those of rays in it."""
    extras, poses = drawn(4, 3000, 0.3)
    paths = as_paths(extras, poses, RADIO)
    for cycle in range(4):
        mine = extras.cycle == cycle
        np.testing.assert_allclose(paths.gain[cycle].sum(), extras.gain[mine].sum(), rtol=1e-9)
        for p in np.flatnonzero(paths.valid[cycle]):
            near = np.abs(extras.tau[mine] - paths.tau[cycle, p]) * RADIO.bandwidth < 0.5
            near &= (np.abs(extras.arrival[mine] - paths.arrival[cycle, p]) < 0.5).all(axis=1)
            assert near.any()
    assert 4 * 10 < paths.valid.sum() < 3000 / 2
    np.testing.assert_allclose(np.linalg.norm(paths.arrival[paths.valid], axis=-1), 1.0)


def test_a_lone_ray_stays_as_it_is():
    extras, poses = drawn(3, 3, 0.0)
    extras = replace(extras, cycle=np.arange(3))
    paths = as_paths(extras, poses, RADIO)
    found = {complex(g): (t, tuple(a)) for g, t, a in zip(
        paths.gain[paths.valid], paths.tau[paths.valid], paths.arrival[paths.valid], strict=True)}  # fmt: skip
    assert len(found) == 3
    for g, tau, arrival in zip(extras.gain, extras.tau, extras.arrival, strict=True):
        near = found[min(found, key=lambda have, g=g: abs(have - g))]
        np.testing.assert_allclose(near[0], tau)
        np.testing.assert_allclose(near[1], arrival, atol=1e-12)


def test_no_ray_is_no_path():
    extras, poses = drawn(2, 4, 0.1)
    empty = DiffusePaths(*(getattr(extras, name)[:0] for name in DiffusePaths.__slots__[:-1]))
    paths = as_paths(empty, poses, RADIO)
    assert (paths.num_cycles, paths.num_paths) == (2, 0)
