"""The importer's geometry: polygons to triangles, thinned outlines, prisms, cells, free ways."""

import numpy as np
import pytest
from built_in_rooms.parts import box_walls

from rislam_rt.scene.check.mesh_queries import crossings
from rislam_rt.scene.importing.free_space import find_free, is_seen
from rislam_rt.scene.importing.regions.flat_regions import find_facets, weld
from rislam_rt.scene.importing.regions.mesh_simplification import clustered
from rislam_rt.scene.importing.regions.round_surfaces import find_round, prism, sides_for
from rislam_rt.scene.meshes import joined
from rislam_rt.scene.polygons import inside_loop, outline_loops, signed_area, simplify_loop, triangulate
from rislam_rt.scene.shapes import block


def star(corners: int, *, rng: np.random.Generator, reach: float = 1.0) -> np.ndarray:
    """A star-shaped polygon (n, 2), counter-clockwise, with spikes."""
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
    angle = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False) + 0.5 * (angle - angle.mean()) / corners
    radius = reach * rng.uniform(0.4, 1.0, corners)
    return radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


@pytest.mark.parametrize("seed", range(6))
def test_triangles_cover_a_polygon_with_holes(seed: int) -> None:
    """Area by the shoelace formula; every random point of the polygon lies in one triangle, every other in none."""
    rng = np.random.default_rng(seed)
    outer = star(int(rng.integers(5, 40)), rng=rng)
    holes = [0.1 * star(int(rng.integers(3, 12)), rng=rng)[::-1] + at for at in ([0.15, 0.1], [-0.15, -0.1])]
    faces = triangulate(outer, holes)
    assert faces is not None
    corners = np.concatenate([outer, *holes])[faces]
    wanted = signed_area(outer) + sum(signed_area(hole) for hole in holes)
    assert sum(signed_area(t) for t in corners) == pytest.approx(wanted, rel=1e-9)
    for point in rng.uniform(-1.0, 1.0, size=(60, 2)):
        inside = inside_loop(outer, point) and not any(inside_loop(hole, point) for hole in holes)
        assert sum(inside_loop(t, point) for t in corners) == int(inside)


def test_a_polygon_that_crosses_itself_is_no_polygon() -> None:
    assert triangulate(np.array([[0.0, 0], [4, 3], [4, 0], [0, 2]]), []) is None


def test_two_neighbours_thin_their_common_edge_alike() -> None:
    """A wavy border between two faces: whichever way round it is walked, the same corners stay."""
    rng = np.random.default_rng(3)
    border = np.column_stack([np.linspace(0.0, 5.0, 60), 0.05 * rng.standard_normal(60), np.zeros(60)])
    points = np.concatenate([border, [[5.0, 2.0, 0.0], [0.0, 2.0, 0.0], [5.0, -2.0, 0.0], [0.0, -2.0, 0.0]]])
    kept = np.zeros(len(points), dtype=bool)
    kept[[0, 59]] = True
    above = simplify_loop([*range(60), 60, 61], points, kept, 0.04)
    below = simplify_loop([*range(59, -1, -1), 63, 62], points, kept, 0.04)
    assert [c for c in above if c < 60] == [c for c in below if c < 60][::-1]
    assert 2 < sum(c < 60 for c in above) < 60


def test_outlines_of_a_plate_with_a_hole() -> None:
    cells = [(i, j) for i in range(4) for j in range(3) if (i, j) != (1, 1)]
    index = np.arange(20).reshape(5, 4)
    faces = np.array([t for i, j in cells for t in ([index[i, j], index[i + 1, j], index[i + 1, j + 1]],
                                                    [index[i, j], index[i + 1, j + 1], index[i, j + 1]])])  # fmt: skip
    points = np.stack(np.indices((5, 4)), axis=-1).reshape(-1, 2).astype(float)
    assert sorted(signed_area(points[loop]) for loop in outline_loops(faces)) == [-1.0, 12.0]


