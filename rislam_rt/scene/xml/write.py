"""Writing of a scene as a folder that Sionna RT opens: `scene.xml` beside the scene's own files."""

from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from rislam_rt.model import Material, Scene
from rislam_rt.scene.meshes import ply_bytes
from rislam_rt.scene.scene_folder import README, mesh_file
from rislam_rt.scene.write import scene_files, write_files
from rislam_rt.scene.xml.materials import material_element, material_word

XML_FILE = "scene.xml"
"""Name of the XML scene file in the folder that is written for Sionna RT."""
SHADE_OF = "shade-of-"
"""Prefix of the name of an XML shape that is a scatterer's occluder; the scatterer's name follows."""

_README = """# {name} for Sionna RT

```python
import sionna.rt
scene = sionna.rt.load_scene("scene.xml", merge_shapes=False)
scene.frequency = 10e9
```

`merge_shapes=False` keeps each wall an object of its own. `scene.toml` beside it is the whole room for rislam_rt, which
also holds what Sionna's file format has no place for:

{notes}

`rislam-rt new ROOM --from scene.xml` brings it back, with what was changed in the XML file.
"""


def write_xml(scene: Scene, folder: str | Path) -> list[str]:
    """Write a scene as a new folder, `scene.xml` with meshes for Sionna's `load_scene`; returns what it cannot carry.

    Raises
    ------
    SceneError
        The folder exists.
    StoreError
        The disk refused.
    """
    notes = left_behind(scene)
    readme = _README.format(name=scene.name, notes="\n".join(f"- {note}" for note in notes) or "- nothing")
    files = scene_files(scene)
    shades = [(SHADE_OF + s.name, s.shade) for s in scene.scatterers if s.shade is not None]
    files |= {mesh_file(name): ply_bytes(shade.vertices, shade.faces) for name, shade in shades}
    write_files(files | {XML_FILE: xml_bytes(scene), README: readme.encode()}, folder)
    return notes


def xml_bytes(scene: Scene) -> bytes:
    """Content of a scene's XML file for Sionna: a `<shape>` a reflector or occluder, a `<bsdf>` a material."""
    root = Element("scene", {"version": "2.1.0"})
    shapes: list[tuple[str, Material | None]] = [(r.name, r.material) for r in scene.reflectors]
    shapes += [(shade.name, None) for shade in scene.occluders]
    shapes += [(SHADE_OF + s.name, None) for s in scene.scatterers if s.shade is not None]
    materials = dict.fromkeys(material for _, material in shapes)
    names = {material: f"{material_word(material)}-{number}" for number, material in enumerate(materials)}
    root.extend(material_element(material, name) for material, name in names.items())
    for name, material in shapes:
        shape = SubElement(root, "shape", {"type": "ply", "id": f"mesh-{name}"})
        SubElement(shape, "string", {"name": "filename", "value": mesh_file(name)})
        SubElement(shape, "boolean", {"name": "face_normals", "value": "true"})
        SubElement(shape, "ref", {"id": names[material], "name": "bsdf"})
    indent(root, space="    ")
    return tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


def left_behind(scene: Scene) -> list[str]:
    """Remarks, one line each, on what a scene has that a Sionna scene file (XML) cannot hold."""
    constant = [r.name for r in scene.reflectors if r.material.level is not None]
    notes = []
    if constant:
        few = ", ".join(constant[:6]) + (f" and {len(constant) - 6} more" if len(constant) > 6 else "")
        body = "as a body with that |R| at normal incidence, and Fresnel's law elsewhere"
        notes.append(f"the constant R of {few}: {body}")
    if scene.scatterers:
        notes.append(f"{len(scene.scatterers)} scatterers (of shadows: a shape of air, which hides their centre too)")
    notes += [f"the panel '{panel.name}'" for panel in scene.panels]
    return [*notes, "the agent's motion, and Tx and Rx on it"]
