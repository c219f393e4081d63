"""Mesh files in other units, with another axis up, about another point: the same room."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.scene import load_scene
from rislam_rt.scene.meshes import MeshReader, ply_bytes


def rewrite(room: Path, unit: float, origin: list[float], up: str) -> None:
    """All meshes of a room as if drawn in another frame."""
    for file in (room / "meshes").glob("*.ply"):
        mesh = MeshReader().parse(file.read_bytes(), file.name)
        x, y, z = (mesh.vertices + origin).T / unit
        file.write_bytes(ply_bytes(np.stack([x, z, -y] if up == "y" else [x, y, z], axis=-1), mesh.faces))


@pytest.mark.parametrize(
    ("units", "unit", "up"), [("mm", 1e-3, "z"), ("cm", 1e-2, "y"), ("in", 0.0254, "y"), ("m", 1.0, "z")]
)
def test_one_table_for_all_meshes(room: Path, units: str, unit: float, up: str) -> None:
    before, origin = load_scene(room), [2.0, -1.0, 0.5]
    rewrite(room, unit, origin, up)
    text = (room / "scene.toml").read_text()
    (room / "scene.toml").write_text(text + f'\n[meshes]\nunits = "{units}"\nup = "{up}"\norigin = {origin}\n')
    for a, b in zip(before.reflectors, load_scene(room).reflectors, strict=True):
        assert np.abs(a.vertices - b.vertices).max() < 1e-12  # float64


def test_a_mesh_of_its_own_kind(damaged: Callable[[str, str], Path]) -> None:
    room = damaged('mesh = "meshes/floor.ply"', 'mesh = "meshes/floor.ply"\nunits = "cm"\norigin = [1.0, 0.0, 0.0]')
    scene = load_scene(room)
    assert scene.reflectors[0].vertices.max(axis=0) == pytest.approx([-0.94, 0.06, 0.0])
