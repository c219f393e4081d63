"""Scene files of Mitsuba 3 and Sionna RT (XML), both ways: `read_scene.py` reads meshes and materials,
`scene_from_xml.py` makes a scene of them, `write.py` writes one."""

from rislam_rt.scene.xml.read_scene import read_xml, sionna_scenes
from rislam_rt.scene.xml.scene_from_xml import new_from_xml, scene_of_xml
from rislam_rt.scene.xml.write import write_xml

__all__ = ["new_from_xml", "read_xml", "scene_of_xml", "sionna_scenes", "write_xml"]
