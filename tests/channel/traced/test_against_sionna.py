"""Composition of legs against Sionna RT's own solvers, which trace device to device in one go.

LOS and wall returns are a slow proof here; of another room, `tests/channel/compare/test_path_solver.py` shows the same.
"""

import numpy as np
import pytest

from rislam_rt.channel.traced import TracedChannel
from rislam_rt.channel.traced.tracer_startup import start_tracer
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import PathKind, RadioConfig

RADIO = RadioConfig()


@pytest.fixture(scope="module")
def traced(rooms):
    """Channel, trajectory of one pose and its paths, at depth 1."""
    start_tracer()
    channel = TracedChannel(rooms.paper(), RADIO, 1)
    trajectory = rooms.at([4.05, 4.0, 0.5], tx=(-0.05, 0.01, -0.02), rx=(0.05, -0.03, 0.02))
    return channel, trajectory, channel.paths(trajectory)


@pytest.fixture
def devices(traced):
    """Sionna's scene of the same meshes with a vertical isotropic Tx and Rx on it, about the stage's origin."""
    import sionna.rt as rt

    channel, trajectory, _ = traced
    scene, origin = channel.tracer_scene.scene, channel.tracer_scene.origin
    scene.tx_array = scene.rx_array = rt.PlanarArray(num_rows=1, num_cols=1, pattern="iso", polarization="V")
    ends = [
        rt.Transmitter("tx", (trajectory.tx[0] - origin).tolist()),
        rt.Receiver("rx", (trajectory.rx[0] - origin).tolist()),
    ]
    scene.add(ends)
    yield scene, origin
    scene.remove(["tx", "rx"])


def magnitudes(paths):
    """Delay [s] and |a| of Sionna's paths, by delay."""
    tau = np.array(paths.tau).ravel()
    gain = np.hypot(np.array(paths.a[0]).ravel(), np.array(paths.a[1]).ravel())
    order = np.argsort(tau[tau > 0.0])
    return tau[tau > 0.0][order], gain[tau > 0.0][order]


def ours(paths, kinds):
    """Delay and |gain| of our valid paths of some kinds, by delay."""
    keep = np.flatnonzero(paths.valid[0] & np.isin(paths.kind, kinds))
    keep = keep[np.argsort(paths.tau[0, keep])]
    return paths.tau[0, keep], np.abs(paths.gain[0, keep])


@pytest.mark.slow
def test_los_and_wall_returns(traced, devices):
    import sionna.rt as rt

    theirs = magnitudes(rt.PathSolver(deterministic=True)(devices[0], max_depth=1, samples_per_src=5000))
    mine = ours(traced[2], [PathKind.LOS, PathKind.VT])
    np.testing.assert_allclose(mine[0], theirs[0], atol=1e-5 / SPEED_OF_LIGHT)  # float32 over 10 m
    np.testing.assert_allclose(mine[1], theirs[1], rtol=1e-5)


def test_scatterer_paths_are_eq_a2(traced, devices):
    """A point of constant cross-section, both legs and the walls on either, as `RCSSolver` has them."""
    from sionna.rt.rcs import ConstantRCSSensingTarget, RCSSolver

    channel, _, paths = traced
    scene, origin = devices
    sphere = channel.scene.scatterers[0]
    target = ConstantRCSSensingTarget("sphere", sphere.rcs, length=0.02, width=0.02, height=0.02)
    target.position = (sphere.position - origin).tolist()
    scene.add(target)
    # its depth counts the scattering event, and lets either leg have what remains: keep one bounce on one leg
    solved = RCSSolver(deterministic=True)(scene, max_depth=2, samples_per_sp=5000, seed=1)
    theirs = magnitudes(solved)
    scene.remove("sphere")
    mine = ours(paths, [PathKind.PS, PathKind.VS])
    assert len(mine[0]) == 13  # direct, 6 walls on either leg
    assert len(theirs[0]) == len(mine[0])
    np.testing.assert_allclose(mine[0], theirs[0], atol=2e-5 / SPEED_OF_LIGHT)
    np.testing.assert_allclose(mine[1], theirs[1], rtol=1e-5)
