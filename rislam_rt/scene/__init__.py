"""Floor 3: scenes on disk. Read (TOML and meshes to `Scene`), build, import, check, write."""

from rislam_rt.scene.load import check_scene, load_scene
from rislam_rt.scene.write import new_scene, write_scene

__all__ = ["check_scene", "load_scene", "new_scene", "write_scene"]
