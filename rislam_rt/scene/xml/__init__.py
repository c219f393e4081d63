"""Scene files of Mitsuba 3 and Sionna RT (XML), both ways: reading, making a scene of them, writing."""

from rislam_rt.scene.xml.read_scene import read_xml, sionna_scenes
from rislam_rt.scene.xml.scene_from_xml import new_from_xml, scene_of_xml
from rislam_rt.scene.xml.write import write_xml

__all__ = ["new_from_xml", "read_xml", "scene_of_xml", "sionna_scenes", "write_xml"]
