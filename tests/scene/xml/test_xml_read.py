"""Scene files of Mitsuba and Sionna RT: shapes where their transforms put them, materials, and nothing that harms."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import SceneError
from rislam_rt.model import Material
from rislam_rt.scene.meshes import Mesh, ply_bytes
from rislam_rt.scene.xml import read_xml, sionna_scenes
from rislam_rt.scene.xml.shapes import clip_mesh

CONCRETE = '<bsdf type="itu-radio-material" id="c"><string name="type" value="concrete"/></bsdf>'
SQUARE = '<shape type="rectangle" id="mesh-s"><ref id="c"/>{}</shape>'


def scene(tmp_path: Path, body: str, head: str = "") -> Path:
    """A scene file with one concrete material."""
    file = tmp_path / "scene.xml"
    file.write_text(f"{head}<scene version='2.1.0'>{CONCRETE}{body}</scene>")
    return file


def moved(parts: str) -> str:
    return SQUARE.format(f'<transform name="to_world">{parts}</transform>')


def refusal(file: Path) -> str:
    with pytest.raises(SceneError) as caught:
        read_xml(file)
    text = str(caught.value)
    assert text.startswith(str(file))
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("parts", "corner"),
    [
        ("", [1.0, 1.0, 0.0]),
        ('<translate x="3" z="-1"/>', [4.0, 1.0, -1.0]),
        ('<scale value="2"/><translate value="0, 0, 5"/>', [2.0, 2.0, 5.0]),
        ('<translate value="0 0 5"/><scale x="2" y="3"/>', [2.0, 3.0, 5.0]),
        ('<rotate x="1" angle="90"/>', [1.0, 0.0, 1.0]),
        ('<rotate value="0, 0, 2" angle="180"/><translate y="4"/>', [-1.0, 3.0, 0.0]),
        ('<matrix value="0 0 1 7  1 0 0 0  0 1 0 0  0 0 0 1"/>', [7.0, 1.0, 1.0]),
        ('<matrix value="2 0 0  0 1 0  0 0 1"/>', [2.0, 1.0, 0.0]),
    ],
)
def test_a_shape_lies_where_its_transform_puts_it(tmp_path, parts, corner):
    """The corner (1, 1, 0) of the unit rectangle, by hand; parts act in the order of the file."""
    part = read_xml(scene(tmp_path, moved(parts))).parts[0]
    assert np.isclose(part.mesh.vertices, corner, atol=1e-12).all(axis=1).any()
    assert part.name == "s"
    assert part.material == Material(itu="concrete", thickness=0.1)


def test_a_cube_is_closed_and_turned_outwards(tmp_path):
    body = '<shape type="cube"><ref id="c"/><transform name="to_world"><scale value="1,2,3"/></transform></shape>'
    mesh = read_xml(scene(tmp_path, body)).parts[0].mesh
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert np.vecdot(a, np.cross(b, c)).sum() / 6.0 == pytest.approx(8 * 6.0)


def test_ply_and_obj_files_beside_it(tmp_path):
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.25]])
    (tmp_path / "a.ply").write_bytes(ply_bytes(corners, np.array([[0, 1, 2]])))
    (tmp_path / "b.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0.25\nf 1 2 3\n")
    one = '<shape type="{0}" id="{1}"><string name="filename" value="{1}.{0}"/><ref id="c"/></shape>'
    parts = read_xml(scene(tmp_path, one.format("ply", "a") + one.format("obj", "b"))).parts
    for part in parts:
        np.testing.assert_array_equal(part.mesh.vertices[part.mesh.faces[0]], corners)
    assert [part.name for part in parts] == ["a", "b"]


@pytest.mark.parametrize(
    ("bsdf", "material"),
    [
        ('<bsdf type="diffuse" id="mat-itu_wood"/>', Material(itu="wood", thickness=0.1)),
        (
            '<bsdf type="x" id="itu_glass"><float name="thickness" value="0.01"/></bsdf>',
            Material(itu="glass", thickness=0.01),
        ),
        (
            '<bsdf type="itu-radio-material" id="m"><string name="type" value="brick"/>'
            '<float name="scattering_coefficient" value="0.3"/></bsdf>',
            Material(itu="brick", thickness=0.1, scattering=0.3),
        ),
        (
            '<bsdf type="radio-material" id="m"><float name="relative_permittivity" value="4.5"/>'
            '<float name="conductivity" value="0.05"/><float name="thickness" value="$t"/></bsdf>',
            Material(permittivity=4.5, conductivity=0.05, thickness=0.25),
        ),
        ('<bsdf type="absorber-radio-material" id="m"/>', None),
        ('<bsdf type="radio-material" id="m"/>', None),
    ],
)
def test_materials_are_read_as_sionna_reads_them(tmp_path, bsdf, material):
    body = f'<default name="t" value="0.25"/><shape type="rectangle">{bsdf}</shape>'
    assert read_xml(scene(tmp_path, body)).parts[0].material == material


def test_what_is_for_cameras_is_passed_over_and_names_are_told_apart(tmp_path):
    odd = '<shape type="merge">' + 2 * '<shape type="rectangle" id="mesh-a b/c"><ref id="d"/></shape>' + "</shape>"
    body = '<sensor type="perspective"><film/></sensor><emitter/><integrator/><alias id="c" as="d"/>' + odd
    assert [part.name for part in read_xml(scene(tmp_path, body)).parts] == ["a_b_c", "a_b_c_2"]


@pytest.mark.parametrize(
    ("body", "head", "words"),
    [
        ("", '<!DOCTYPE scene [<!ENTITY a "aaaa">]>', "document type"),
        ("&a;", '<!DOCTYPE scene [<!ENTITY a SYSTEM "file:///etc/passwd">]>', "document type"),
        ('<include filename="other.xml"/>', "", "other files are not followed"),
        (
            '<shape type="ply"><string name="filename" value="/etc/passwd.ply"/></shape>',
            "",
            "inside the scene's folder",
        ),
        ('<shape type="ply"><string name="filename" value="../a.ply"/></shape>', "", "inside the scene's folder"),
        ('<shape type="ply"><string name="filename" value="a.stl"/></shape>', "", "give a .ply file"),
        ('<shape type="ply"/>', "", "0 strings called 'filename'"),
        ('<shape type="sphere" id="ball"/>', "", "shape 'ball': a shape of type 'sphere'"),
        ('<shape type="rectangle"/>', "", "it has no material"),
        ('<shape type="rectangle"><ref id="x"/></shape>', "", "'x', which the file does not define"),
        ('<shape type="rectangle"><bsdf type="diffuse" id="Wall"/></shape>', "", "call it itu_concrete"),
        ('<shape type="rectangle"><bsdf type="x" id="itu_tin"/></shape>', "", "an ITU material 'tin'"),
        (moved('<scale value="0"/>'), "", "makes everything flat"),
        (moved('<scale value="1 2"/>'), "", "one number or three"),
        (moved('<translate x="nan"/>'), "", "give a finite number"),
        (moved('<translate x="1e9"/>'), "", "beyond 100 km"),
        (moved('<rotate angle="9"/>'), "", "without an axis"),
        (moved('<matrix value="1 2 3"/>'), "", "<matrix> of 3 numbers"),
        (moved('<lookat origin="0,0,0"/>'), "", "<lookat> in to_world"),
        ("<volume/>", "", "an element <volume>"),
        ("", "", "no shape in it"),
        ("<shape", "", "not XML"),
        (60 * "<a>" + 60 * "</a>", "", "within each other"),
    ],
)
def test_what_cannot_be_used_is_one_line(tmp_path, body, head, words):
    assert words in refusal(scene(tmp_path, body, head))


def test_a_link_that_leads_out_of_the_folder_is_not_followed(tmp_path):
    (tmp_path / "out.ply").write_bytes(ply_bytes(np.eye(3), np.array([[0, 1, 2]])))
    inside = tmp_path / "in"
    inside.mkdir()
    (inside / "a.ply").symlink_to(tmp_path / "out.ply")
    file = scene(inside, '<shape type="ply"><string name="filename" value="a.ply"/><ref id="c"/></shape>')
    assert "by a link" in refusal(file)


def test_too_many_faces_name_the_way_out(tmp_path):
    with pytest.raises(SceneError, match=r"more than 3 faces in the first 2 of 2 shapes; take a part: --within"):
        read_xml(scene(tmp_path, 2 * SQUARE.format("")), max_faces=3)


def test_a_window_keeps_what_lies_in_it():
    """The area of a slanted square that is cut on two sides, and of one that is not touched."""
    square = Mesh(np.array([[0.0, 0, 0], [4, 0, 4], [4, 4, 4], [0, 4, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))

    def area(mesh):
        a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=-1).sum()

    cut = clip_mesh(square, np.array([[1.0, -1.0], [3.0, 2.5]]))
    assert area(cut) == pytest.approx(2.0 * 2.5 * np.sqrt(2.0))
    np.testing.assert_allclose(cut.vertices[cut.faces][..., 0], cut.vertices[cut.faces][..., 2])
    assert area(clip_mesh(square, np.array([[-1.0, -1.0], [5.0, 5.0]]))) == pytest.approx(area(square))
    assert len(clip_mesh(square, np.array([[5.0, 5.0], [6.0, 6.0]])).faces) == 0


def test_sionnas_own_scenes_are_found_by_name():
    there = sionna_scenes()
    assert {"box", "simple_street_canyon", "munich"} <= there.keys()
    canyon = read_xml(there["simple_street_canyon"])
    assert {part.name: part.material.itu for part in canyon.parts} == {
        "building_1": "glass", "building_6": "wood", "building_5": "glass", "building_4": "marble",
        "building_3": "marble", "building_2": "brick", "floor": "concrete",
    }  # fmt: skip
    assert sum(len(part.mesh.faces) for part in canyon.parts) == 74
    assert read_xml(there["box"]).parts[0].material == Material(itu="metal", thickness=1.0)
