"""The posterior bound of a trajectory: geometry against the channel, recursion against one large inverse."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.walls import build_walls
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import ConfigError
from rislam_rt.geometry.planes import mirror_chain, plane_tangents
from rislam_rt.information import LinearMeasurements, MotionPrior, build_landmark_model, posterior_bound
from rislam_rt.model import PathKind, RadioConfig
from rislam_rt.scene import load_scene

STEP = 1e-5


@pytest.fixture(scope="module")
def room():
    scene = load_scene("scenes/tilted_room")
    channel = ImageSourceChannel(scene, RadioConfig(), depth=2)
    motion = scene.agent[:20]
    walls = build_walls(scene)
    return channel.paths(motion), motion, scene.landmark_positions, walls.normal, walls.offset


def build(room, mode, landmark=None, normal=None, offset=None):
    paths, motion, *rest = room
    given = [new if new is not None else old for new, old in zip((landmark, normal, offset), rest, strict=True)]
    return build_landmark_model(paths, motion, *given, RadioConfig(noise_psd=1e-14), walls=mode)


def test_two_fixed_points_give_every_landmark_path_its_length_and_direction(room):
    paths, motion, *_ = room
    model = build(room, "planes")
    for path in np.flatnonzero(paths.landmark >= 0):
        a, b = model.point[model.tx_point[path]], model.point[model.rx_point[path]]
        ray = b - motion.rx
        length = np.linalg.norm(motion.tx - a, axis=1) + np.linalg.norm(ray, axis=1)
        here = paths.valid[:, path]
        np.testing.assert_allclose(length[here], paths.tau[here, path] * SPEED_OF_LIGHT, atol=1e-9)
        direction = ray / np.linalg.norm(ray, axis=1, keepdims=True)
        np.testing.assert_allclose(direction[here], paths.arrival[here, path], atol=1e-9)


def only(paths, kept):
    """The paths of some columns (P,)."""
    per_path = {n: getattr(paths, n)[kept] for n in ("kind", "landmark", "tx_walls", "rx_walls", "num_vertices")}
    names = ("valid", "tau", "departure", "arrival", "vertices", "gain")
    return replace(paths, **per_path, **{n: getattr(paths, n)[:, kept] for n in names}, ris=None)


def tilted(normal, first, second):
    turned = normal + first + second
    return turned / np.linalg.norm(turned)


@pytest.mark.parametrize("mode", ["known", "planes", "images"])
def test_points_move_with_landmarks_and_walls_as_their_derivatives_say(room, mode):
    _, _, landmark, normal, offset = room
    model = build(room, mode)
    if mode == "images":
        assert model.num_unknowns == 3 * len(model.point)
        return
    for column, label in enumerate(model.labels):
        moved = []
        for step in (STEP, -STEP):
            point, plane, away = landmark.copy(), normal.copy(), offset.copy()
            if column < 3 * len(landmark):
                point[column // 3, column % 3] += step
            else:
                wall = int(np.flatnonzero((model.wall_column >= 0) & (model.wall_column <= column))[-1])
                part = column - int(model.wall_column[wall])
                if part == 2:
                    away[wall] += step
                else:
                    axis = np.eye(3)[np.argmin(np.abs(normal[wall]))]
                    first = np.cross(normal[wall], axis) / np.linalg.norm(np.cross(normal[wall], axis))
                    second = np.cross(normal[wall], first)
                    plane[wall] = tilted(normal[wall], step * (part == 0) * first, step * (part == 1) * second)
            moved.append(build(room, mode, point, plane, away).point)
        difference = (moved[0] - moved[1]) / (2 * STEP)
        np.testing.assert_allclose(model.jacobian[:, :, column], difference, atol=1e-7, err_msg=label)


def test_wall_returns_equal_differences(room):
    """Agent moved and walls shifted: range and cosines of every wall return, from the channel's own lengths."""
    paths, motion, _, normal, offset = room
    model = build(room, "planes")
    cycle = 7
    tx, rx, heading = motion.tx[cycle], motion.rx[cycle], motion.heading[cycle]

    def measured(path, move=0.0, away=offset):
        walls = paths.tx_walls[path][paths.tx_walls[path] >= 0]
        ray = mirror_chain(tx + move, normal[walls], away[walls]).image - (rx + move)
        direction = ray / np.linalg.norm(ray)
        turn = np.array([[np.cos(heading), np.sin(heading), 0.0], [-np.sin(heading), np.cos(heading), 0.0]])
        return np.array([np.linalg.norm(ray), *(turn @ direction)])

    for path in np.flatnonzero(paths.valid[cycle] & (paths.kind == PathKind.VT)):
        assert measured(path)[0] == pytest.approx(paths.tau[cycle, path] * SPEED_OF_LIGHT, abs=1e-9)
        agent, unknown = model._wall_rows(cycle, int(path))
        for axis in range(3):
            shift = STEP * np.eye(3)[axis]
            difference = (measured(path, shift) - measured(path, -shift)) / (2 * STEP)
            np.testing.assert_allclose(agent[0, :, axis], difference, atol=1e-8)
        for wall in {int(w) for w in paths.tx_walls[path] if w >= 0 and model.wall_column[w] >= 0}:
            shift = STEP * (np.arange(len(offset)) == wall)
            difference = (measured(path, 0.0, offset + shift) - measured(path, 0.0, offset - shift)) / (2 * STEP)
            np.testing.assert_allclose(unknown[0, :, model.wall_column[wall] + 2], difference, atol=1e-8)


