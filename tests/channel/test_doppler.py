"""Motion within a cycle: against the image-source channel a moment later, and against Sionna's own Doppler shifts."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.doppler import doppler_shift, end_velocities, turn_rate
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Body, PathKind, RadioConfig, Trajectory

RADIO = RadioConfig()
ROOMS = ("paper", "l_shape", "parted")


def walk(turning, count=5):
    """A climbing, accelerating walk on a bow, or a straight glide."""
    time = 0.1 * np.arange(count)
    velocity = np.stack([0.5 + time, 0.7 - time, np.full(count, 0.2)], axis=-1)
    position = np.array([1.1, 0.9, 0.8]) + np.cumsum(0.1 * velocity, axis=0)
    heading = 3.0 + 0.9 * time if turning else np.full(count, 0.4)  # passes pi
    body = Body(np.array([-0.04, -0.03, 0.01]), np.array([0.05, 0.02, -0.01]))
    return Trajectory(time, position, velocity, np.angle(np.exp(1j * heading)), body)


def later(motion, elapsed):
    """Every pose `elapsed` [s] later, at the cycle's velocity and turn rate."""
    return replace(
        motion,
        position=motion.position + elapsed * motion.velocity,
        heading=motion.heading + elapsed * turn_rate(motion),
    )


@pytest.fixture(scope="module", params=[(room, turning) for room in ROOMS for turning in (False, True)], ids=str)
def case(request, rooms):
    """Channel, trajectory and its paths."""
    room, turning = request.param
    channel = ImageSourceChannel(getattr(rooms, room)(), RADIO, 2)
    return channel, walk(turning), channel.paths(walk(turning))


def test_doppler_is_the_rate_of_the_delay(case):
    channel, motion, paths = case
    step = 1e-4
    sides = [channel.paths(later(motion, sign * step)) for sign in (1.0, -1.0)]
    shift = doppler_shift(paths, motion, RADIO.wavelength)
    assert not shift[~paths.valid].any()
    seen, places = 0, [columns_of(other) for other in sides]
    for p in range(paths.num_paths):
        ahead, behind = (columns.get(paths.identity(p)) for columns in places)
        if ahead is None or behind is None:
            continue
        both = paths.valid[:, p] & sides[0].valid[:, ahead] & sides[1].valid[:, behind]
        rate = (sides[0].tau[both, ahead] - sides[1].tau[both, behind]) / (2.0 * step)
        # third derivative of a length, (m/s)^3 / m^2, times step^2 / 6: some 1e-9 m/s, over 3 cm 1e-7 Hz; rounding of
        # 10 m over the step: 1e-11 m/s
        np.testing.assert_allclose(shift[both, p], -RADIO.carrier * rate, rtol=0, atol=2e-6)
        seen += both.sum()
    assert seen > 0.95 * paths.valid.sum()
    assert np.abs(shift).max() > 20.0


def columns_of(paths):
    return {paths.identity(p): p for p in range(paths.num_paths)}


def test_line_of_sight_of_a_rigid_body_has_no_shift(rooms):
    channel = ImageSourceChannel(rooms.scene([], scatterers=()), RADIO, 0)
    motion = walk(turning=True)
    shift = doppler_shift(channel.paths(motion), motion, RADIO.wavelength)
    np.testing.assert_allclose(shift, 0.0, atol=1e-9)


def test_a_wall_straight_ahead_shifts_by_both_ends(rooms):
    """Second way: 2 v / lambda towards a wall."""
    wall = rooms.polygon("wall", [(4, -5, -5), (4, 5, -5), (4, 5, 5), (4, -5, 5)])
    body = Body(np.array([0.0, -0.05, 0.0]), np.array([0.0, 0.05, 0.0]))
    motion = Trajectory(np.zeros(1), np.zeros((1, 3)), np.array([[1.5, 0.0, 0.0]]), np.zeros(1), body)
    paths = ImageSourceChannel(rooms.scene([wall], scatterers=()), RADIO, 1).paths(motion)
    bounce = np.flatnonzero(paths.kind == PathKind.VT)[0]
    shift = doppler_shift(paths, motion, RADIO.wavelength)[0, bounce]
    assert shift == pytest.approx(2 * 1.5 / RADIO.wavelength * np.cos(np.arctan(0.05 / 4)), rel=1e-12)