@pytest.mark.parametrize(("sides", "axis"), [(12, 0), (24, 1), (64, 2)])
def test_a_cylinder_is_recognised(sides: int, axis: int) -> None:
    import trimesh

    mesh = trimesh.creation.cylinder(radius=0.3, height=1.7, sections=sides)
    points = np.roll(mesh.vertices, axis - 2, axis=1) + np.array([1.0, 2.0, 3.0])
    facets = find_facets(weld([points[mesh.faces]]))
    (found,) = find_round(facets)
    assert found.radius == pytest.approx(0.3, rel=1e-6)  # corners lie on it
    assert abs(found.axis[axis]) == pytest.approx(1.0, abs=1e-9)
    assert found.along[1] - found.along[0] == pytest.approx(1.7, rel=1e-6)
    assert found.arc[1] - found.arc[0] == pytest.approx(2.0 * np.pi)
    shape, error = prism(found, 0.005)
    count = sides_for(0.3, 0.005, 2.0 * np.pi)
    assert len(shape.faces) == 2 * count
    assert error <= 0.005
    edges = np.linalg.norm(np.diff(shape.vertices.reshape(count, 4, 3)[:, :2], axis=1), axis=-1)
    assert edges.sum() == pytest.approx(2.0 * np.pi * 0.3, rel=1e-9)  # the true girth


def test_a_box_and_a_hexagon_are_not_round() -> None:
    import trimesh

    box = block([0, 0, 0], [0.3, 0.3, 2.0])
    assert find_round(find_facets(weld([box.vertices[box.faces]]))) == []
    hexagon = trimesh.creation.cylinder(radius=0.2, height=2.0, sections=6)
    assert find_round(find_facets(weld([hexagon.vertices[hexagon.faces]]))) == []


def test_cells_move_no_corner_farther_than_they_say() -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.4)
    thin, moved = clustered(np.asarray(ball.triangles), 0.05)
    assert 100 < len(thin) < len(ball.faces) / 2
    assert moved <= 0.05 * np.sqrt(3.0)
    assert np.abs(np.linalg.norm(thin.reshape(-1, 3), axis=1) - 0.4).max() <= moved + 1e-12


def test_a_leg_on_a_corner_of_the_floor_hangs_on_nothing() -> None:
    floor = box_walls(4.0, 3.0, 2.5)["floor"]
    leg = block([0.0, 0.0, 0.0], [0.05, 0.05, 0.7])
    facets = find_facets(weld([floor.vertices[floor.faces], leg.vertices[leg.faces]]))
    assert len(np.unique(facets.component)) == 2
    assert facets.area.sum() == pytest.approx(12.0 + 2 * 0.05**2 + 4 * 0.05 * 0.7)
    assert np.sort(facets.width)[-1] == pytest.approx(3.0)


def test_the_free_way_is_inside_and_what_is_behind_is_unseen() -> None:
    """A closed room within an outer skin, with a box in it: the skin and the box's inside are not seen."""
    inner, skin = (joined(list(box_walls(5.0, 4.0, 2.6).values())), block([-0.2, -0.2, -0.2], [5.2, 4.2, 2.8]))
    crate, core = block([3.5, 2.5, 0.01], [4.5, 3.5, 1.0]), block([3.6, 2.6, 0.1], [4.4, 3.4, 0.9])
    groups = [mesh.vertices[mesh.faces] for mesh in (inner, skin, crate, core)]
    triangles = np.concatenate(groups)
    free = find_free(triangles)
    assert free is not None
    assert ((free.way > 0.0) & (free.way < [5.0, 4.0, 2.6])).all()
    assert len(crossings(free.way[:1], free.way[1:], triangles)[0]) == 0
    assert free.enclosed == 1.0
    assert is_seen(free.stations, groups, triangles).tolist() == [True, False, True, False]


def test_the_side_of_a_boiler_half_a_metre_from_the_wall_is_seen() -> None:
    """An agent can stand in the gap; one on the far side of the wall, before the outer skin, is in no room."""
    room, boiler = joined(list(box_walls(9.0, 5.0, 3.0).values())), block([7.8, 3.4, 0.0], [8.5, 4.1, 1.5])
    skin = block([-0.3, -0.3, -0.3], [9.3, 5.3, 3.3])
    sides = boiler.vertices[boiler.faces]
    back = sides[(sides[:, :, 0] == 8.5).all(axis=1)]
    groups = [back, room.vertices[room.faces], skin.vertices[skin.faces]]
    triangles = np.concatenate([sides, *groups[1:]])
    free = find_free(triangles)
    assert free is not None
    assert is_seen(free.stations, groups, triangles).tolist() == [True, True, False]