@pytest.mark.parametrize("climb", [None, 0.3])
def test_recursion_equals_the_inverse_of_the_whole_trajectory(climb):
    """Five cycles, random measurements: the last block of one joint information matrix, built by hand."""
    rng = np.random.default_rng(1)
    cycles, unknowns, axes, dt = 5, 4, 2 if climb is None else 3, 0.3
    motion = MotionPrior(acceleration=0.7, start_position=0.2, start_velocity=0.4, axes=axes, climb=climb)
    own = np.array([0.7, 0.7, climb or 0.0])[:axes]
    first = np.array([0.2, 0.2, 1e-9])[:axes], np.array([0.4, 0.4, 1e-9])[:axes]
    rows = [
        LinearMeasurements(rng.normal(size=(3, 3)), rng.normal(size=(3, unknowns)), rng.exponential(size=3))
        for _ in range(cycles)
    ]
    unknown_std = np.array([1.0, 2.0, 0.5, 3.0])
    bound = posterior_bound(rows, dt * np.arange(cycles), motion, unknown_std)
    # unknowns: start state (2 an axis), one acceleration an axis and step, landmarks (4)
    size = 2 * axes + axes * (cycles - 1) + unknowns
    joint = np.diag(np.concatenate([*first, *([own] * (cycles - 1)), unknown_std]) ** -2.0)
    state = np.zeros((2 * axes, size))
    state[:, : 2 * axes] = np.eye(2 * axes)
    step = np.kron([[1, dt], [0, 1]], np.eye(axes))
    for cycle, row in enumerate(rows):
        if cycle:
            state = step @ state
            column = 2 * axes + axes * (cycle - 1)
            state[:, column : column + axes] += np.kron([[dt**2 / 2], [dt]], np.eye(axes))
        slope = row.agent[:, :axes] @ state[:axes]
        slope[:, -unknowns:] += row.unknown
        joint += slope.T * row.information @ slope
        inverse = np.linalg.inv(joint)
        # a start known to 1e-9 stands for one known exactly: ten digits less of the inverse
        rtol = 1e-9 if climb is None else 1e-7
        np.testing.assert_allclose(bound.agent[cycle], state @ inverse @ state.T, rtol=rtol, atol=1e-12)
        np.testing.assert_allclose(bound.unknown[cycle], np.diag(inverse)[-unknowns:], rtol=1e-9)
    np.testing.assert_allclose(bound.last, inverse[-unknowns:, -unknowns:], rtol=1e-9, atol=1e-12)


def test_who_does_not_climb_has_a_known_height():
    rng = np.random.default_rng(2)
    rows = [LinearMeasurements(rng.normal(size=(4, 3)), rng.normal(size=(4, 2)), rng.exponential(size=4))] * 6
    level, known, climbing = (
        posterior_bound(rows, 0.1 * np.arange(6), motion, np.ones(2)).rms
        for motion in (MotionPrior(axes=3, climb=0.0), MotionPrior(), MotionPrior(axes=3, climb=0.5))
    )
    np.testing.assert_allclose(level, known, rtol=1e-12)
    assert climbing[-1] > known[-1]


def test_without_measurements_the_bound_is_the_motion_alone():
    nothing = [LinearMeasurements(np.zeros((0, 3)), np.zeros((0, 0)), np.zeros(0))] * 11
    motion = MotionPrior(acceleration=0.0, start_position=0.01, start_velocity=0.02)
    bound = posterior_bound(nothing, np.arange(11.0), motion, np.zeros(0))
    np.testing.assert_allclose(bound.rms, np.sqrt(2) * np.hypot(0.01, 0.02 * np.arange(11)), rtol=1e-12)


def test_order_of_knowledge(room):
    """Known walls beat unknown planes, planes beat free images; wall returns help; so does more power."""
    _, motion, *_ = room

    loose = MotionPrior(start_position=1.0, start_velocity=1.0)

    def rms(mode, **rows):
        model = build(room, mode)
        # images' own prior so wide that it adds nothing to what planes would say of them
        std = model.prior_std(1e3 if mode == "images" else 1.0)
        return posterior_bound(model.rows(**rows), motion.time, loose, std).rms[-1]

    known, planes, images = (rms(mode) for mode in ("known", "planes", "images"))
    assert known < planes < images
    assert rms("planes", use_vt=True) < planes
    assert planes < rms("planes", angles=False)
    model = build(room, "planes")
    louder = replace(model, radio=RadioConfig(noise_psd=1e-15))
    assert posterior_bound(louder.rows(), motion.time, loose, model.prior_std(1.0)).rms[-1] < planes
    deaf = posterior_bound(model.rows(np.inf), motion.time, loose, model.prior_std())
    np.testing.assert_allclose(deaf.unknown[-1], model.prior_std() ** 2)


