"""Scans: planes out of 5 mm of noise, holes filled and doors left open, clutter as shade."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from built_in_rooms.parts import box_walls

from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Scene
from rislam_rt.scene import load_scene
from rislam_rt.scene.importing import ImportOptions, import_room
from rislam_rt.scene.meshes import joined
from rislam_rt.scene.shapes import block

SIZE, NOISE = np.array([3.2, 2.6, 2.4]), 0.005
YAW = 0.35


def scanned(path: Path, *, door: bool, seed: int) -> Path:
    """A turned room with a crate, cut into 6 cm, with noise, a dozen holes, and a doorway in the eastern wall."""
    import trimesh

    crate = block([0.5, 1.4, 0.0], [1.3, 2.1, 0.8], without=("floor",))
    mesh = joined([*box_walls(*SIZE.tolist()).values(), crate])
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, 0.06)
    whole: Any = trimesh.Trimesh(vertices, faces)
    rng = np.random.default_rng(seed)
    center = whole.triangles_center
    keep = np.ones(len(center), dtype=bool)
    for spot in center[rng.integers(len(center), size=12)]:
        keep &= np.linalg.norm(center - spot, axis=1) > rng.uniform(0.08, 0.25)
    if door:
        x, y, z = center.T
        keep &= ~((x > SIZE[0] - 0.01) & (y > 0.8) & (y < 1.8) & (z < 2.0))
    whole.update_faces(keep)
    whole.vertices = (whole.vertices + rng.normal(0.0, NOISE, whole.vertices.shape)) @ rotation_z(np.array(YAW)).T
    whole.export(path)
    return path


def area(scene: Scene, name: str) -> float:
    a, b, c = next(r for r in scene.reflectors if r.name == name).triangles.swapaxes(0, 1)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


@pytest.mark.parametrize("door", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_walls_are_found_in_noise(tmp_path: Path, door: bool) -> None:
    remarks = import_room(scanned(tmp_path / "scan.ply", door=door, seed=4), tmp_path / "room", ImportOptions())
    scene = load_scene(tmp_path / "room")
    names = {r.name for r in scene.reflectors}
    assert {"floor", "ceiling", "wall_north", "wall_south", "wall_east", "wall_west"} <= names
    for name, axis, at in (("floor", 2, 0.0), ("ceiling", 2, 2.4), ("wall_east", 0, 3.2), ("wall_north", 1, 2.6)):
        vertices = next(r for r in scene.reflectors if r.name == name).vertices @ rotation_z(np.array(YAW))
        # 1500 points or more, thinned by the fit: 5 mm / sqrt(1500) = 0.13 mm in the mean, times lever arms to a corner
        assert np.abs(vertices[:, axis] - at).max() < 2e-3
    assert area(scene, "ceiling") == pytest.approx(3.2 * 2.6, rel=5e-3)  # corners within 5 mm or so
    assert area(scene, "wall_west") == pytest.approx(2.6 * 2.4, rel=5e-3)
    wall = 2.6 * 2.4 - (1.0 * 2.0 if door else 0.0)
    assert area(scene, "wall_east") == pytest.approx(wall, abs=0.25)  # a doorway's edges lie on cells of 10 cm
    noise = float(next(line for line in remarks if line.startswith("a scan")).split("lie ")[1].split()[0])
    assert noise == pytest.approx(5.0, rel=0.15)
    assert any("residual of the largest" in line for line in remarks)
    assert any("open" in line for line in remarks) == door


@pytest.mark.slow
def test_a_clean_mesh_is_no_scan_unless_it_is_said(tmp_path: Path) -> None:
    import trimesh

    mesh = joined(list(box_walls(*SIZE.tolist()).values()))
    trimesh.Trimesh(*trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, 0.1)).export(tmp_path / "clean.ply")
    clean = import_room(tmp_path / "clean.ply", tmp_path / "a", ImportOptions())
    said = import_room(tmp_path / "clean.ply", tmp_path / "b", ImportOptions(scan=True))
    assert [any(line.startswith("a scan") for line in lines) for lines in (clean, said)] == [False, True]
    a, b = (load_scene(tmp_path / name) for name in "ab")
    assert np.allclose(a.bounds, b.bounds, rtol=0, atol=1e-6)  # float32 in the file
    assert {r.name for r in a.reflectors} == {r.name for r in b.reflectors}
