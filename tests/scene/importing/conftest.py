"""Files of other programs, made small: a room of 5 x 4 x 2.6 m with a table, a column and a cabinet."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from built_in_rooms.parts import box_walls

from rislam_rt.scene.meshes import joined
from rislam_rt.scene.shapes import block

SIZE = (5.0, 4.0, 2.6)
Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def solids() -> dict[str, Any]:
    """Parts of the room, z up, in metres."""
    import trimesh

    def solid(mesh: Any) -> Any:
        return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)

    column = trimesh.creation.cylinder(radius=0.2, height=2.6, sections=40)
    column.apply_translation((4.2, 3.1, 1.3))
    return {
        "shell": solid(joined(list(box_walls(*SIZE).values()))),
        "table": solid(block([1.5, 2.6, 0.70], [2.7, 3.3, 0.74])),
        "cabinet": solid(block([0.0, 1.0, 0.0], [0.4, 2.0, 1.8])),
        "column": column,
    }


@pytest.fixture
def mesh_file(tmp_path: Path) -> Callable[..., Path]:
    """Write the room as one mesh: suffix, unit [m], axis that points up."""

    def write(suffix: str, unit: float = 1.0, up: str = "z") -> Path:
        import trimesh

        whole: Any = trimesh.util.concatenate(list(solids().values())).subdivide()
        if up == "y":
            whole.apply_transform(Y_UP)
        whole.apply_scale(1.0 / unit)
        path = tmp_path / f"drawing{suffix}"
        if suffix == ".gltf":
            for name, content in trimesh.Scene({"room": whole}).export(file_type="gltf").items():
                (tmp_path / name.replace("model.gltf", "drawing.gltf")).write_bytes(content)
        else:
            whole.export(path)
        return path

    return write


@pytest.fixture
def node_file(tmp_path: Path) -> Path:
    """Named nodes with named materials, as a GLB file."""
    import trimesh

    scene: Any = trimesh.Scene()
    materials = {"shell": "Plaster.001", "table": "Oak", "cabinet": "brushed steel", "column": "Material.004"}
    nodes = {"shell": "Room", "table": "Meeting Table", "cabinet": "Locker", "column": "Cylinder.003"}
    for name, mesh in solids().items():
        mesh.apply_transform(Y_UP)
        mesh.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(name=materials[name], baseColorFactor=[9, 9, len(name), 255])
        )
        scene.add_geometry(mesh, node_name=nodes[name], geom_name=name)
    path = tmp_path / "nodes.glb"
    path.write_bytes(scene.export(file_type="glb"))
    return path