def test_errors_of_walls_are_those_of_planes_drawn_from_the_covariance(room):
    """Planes turned and shifted by draws: mean square angle between the normals, and distance at a point."""
    _, _, _, normal, offset = room
    model = build(room, "planes")
    rng = np.random.default_rng(3)
    root = 1e-3 * rng.standard_normal((model.num_unknowns, model.num_unknowns))
    at = rng.uniform(-3.0, 3.0, (len(offset), 3))
    at += (offset - np.sum(at * normal, axis=1))[:, None] * normal
    found = model.wall_error(root @ root.T, at)
    draws = rng.standard_normal((20_000, model.num_unknowns)) @ root.T
    met = [wall for wall in range(len(offset)) if model.wall_column[wall] >= 0]
    assert set(found) == {model.paths.walls[wall] for wall in met}
    for wall in met:
        first, second, away = draws[:, model.wall_column[wall] + np.arange(3)].T
        turned = normal[wall] + np.stack([first, second], axis=1) @ np.stack(plane_tangents(normal[wall]))
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        angle = np.linalg.norm(np.cross(turned, normal[wall]), axis=1)
        distance = turned @ at[wall] - (offset[wall] + away)
        spread = found[model.paths.walls[wall]]
        assert spread.angle == pytest.approx(np.sqrt(np.mean(angle**2)), rel=0.02)
        assert spread.distance == pytest.approx(np.sqrt(np.mean(distance**2)), rel=0.02)
    landmarks = model.landmark_error(root @ root.T)
    assert list(landmarks) == list(model.paths.landmarks)
    size = np.sqrt(np.mean(np.sum(draws[:, :3] ** 2, axis=1)))
    assert landmarks[model.paths.landmarks[0]] == pytest.approx(size, rel=0.02)


def test_wall_returns_alone_do_not_tell_where_the_agent_is(room):
    """Their walls are unknown: the whole may be shifted, so that the start's own error stays."""
    paths, motion, *_ = room
    model = build((only(paths, paths.kind == PathKind.VT), *room[1:]), "planes")
    faint = replace(model, radio=RadioConfig(noise_psd=1e-11))
    prior = MotionPrior(0.0, 0.1, 0.0)
    found = posterior_bound(faint.rows(0.0, use_vt=True), motion.time, prior, model.prior_std())
    # 0.1 m beside walls known to 10 m, of which some ten are met
    np.testing.assert_allclose(found.rms, np.sqrt(2.0) * 0.1, rtol=5e-3)


def test_a_wall_known_by_one_image_is_as_sharp_as_that_image_seen_from_its_point(room):
    """Landmark and motion known, one path over one wall: its normal is along the line from point to image, whose
    position the same measurements give by themselves."""
    paths, motion, landmark, normal, offset = room
    single = (paths.kind == PathKind.VS) & (paths.rx_walls[:, 0] >= 0) & (paths.rx_walls[:, 1:] < 0).all(axis=1)
    single &= (paths.tx_walls < 0).all(axis=1)
    column = np.flatnonzero(single)[0]
    one = only(paths, [column])
    wall, point = int(paths.rx_walls[column, 0]), landmark[paths.landmark[column]]
    still = MotionPrior(0.0, 0.0, 0.0)
    bounds = {}
    for mode in ("planes", "images"):
        model = build((one, *room[1:]), mode)
        image = " | " in model.labels[-1]
        assert image == (mode == "images")
        # the plane's own prior is wide, and so is the image's; the landmark is known
        std = np.where([" | " in name or name.startswith(paths.walls[wall]) for name in model.labels], 1e3, 1e-9)
        bounds[mode] = (model, posterior_bound(model.rows(0.0), motion.time, still, std).last)
    model, covariance = bounds["planes"]
    middle = np.zeros((len(offset), 3))
    spread = model.wall_error(covariance, middle)[paths.walls[wall]]
    model, covariance = bounds["images"]
    block = covariance[-3:, -3:]
    across = np.trace(block) - normal[wall] @ block @ normal[wall]
    gap = 2.0 * abs(float(point @ normal[wall] - offset[wall]))
    assert spread.angle == pytest.approx(np.sqrt(across) / gap, rel=1e-3)


def test_bad_settings_are_refused(room):
    with pytest.raises(ConfigError, match="give 'known'"):
        build(room, "guessed")
    with pytest.raises(ConfigError, match="axes: 4"):
        MotionPrior(axes=4)
    with pytest.raises(ConfigError, match="climb"):
        MotionPrior(axes=2, climb=0.1)
    with pytest.raises(ConfigError, match="acceleration"):
        MotionPrior(acceleration=-1.0)
