"""Straight motion and TUM files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from built_in_rooms.paths import smooth_path

from rislam_rt.errors import SceneError
from rislam_rt.model import Body
from rislam_rt.scene import load_scene
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.meshes import MeshReader, ply_bytes
from rislam_rt.scene.motion.agent_motion import straight_motion
from rislam_rt.scene.motion.recorded_poses import parse_tum
from rislam_rt.scene.shapes import block
from rislam_rt.scene.write import tum_bytes


def test_heading_of_straight_motion() -> None:
    for velocity, heading in (
        ([0.0, 0.1, 0.0], np.pi / 2),
        ([-0.1, -0.1, 0.0], -3 * np.pi / 4),
        ([0.0, 0.0, 0.1], 0.0),
    ):
        motion = straight_motion([1.0, 2.0, 3.0], velocity, 3, 0.5, Body())
        assert np.allclose(motion.heading, heading, rtol=0, atol=1e-15)
        assert np.allclose(motion.position[2], np.array([1.0, 2.0, 3.0]) + np.array(velocity))


def test_tum_reads_what_it_wrote() -> None:
    rng = np.random.default_rng(3)
    time, position = np.arange(50) * 0.1, rng.uniform(0.0, 5.0, (50, 3))
    heading = rng.uniform(-np.pi, np.pi, 50)
    again = parse_tum(tum_bytes(time, position, heading))
    for one, other in zip((time, position, heading), again, strict=True):
        assert np.allclose(one, other, rtol=0, atol=1e-8)  # nine digits
    with pytest.raises(Fault, match="line 1 of the trajectory"):
        parse_tum(b"\xff\xfe\x00")


def test_smooth_path_has_the_arc_length_asked_for() -> None:
    travelled = np.linspace(0.0, 5.0, 501)
    position, heading = smooth_path(np.array([[0.0, 0, 1], [2, 0.5, 1], [3, 2, 1], [2.5, 4, 1]]), travelled)
    chords = np.linalg.norm(np.diff(position, axis=0), axis=1)
    # A chord of 1 cm on a curve of radius 1 m and more is short by at most s^3 / 24 r^2 = 4e-8.
    assert np.allclose(chords, 0.01, rtol=0, atol=1e-6)
    course = np.diff(position, axis=0)
    assert np.abs(np.angle(np.exp(1j * (np.arctan2(course[:, 1], course[:, 0]) - heading[:-1])))).max() < 0.02
    with pytest.raises(ValueError, match="m long"):
        smooth_path(np.array([[0.0, 0, 1], [1, 0, 1]]), travelled)


@pytest.mark.parametrize(
    ("extra", "says"),
    [("cycles = 3", ""), ("cycles = 4", "4 cycles wanted, 3 poses"), ("cycle_s = 0.1", ""),
     ("start = [1.0, 1.0, 1.1]", "is not agent.start"), ("start = [1.0, 1.0, 1.0]", "")],
)  # fmt: skip
def test_section_beside_a_path_must_agree(damaged: Callable[[str, str], Path], extra: str, says: str) -> None:
    damaged("start = [0.5, 0.7, 0.5]\n", "")
    damaged("cycles = 600\ncycle_s = 0.1\n", "")
    room = damaged("velocity = [0.0707, 0.0707, 0.0]", f'trajectory = "path.tum"\n{extra}')
    (room / "path.tum").write_text("0 1 1 1 0 0 0 1\n0.1 1.01 1 1 0 0 0 1 # two\n\n0.2 1.02 1 1 0 0 0 1\n")
    if says:
        with pytest.raises(SceneError, match=says):
            load_scene(room)
    else:
        agent = load_scene(room).agent
        assert np.allclose(agent.velocity, [0.1, 0.0, 0.0])
        assert len(agent) == 3


def test_own_ply_reader_agrees_with_trimesh() -> None:
    """The same mesh in the layout read here and in one that only trimesh reads (ASCII, float32)."""
    import trimesh

    mesh = block([0.0, 0.5, 1.0], [2.0, 1.5, 3.0])
    ours = MeshReader().parse(ply_bytes(mesh.vertices, mesh.faces), "a.ply")
    other = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    for content in (other.export(file_type="ply"), other.export(file_type="ply", encoding="ascii")):
        theirs = MeshReader().parse(content, "a.ply")
        assert np.array_equal(ours.vertices, theirs.vertices)
        assert np.array_equal(ours.faces, theirs.faces)
    quads = b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    quads += (
        b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"
    )
    assert len(MeshReader().parse(quads, "a.ply").faces) == 2


@pytest.mark.parametrize("suffix", ["ply", "stl", "obj", "glb"])
def test_every_format_gives_the_same_triangles(suffix: str) -> None:
    import trimesh

    mesh = block([0.0, 0.5, 1.0], [2.0, 1.5, 3.0])
    content = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type=suffix)
    found = MeshReader().parse(content.encode() if isinstance(content, str) else content, f"a.{suffix}")
    assert np.array_equal(found.vertices[found.faces], mesh.vertices[mesh.faces])
