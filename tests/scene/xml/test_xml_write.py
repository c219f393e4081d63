"""A room as a Sionna scene file, and back: the same, or as it was changed there."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.errors import ConfigError, SceneError
from rislam_rt.model import Material
from rislam_rt.scene import check_scene, load_scene
from rislam_rt.scene.xml import new_from_xml, read_xml, write_xml
from rislam_rt.shipped import shipped_rooms


def same(a, b) -> bool:
    """Whether two rooms are one, but for their names."""
    meshes = all(
        np.array_equal(x.vertices, y.vertices) and np.array_equal(x.faces, y.faces)
        for x, y in zip((*a.reflectors, *a.occluders), (*b.reflectors, *b.occluders), strict=True)
    )
    walls = [(r.name, r.material) for r in a.reflectors] == [(r.name, r.material) for r in b.reflectors]
    agent = np.abs(a.agent.tx - b.agent.tx).max() < 1e-8 and np.array_equal(
        a.agent.time, b.agent.time
    )  # TUM: nine digits
    landmarks = a.landmarks == b.landmarks and np.array_equal(a.landmark_positions, b.landmark_positions)
    return meshes and walls and agent and landmarks


@pytest.mark.parametrize("name", sorted(shipped_rooms().keys() - {"large_hall"}))
def test_there_and_back_is_the_same_room(tmp_path, name):
    room = load_scene(name)
    write_xml(room, tmp_path / "out")
    notes = new_from_xml(str(tmp_path / "out" / "scene.xml"), tmp_path / "back")
    assert same(load_scene(tmp_path / "back"), room)
    assert any("scene.toml beside it" in note for note in notes)


def test_without_the_scene_file_a_constant_r_is_the_nearest_slab(tmp_path):
    room = load_scene("paper_room")
    notes = write_xml(room, tmp_path / "out")
    assert "the constant R of floor, ceiling" in notes[0]
    (tmp_path / "out" / "scene.toml").unlink()
    part = read_xml(tmp_path / "out" / "scene.xml").parts[0]
    index = np.sqrt(part.material.permittivity)
    assert (index - 1.0) / (index + 1.0) == pytest.approx(0.85, rel=1e-12)
    assert part.material.thickness == 10.0


def test_what_is_changed_in_the_xml_file_counts(tmp_path):
    write_xml(load_scene("paper_room"), tmp_path / "out")
    file = tmp_path / "out" / "scene.xml"
    text = file.read_text().replace('<ref id="constant-0"', '<ref id="itu_wood"', 1)
    file.write_text(text.replace("<shape", '<bsdf type="diffuse" id="itu_wood" /><shape', 1))
    new_from_xml(str(file), tmp_path / "back")
    back = load_scene(tmp_path / "back")
    assert back.reflectors[0].material == Material(itu="wood", thickness=0.1)
    assert back.reflectors[1].material == Material(reflection=0.85)


def test_own_materials_and_shades_come_back(tmp_path):
    room = load_scene("shaded_room")
    own = Material(permittivity=4.5, conductivity=0.05, thickness=0.07, scattering=0.25)
    shade = replace(room.scatterers[0].shade, name="screen")
    changed = replace(room.reflectors[0], material=own)
    write_xml(replace(room, reflectors=(changed, *room.reflectors[1:]), occluders=(shade,)), tmp_path / "out")
    (tmp_path / "out" / "scene.toml").unlink()
    parts = {part.name: part.material for part in read_xml(tmp_path / "out" / "scene.xml").parts}
    assert parts[changed.name] == own
    assert parts["screen"] is None


def test_a_scene_of_sionna_passes_its_check_and_gets_a_way(tmp_path):
    notes = new_from_xml("sionna:simple_street_canyon", tmp_path / "canyon", carrier_ghz=28.0)
    assert [n for n in notes if "proposed way" in n]
    findings = check_scene(tmp_path / "canyon")
    assert not [f for f in findings if f.severity == "error"]
    room = load_scene(tmp_path / "canyon")
    assert [panel.spec.spacing.tolist() for panel in room.panels] == [[0.00535, 0.00535]]  # half a wavelength
    agent = room.agent
    assert (np.abs(agent.position[:, 1]) < 12.0).all(), "in the street, not behind the houses or on a roof"
    assert (agent.position[:, 2] < 2.0).all()


def test_failures_leave_nothing_behind(tmp_path):
    with pytest.raises(SceneError, match=r"no scene 'nosuch'; give one of box"):
        new_from_xml("sionna:nosuch", tmp_path / "a")
    with pytest.raises(SceneError, match="no free place for the agent"):
        new_from_xml("sionna:simple_reflector", tmp_path / "a")
    with pytest.raises(ConfigError, match=r"--within: .* give x0,y0,x1,y1"):
        new_from_xml("sionna:box", tmp_path / "a", within=[0.0, 1.0])
    with pytest.raises(SceneError, match="no shape within the window"):
        new_from_xml("sionna:box", tmp_path / "a", within=[50.0, 50.0, 60.0, 60.0])
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(SceneError, match=r"does not exist yet$"):
        write_xml(load_scene("empty_box"), tmp_path)