def test_turning_moves_the_ends_against_each_other():
    motion = walk(turning=True)
    np.testing.assert_allclose(turn_rate(motion), 0.9, rtol=1e-12)
    tx, rx = end_velocities(motion)
    after, before = (later(motion, sign * 1e-5) for sign in (1.0, -1.0))
    np.testing.assert_allclose(tx, (after.tx - before.tx) / 2e-5, atol=1e-9)
    np.testing.assert_allclose(rx, (after.rx - before.rx) / 2e-5, atol=1e-9)
    one = motion[:1]
    assert turn_rate(one).tolist() == [0.0]


@pytest.mark.slow
def test_sionnas_own_doppler(rooms):
    """LOS, wall returns and scatterer paths of `PathSolver` and `RCSSolver`, matched by delay."""
    from rislam_rt.channel.traced import TracedChannel

    channel = TracedChannel(rooms.paper(), RADIO, 1)
    body = Body(np.array([-0.05, 0.01, -0.02]), np.array([0.05, -0.03, 0.02]))
    velocity = np.array([[0.7, -0.4, 0.3]])
    motion = Trajectory(np.zeros(1), np.array([[4.05, 4.0, 0.5]]), velocity, np.zeros(1), body)
    paths = channel.paths(motion)
    shift = doppler_shift(paths, motion, RADIO.wavelength)[0]
    for kinds, theirs in sionna_shifts(channel, motion).items():
        mine = np.flatnonzero(np.isin(paths.kind, kinds))
        mine = mine[np.argsort(paths.tau[0, mine])]
        assert len(mine) == len(theirs[0])
        np.testing.assert_allclose(paths.tau[0, mine], theirs[0], atol=2e-5 / SPEED_OF_LIGHT)
        # float32 directions times 30 Hz
        np.testing.assert_allclose(shift[mine], theirs[1], atol=2e-4)


def sionna_shifts(channel, motion):
    """Delays and Doppler shifts of Sionna's solvers, by delay, for each group of path classes."""
    import sionna.rt as rt
    from sionna.rt.rcs import ConstantRCSSensingTarget, RCSSolver

    scene, origin, sphere = channel.tracer_scene.scene, channel.tracer_scene.origin, channel.scene.scatterers[0]
    scene.tx_array = scene.rx_array = rt.PlanarArray(num_rows=1, num_cols=1, pattern="iso", polarization="V")
    speed = motion.velocity[0].tolist()
    scene.add(rt.Transmitter("tx", (motion.tx[0] - origin).tolist(), velocity=speed))
    scene.add(rt.Receiver("rx", (motion.rx[0] - origin).tolist(), velocity=speed))
    direct = rt.PathSolver(deterministic=True)(scene, max_depth=1, samples_per_src=5000)
    target = ConstantRCSSensingTarget("sphere", sphere.rcs, length=0.02, width=0.02, height=0.02)
    target.position = (sphere.position - origin).tolist()
    scene.add(target)
    scattered = RCSSolver(deterministic=True)(scene, max_depth=2, samples_per_sp=5000, seed=1)
    groups = {(PathKind.LOS, PathKind.VT): direct, (PathKind.PS, PathKind.VS): scattered}
    found = {}
    for kinds, solved in groups.items():
        tau, doppler = np.array(solved.tau).ravel(), np.array(solved.doppler).ravel()
        order = np.argsort(tau[tau > 0.0])
        found[kinds] = tau[tau > 0.0][order], doppler[tau > 0.0][order]
    return found
