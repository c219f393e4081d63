"""The certificate: what matches, what is explained by which proof, and what is not."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.compare import Validation, compare_paths, random_poses
from rislam_rt.channel.compare.unmatched_paths import SHORTEST_SEGMENT, DifferenceExplainer
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.errors import SceneError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.model import RadioConfig
from rislam_rt.report.studies.channel_validation import validation_page, validation_table

RADIO = RadioConfig()


def paths_of(scene, trajectory, depth=2):
    return ImageSourceChannel(scene, RADIO, depth).paths(trajectory)


def without(paths, lost):
    """The paths with the entries (K, P) of `lost` struck out."""
    return replace(paths, valid=paths.valid & ~lost)


def only(paths, cycle, label):
    """A mask (K, P) with one path in it."""
    mask = np.zeros(paths.valid.shape, dtype=bool)
    mask[cycle, [paths.label(p) for p in range(paths.num_paths)].index(label)] = True
    assert (mask & paths.valid).any()
    return mask


@pytest.mark.parametrize("name", ["paper", "l_shape", "parted"])
def test_a_channel_matches_itself(rooms, name):
    scene, trajectory = getattr(rooms, name)(), rooms.at([[1.1, 2.3, 1.2], [2.4, 4.7, 0.5]])
    paths = paths_of(scene, trajectory)
    report = compare_paths(paths, paths, scene, trajectory)
    assert (report.matched, report.explained, report.unexplained) == (paths.valid.sum(), {}, 0)
    numbers = report.as_dict()
    # rounding of g conj(g) and of cross products
    assert max(value for key, value in numbers.items() if key.startswith("max_")) < 1e-15


def test_order_of_columns_and_walls_plays_no_part(rooms):
    scene, trajectory = rooms.parted(), rooms.at([[1.1, 2.3, 1.2], [2.4, 4.7, 0.5]])
    shuffled = replace(scene, reflectors=scene.reflectors[::-1])
    report = compare_paths(paths_of(scene, trajectory), paths_of(shuffled, trajectory), scene, trajectory)
    assert report.unexplained == 0
    assert not report.explained
    assert report.length_error.max() < 1e-12


def test_errors_are_measured(rooms):
    scene, trajectory = rooms.paper(), rooms.at([1.1, 2.3, 1.2])
    paths = paths_of(scene, trajectory)
    turn = np.array([[1, 0, 0], [0, np.cos(3e-4), -np.sin(3e-4)], [0, np.sin(3e-4), np.cos(3e-4)]])
    worse = replace(
        paths,
        tau=paths.tau + 1e-3 / 299_792_458.0,
        gain=paths.gain * 10 ** (0.5 / 20) * np.exp(0.02j),
        arrival=paths.arrival @ turn.T,
    )
    numbers = compare_paths(worse, paths, scene, trajectory).as_dict()
    assert numbers["max_length_error_m"] == pytest.approx(1e-3, rel=1e-6)
    assert numbers["max_gain_error_db"] == pytest.approx(0.5)
    assert numbers["max_phase_error_rad"] == pytest.approx(0.02)
    assert 2e-4 < numbers["max_angle_error_rad"] <= 3e-4 * (1 + 1e-9)
    assert numbers["percentiles"]["aoa_error_rad"]["max"] == numbers["max_angle_error_rad"]
    assert sum(numbers["matched_by_kind"].values()) == numbers["matched"]


@pytest.mark.parametrize("side", ["traced", "analytic"])
def test_a_plain_loss_is_unexplained(rooms, side):
    scene, trajectory = rooms.parted(), rooms.at([[1.1, 2.3, 1.2], [2.4, 4.7, 0.5]])
    full = paths_of(scene, trajectory)
    less = without(full, only(full, 1, "VT wall_x0 floor"))
    pair = (full, less) if side == "traced" else (less, full)
    report = compare_paths(*pair, scene, trajectory)
    assert report.unexplained == 1
    (path,) = report.one_sided
    assert (path.cycle, path.label, path.side, path.reason) == (1, "VT wall_x0 floor", side, "")
    assert "all its conditions hold" in path.proof


def test_an_invented_path_is_unexplained_not_an_edge(rooms):
    """A path that misses its facet by a metre has no proof, even if it passes an edge closely elsewhere."""
    scene, trajectory = rooms.l_shape(), rooms.at([1.1, 4.6, 1.2])
    full = paths_of(scene, trajectory)
    fake = without(full, ~only(full, 0, "LOS"))
    # side1 (x = 6) cannot be seen from the other arm
    invented = replace(fake, kind=np.where(fake.kind == 0, 1, fake.kind), tx_walls=np.where(
        (fake.kind == 0)[:, None], [[full.walls.index("side1"), -1]], fake.tx_walls))  # fmt: skip
    report = compare_paths(invented, without(full, full.valid), scene, trajectory)
    assert report.unexplained == 1
    assert "outside the outline of side1" in report.one_sided[0].proof


def test_a_short_segment_explains_what_the_tracer_lacks_but_not_what_it_has(rooms):
    scene = rooms.paper()
    # the double bounce in the corner of x = 0 and y = 0: its middle segment is short when the baseline points there
    trajectory = rooms.at([2.0, 2.0, 1.0], tx=(-0.051, -0.05, 0.0), rx=(0.051, 0.05, 0.0))
    full = paths_of(scene, trajectory)
    label = next(n for n in ("VT wall_x0 wall_y0", "VT wall_y0 wall_x0") if n in map(full.label, range(full.num_paths)))
    less = without(full, only(full, 0, label))
    report = compare_paths(less, full, scene, trajectory)
    assert report.explained == {"short segment": 1}
    assert report.one_sided[0].size < SHORTEST_SEGMENT
    assert compare_paths(full, less, scene, trajectory).unexplained == 1


@pytest.mark.parametrize("depth", [0, 1])
def test_an_edge_is_a_proof_only_where_float32_leaves_it_open(rooms, depth):
    """A screen whose upper edge lies just below a ray: the line of sight, or that to a bounce on a board."""
    trajectory = rooms.at([3.0, 3.0, 1.0], tx=(-0.5, 0.1, 0.0), rx=(0.5, -0.1, 0.0))
    board = rooms.polygon("board", [(2, 5, 0), (4, 5, 0), (4, 5, 2), (2, 5, 2)])
    place = 3.0 if depth == 0 else 2.7  # the ray from (2.5, 3.1, 1) to (3, 5, 1) has y = 3.86 at x = 2.7

    def room(gap):
        corners = [(place, 2, 0), (place, 4, 0), (place, 4, 1 - gap), (place, 2, 1 - gap)]
        return rooms.scene([board, rooms.polygon("screen", corners)])

    certifier = DifferenceExplainer.of(room(0.0), trajectory, depth, 0.0)
    limit = certifier._unfolded([0] * depth, trajectory.tx[0], trajectory.rx[0]).shift[0]
    # float32: 6e-8 of some metres, eight times over; a moved image 6e-6 of some metres
    assert (1e-7, 1e-6)[depth] < limit < (1e-5, 1e-4)[depth]
    for gap, explained in ((0.2 * limit, {"edge": 1}), (1.5 * limit, {})):
        scene = room(gap)
        full = paths_of(scene, trajectory, depth)
        lost = without(full, only(full, 0, "VT board" if depth else "LOS"))
        report = compare_paths(lost, full, scene, trajectory)
        assert report.explained == explained
        assert report.unexplained == 1 - len(explained)
        if explained:
            assert f"float32 leaves {limit:.2e} m" in report.one_sided[0].proof


def test_occlusion_names_the_object(rooms):
    trajectory = rooms.at([3.0, 3.0, 1.0], tx=(-0.5, 0.1, 0.0), rx=(0.5, -0.1, 0.0))
    screen = rooms.polygon("screen", [(3, 2, 0), (3, 4, 0), (3, 4, 2), (3, 2, 2)])
    blind, seeing = rooms.scene([], []), rooms.scene([screen], [])
    report = compare_paths(paths_of(blind, trajectory), paths_of(seeing, trajectory), seeing, trajectory)
    assert report.explained == {"occluded": 1}
    assert "screen" in report.one_sided[0].proof


def test_beyond_depth(rooms):
    scene, trajectory = rooms.paper(), rooms.at([1.1, 2.3, 1.2])
    deep, shallow = paths_of(scene, trajectory, 2), paths_of(scene, trajectory, 1)
    report = compare_paths(deep, shallow, scene, trajectory)
    assert report.explained == {"beyond depth": deep.valid.sum() - shallow.valid.sum()}
    assert report.unexplained == 0


def test_an_agent_in_a_face_is_degenerate(rooms):
    scene = rooms.paper()
    near = rooms.at([2.0, 2.5, 1e-5], tx=(-0.05, 0.0, 0.0), rx=(0.05, 0.0, 0.0))
    full = paths_of(scene, near, 1)
    report = compare_paths(without(full, only(full, 0, "VT floor")), full, scene, near)
    assert report.explained == {"in a face": 1}


@pytest.mark.parametrize("name", ["paper", "l_shape", "parted"])
def test_random_poses_are_inside_and_clear(rooms, name):
    scene = getattr(rooms, name)()
    trajectory = random_poses(scene, 150, rng=np.random.default_rng(4))
    assert len(trajectory) == 150
    triangles = np.concatenate([r.triangles for r in scene.reflectors])
    assert distance_to_triangles(trajectory.position, triangles).min() >= 0.1
    np.testing.assert_allclose(np.linalg.norm(trajectory.tx - trajectory.rx, axis=1), 0.1)
    np.testing.assert_allclose((trajectory.tx + trajectory.rx) / 2, trajectory.position, atol=1e-12)
    x, y, _ = trajectory.position.T
    if name == "l_shape":
        assert not ((x > 3) & (y > 3)).any()
        assert (x > 3).any()
        assert (y > 3).any()
    if name == "parted":
        assert (x > 3).any()  # through the doorway
    again = random_poses(scene, 150, rng=np.random.default_rng(4))
    np.testing.assert_array_equal(again.position, trajectory.position)


def test_poses_leave_out_the_inside_of_objects(rooms):
    crate = rooms.box((3.0, 3.0, 0.0), (5.0, 5.0, 2.5), "crate_")
    scene = rooms.scene([*rooms.box((0, 0, 0), (6, 6, 3)), *crate])
    x, y, z = random_poses(scene, 200, rng=np.random.default_rng(0)).position.T
    assert not ((x > 3) & (x < 5) & (y > 3) & (y < 5) & (z < 2.5)).any()


def test_a_room_without_space_is_refused(rooms):
    with pytest.raises(SceneError, match="ask for fewer"):
        random_poses(rooms.scene(rooms.box((0, 0, 0), (0.15, 6, 3))), 5, rng=np.random.default_rng(0))


def test_the_table_has_a_row_a_room(rooms):
    scene, trajectory = rooms.paper(), rooms.at([1.1, 2.3, 1.2])
    deep, shallow = paths_of(scene, trajectory, 2), paths_of(scene, trajectory, 1)
    report = compare_paths(deep, shallow, scene, trajectory)
    lines = validation_table([Validation("paper", 1, "traced", report)] * 2).splitlines()
    assert len(lines) == 4
    assert lines[2].startswith("| paper | 1 | traced | 1 |")
    assert f"beyond depth: {report.explained['beyond depth']}" in lines[2]
    assert len({line.count("|") for line in lines}) == 1
    page = validation_page([Validation("paper", 1, "traced", report)], seed=9)
    assert page.startswith("# Channel validation")
    assert page.endswith(lines[2] + "\n")
    assert "Seed 9" in page
