"""Names in any script, and the plain files that are made of them; inputs that are valid although they look odd."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError, SceneError
from rislam_rt.model import RisCode, RisSpec
from rislam_rt.scene import load_scene, write_scene
from rislam_rt.scene.meshes import MeshReader
from rislam_rt.scene.scene_folder import safe_name
from rislam_rt.slam.input_checks import check_step

ROOM = Path(__file__).parents[2] / "scenes" / "paper_room"
SQUARE = "v 0 0 0\nv 6 0 0\nv 6 6 0\nv 0 6 0\nf 1 2 3\nf 1 3 4\n"


def test_names_of_any_script_go_through_files(tmp_path):
    room = Path(shutil.copytree(ROOM, tmp_path / "room"))
    text = (room / "scene.toml").read_text()
    for old, new in (("wall_x0", "Wände"), ("sphere", "κύλινδρος"), ("ceiling", "天井")):
        text = text.replace(f'"{old}"', f'"{new}"')
    (room / "scene.toml").write_text(text)
    again = load_scene(write_scene(load_scene(room), tmp_path / "again"))
    assert {"Wände", "天井"} <= {r.name for r in again.reflectors}
    assert again.landmarks[0] == "κύλινδρος"
    assert again.ris.host == "天井"
    files = [path.name for path in (tmp_path / "again").rglob("*")]
    assert all(name.isascii() for name in files)


def test_file_names_are_plain_and_tell_names_apart():
    names = ["wall_x0", "a.b-c", "Wände", "Wande", "天井", "床", "..", ".hidden", "-x", "a."]
    plain = [safe_name(name) for name in names]
    assert plain[:2] == names[:2]
    assert len(set(plain)) == len(names)
    assert all(name.isascii() and name[0] not in ".-" and name[-1] != "." for name in plain)


@pytest.mark.parametrize("comment", ["# W\u00e4nde\n", "# \u00ff\u00fe\n"])
def test_obj_comments_may_be_in_latin_1(comment):
    assert len(MeshReader().parse((comment + SQUARE).encode("latin-1"), "a.obj").faces) == 2


def test_ply_comments_reach_for_no_texture(capfd):
    content = (ROOM / "meshes" / "floor.ply").read_bytes()
    told = content.replace(b"1.0\n", b"1.0\ncomment TextureFile none.png\ncomment anything\n", 1)
    ascii_file = (
        b"ply\nformat ascii 1.0\ncomment TextureFile none.png\nelement vertex 3\nproperty float x\nproperty float y\n"
        b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    np.testing.assert_array_equal(
        MeshReader().parse(told, "a.ply").vertices, MeshReader().parse(content, "a.ply").vertices
    )
    assert len(MeshReader().parse(ascii_file, "a.ply").faces) == 1
    assert capfd.readouterr() == ("", "")


def test_a_sphere_too_large_for_its_series_is_told():
    from rislam_rt.channel.cross_section import MAX_SIZE, mie_amplitudes

    with pytest.raises(SceneError, match="leave 'mie' out"):
        mie_amplitudes(1.01 * MAX_SIZE, np.array(-1.0))


@pytest.mark.parametrize(
    ("dt", "heading", "shape", "levels"),
    [
        (np.nan, 0.0, (2, 3), 4),
        (-0.1, 0.0, (2, 3), 4),
        (1e7, 0.0, (2, 3), 4),
        (0.1, np.nan, (2, 3), 4),
        (0.1, np.inf, (2, 3), 4),
        (0.1, 0.0, (3, 2), 4),
        (0.1, 0.0, (5, 2, 3), 4),
        (0.1, 0.0, (2, 3), 8),
    ],
)
def test_a_step_takes_no_nonsense(dt, heading, shape, levels):
    panel = RisSpec(2, 3, np.array([0.01, 0.01]), np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]))
    check_step(0.1, 0.0, RisCode(np.zeros((2, 3), dtype=int), 4), panel)
    with pytest.raises(ConfigError, match="received"):
        check_step(dt, heading, RisCode(np.zeros(shape, dtype=int), levels), panel)
