"""Import of rooms from files of other programs: meshes, scans, floor plans."""

from rislam_rt.scene.importing.import_options import ImportOptions
from rislam_rt.scene.importing.import_room import import_corners, import_room

__all__ = ["ImportOptions", "import_corners", "import_room"]
