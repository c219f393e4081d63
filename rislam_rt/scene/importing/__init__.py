"""Import of rooms from files of other programs: meshes, scans, floor plans."""

from rislam_rt.scene.importing.new_room import import_corners, import_room
from rislam_rt.scene.importing.options import ImportOptions

__all__ = ["ImportOptions", "import_corners", "import_room"]
