"""Rooms whose floor rises, lecture halls and ramps: what is above the raised part is kept, what is lost is named."""

from pathlib import Path

import numpy as np
import pytest
from built_in_rooms.parts import box_walls

from rislam_rt.model import Scene
from rislam_rt.scene import load_scene
from rislam_rt.scene.importing import ImportOptions, import_room
from rislam_rt.scene.importing.free_space import find_free
from rislam_rt.scene.meshes import Mesh, joined
from rislam_rt.scene.polygons import outline_loops
from rislam_rt.scene.shapes import block, quad

HALL = (12.0, 8.0, 6.0)


def imported(tmp_path: Path, parts: list[Mesh], *, mirrored: bool) -> tuple[Scene, list[str]]:
    """Import a hall with what is in it as one mesh; mirrored, the floor rises to the west."""
    import trimesh

    whole = joined([*box_walls(*HALL).values(), *parts])
    points = whole.vertices * [-1.0, 1.0, 1.0] + [HALL[0], 0.0, 0.0] if mirrored else whole.vertices
    file = tmp_path / "hall.ply"
    trimesh.Trimesh(points, whole.faces, process=False).export(file)
    remarks = import_room(file, tmp_path / "room", ImportOptions())
    return load_scene(tmp_path / "room"), remarks


def area_at(scene: Scene, axis: int, value: float) -> float:
    """Area [m^2] of the scene's reflecting triangles that lie in a plane across an axis."""
    corners = np.concatenate([r.vertices[r.faces] for r in scene.reflectors])
    flat = corners[(np.abs(corners[..., axis] - value) < 1e-3).all(axis=1)]
    return 0.5 * float(np.linalg.norm(np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]), axis=1).sum())


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_hollow_beneath_a_ramp_is_not_the_room(tmp_path: Path, mirrored: bool) -> None:
    ramp = quad([[4.0, 0.0, 0.0], [12.0, 0.0, 3.0], [12.0, 8.0, 3.0], [4.0, 8.0, 0.0]])
    scene, remarks = imported(tmp_path, [ramp], mirrored=mirrored)
    assert area_at(scene, 2, 6.0) == pytest.approx(96.0)
    assert not any("nobody inside" in remark for remark in remarks)
    start = scene.agent.position[0]
    along = start[0] if not mirrored else 12.0 - start[0]
    assert start[2] > 3.0 / 8.0 * (along - 4.0)


@pytest.mark.parametrize("mirrored", [False, True])
def test_every_step_of_a_hall_of_boxes_is_kept(tmp_path: Path, mirrored: bool) -> None:
    """The boxes' undersides lie on the floor and share edges with it: the floor stays whole."""
    tiers = [block([4.0 + 2.0 * k, 0.0, 0.0], [6.0 + 2.0 * k, 8.0, 0.6 * (k + 1)]) for k in range(4)]
    scene, _ = imported(tmp_path, tiers, mirrored=mirrored)
    for k in range(4):
        assert area_at(scene, 2, 0.6 * (k + 1)) == pytest.approx(16.0)
    assert area_at(scene, 2, 0.0) >= 96.0
    assert area_at(scene, 0, 8.0 if mirrored else 4.0) == pytest.approx(4.8)  # the lowest riser


def steps_and_benches() -> list[Mesh]:
    """Eight steps of 0.4 m, drawn as surfaces, with a bench on each, whose back is to those who sit higher."""
    tops = [[[4.0 + k, 0.0], [5.0 + k, 0.0], [5.0 + k, 8.0], [4.0 + k, 8.0]] for k in range(8)]
    steps = [quad(np.array([[*c, 0.4 * (k + 1)] for c in top])) for k, top in enumerate(tops)]
    risers = [
        quad([[4.0 + k, 0.0, 0.4 * k], [4.0 + k, 8.0, 0.4 * k], [4.0 + k, 8.0, 0.4 * (k + 1)],
              [4.0 + k, 0.0, 0.4 * (k + 1)]])
        for k in range(8)
    ]  # fmt: skip
    benches = [block([4.5 + k, 2.0, 0.4 * (k + 1)], [4.9 + k, 6.0, 0.4 * (k + 1) + 0.75]) for k in range(8)]
    return [*steps, *risers, *benches]


def test_what_is_seen_only_from_a_raised_floor_is_kept_and_the_rest_is_named(tmp_path: Path) -> None:
    scene, remarks = imported(tmp_path, steps_and_benches(), mirrored=False)
    backs = [area_at(scene, 0, 4.9 + k) for k in range(8)]
    assert backs[:7] == pytest.approx([3.0] * 7)
    # the last bench stands a crack of 10 cm before the wall
    assert sum("nobody inside can see: hanging" in remark for remark in remarks) == (backs[7] == 0.0)


def test_walls_without_floor_and_ceiling_enclose_a_free_way() -> None:
    walls = joined([mesh for name, mesh in box_walls(*HALL).items() if name.startswith("wall")])
    free = find_free(walls.vertices[walls.faces])
    assert free is not None
    assert ((free.way > 0.0) & (free.way < HALL)).all()


def test_clutter_at_the_height_of_a_step_is_kept(tmp_path: Path) -> None:
    """A slat of 6 cm, too narrow to reflect, floats where the plane of a step would go on."""
    step = block([8.0, 0.0, 0.0], [12.0, 8.0, 0.8])
    slat = quad([[3.0, 2.0, 0.8], [3.06, 2.0, 0.8], [3.06, 6.0, 0.8], [3.0, 6.0, 0.8]])
    scene, _ = imported(tmp_path, [step, slat], mirrored=False)
    assert [np.ptp(shade.vertices[:, 1]) for shade in scene.occluders] == pytest.approx([4.0], abs=0.1)


def test_sheets_that_share_an_edge_have_each_its_outline() -> None:
    """Corners 0 to 3 of a square, 4 and 5 halfway along two sides: a sheet on its right half."""
    square, half = [[0, 1, 2], [0, 2, 3]], [[4, 1, 2], [4, 2, 5]]
    loops = [sorted(loop) for loop in outline_loops(np.array(square + half))]
    assert sorted(loops) == [[0, 1, 2, 3], [1, 2, 4, 5]]
    assert len(outline_loops(np.array([[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]]))) == 1  # the same sheet twice
