"""Polygons of mesh files: each covers what is drawn, in OBJ and PLY, in a scene and in an import."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rislam_rt.arrays import Floats
from rislam_rt.geometry.triangles import triangle_cross
from rislam_rt.scene import obj_polygons
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.importing.mesh_source import read_source
from rislam_rt.scene.mesh_polygons import MOST_CORNERS, SLIVER, PolygonFault, polygon_triangles
from rislam_rt.scene.meshes import MeshReader

DOORWAY = [(0, 0), (1, 0), (1, 2.1), (2, 2.1), (2, 0), (4, 0), (4, 2.8), (0, 2.8)]
L_FLOOR = [(8, 0), (8, 4), (4, 4), (4, 7), (0, 7), (0, 0)]
COLLINEAR = [(0, 0), (2, 0), (4, 0), (4, 3), (0, 3)]
DART = [(0, 0), (4, 0), (1, 1), (0, 4)]
SHAPES = {"doorway": (DOORWAY, 9.1), "L": (L_FLOOR, 44.0), "collinear": (COLLINEAR, 12.0), "dart": (DART, 4.0)}
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def obj(points: Floats, *faces: Sequence[int]) -> bytes:
    corners = "".join(f"v {x:.7g} {y:.7g} {z:.7g}\n" for x, y, z in points)
    return (corners + "".join("f " + " ".join(str(i + 1) for i in face) + "\n" for face in faces)).encode()


def ply(points: Floats, *faces: Sequence[int], binary: bool = False) -> bytes:
    kind = "binary_little_endian" if binary else "ascii"
    head = (
        f"ply\nformat {kind} 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    if binary:
        rows = b"".join(bytes([len(face)]) + np.array(face, "<i4").tobytes() for face in faces)
        return head.encode() + points.astype("<f4").tobytes() + rows
    lines = [" ".join(f"{x:.7g}" for x in point) for point in points]
    lines += [" ".join(str(i) for i in (len(face), *face)) for face in faces]
    return "\n".join([head.rstrip(), *lines, ""]).encode()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("turned", [False, True])
def test_a_polygon_covers_what_is_drawn_from_every_first_corner(shape: str, turned: bool, tmp_path: Path) -> None:
    """Area and side of the face, upright and tilted, the same triangles from OBJ, PLY and an import."""
    flat, area = SHAPES[shape]
    for first in range(len(flat)):
        for tilt in (np.zeros(3), np.array([0.3, 0.5, 1.1])):
            points = np.insert(np.array(flat[first:] + flat[:first], dtype=float), 2, 1.0, axis=1)
            points = Rotation.from_rotvec(tilt).apply(points[::-1] if turned else points)
            face = range(len(points))
            (tmp_path / "a.obj").write_bytes(obj(points, face))
            meshes = [
                MeshReader().parse(obj(points, face), "a.obj").triangles,
                MeshReader().parse(ply(points, face), "a.ply").triangles,
                MeshReader().parse(ply(points, face, binary=True), "a.ply").triangles,
                read_source(tmp_path / "a.obj")[0][0].triangles,
            ]
            normal = Rotation.from_rotvec(tilt).apply([0.0, 0.0, -1.0 if turned else 1.0])
            for triangles in meshes:
                crosses = triangle_cross(triangles)
                assert np.linalg.norm(crosses, axis=1).sum() / 2 == pytest.approx(area, rel=1e-5)
                assert (crosses @ normal).sum() / 2 == pytest.approx(area, rel=1e-5)
                assert np.linalg.norm(crosses, axis=1).min() > SLIVER
                if not tilt.any():  # else the last digits of the file decide between triangles as good
                    assert _middles(triangles) == _middles(meshes[0])


def _middles(triangles: Floats) -> set[tuple[float, ...]]:
    return {tuple(middle) for middle in np.round(triangles.mean(axis=1), 4) + 0.0}


def test_convex_faces_are_as_they_were() -> None:
    """Of quads alone all first halves come before all second ones; among other faces the halves follow each other."""
    points = np.array([[x, y, 0.0] for x in range(3) for y in range(2)])
    mesh = MeshReader().parse(obj(points, (0, 2, 3, 1), (2, 4, 5, 3)), "a.obj")
    assert np.array_equal(mesh.vertices, points)
    assert mesh.faces.tolist() == [[0, 2, 3], [2, 4, 5], [3, 1, 0], [5, 3, 2]]
    assert MeshReader().parse(ply(points, (0, 2, 3, 1), (2, 4, 5, 3)), "a.ply").faces.tolist() == mesh.faces.tolist()
    mixed = MeshReader().parse(obj(points, (0, 2, 3, 1), (2, 4, 5)), "a.obj")
    assert mixed.faces.tolist() == [[0, 2, 3], [3, 1, 0], [2, 4, 5]]


@pytest.mark.parametrize("order", ["little", "big"])
def test_a_binary_ply_file_may_mix_triangles_quads_and_concave_faces(order: str) -> None:
    """As Blender writes it, normals beside the positions: trimesh reads faces of one size alone."""
    points = np.insert(np.array([*DOORWAY, (5, 0), (5, 2.8), (6, 0)], dtype=float), 2, 1.0, axis=1)
    faces = [range(8), (5, 8, 9, 6), (8, 10, 9)]
    end = "<" if order == "little" else ">"
    head = (
        f"ply\nformat binary_{order}_endian 1.0\ncomment by hand\nelement vertex {len(points)}\n"
        + "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
        + f"element face {len(faces)}\nproperty uchar flags\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    rows = b"".join(bytes([7, len(face)]) + np.array(face, f"{end}u4").tobytes() for face in faces)
    content = head.encode() + np.hstack([points, 0.0 * points]).astype(f"{end}f4").tobytes() + rows
    mesh = MeshReader().parse(content, "a.ply")
    crosses = triangle_cross(mesh.triangles)
    assert crosses[:, 2].sum() / 2 == pytest.approx(9.1 + 2.8 + 1.4, rel=1e-6)
    assert crosses[:, 2].min() > 0.0
    for cut in (1, 9, 40):
        with pytest.raises(Fault, match="not a readable PLY mesh"):
            MeshReader().parse(content[:-cut], "a.ply")
    wrong = content.replace(np.array([8, 10, 9], f"{end}u4").tobytes(), np.array([8, 10, 99], f"{end}u4").tobytes())
    with pytest.raises(Fault, match="a face names vertex 99 of 11"):
        MeshReader().parse(wrong, "a.ply")


PENTAGON = ((0, 0), (4, 0), (4, 3), (2, 4), (0, 3))


@pytest.mark.parametrize(
    ("faces", "area"),
    [
        (((0, 1, 2, 4), (0, 1, 2), (0, 1, 2, 3, 4)), 12.0 + 6.0 + 14.0),
        (((0, 1, 2), (0, 1), (0, 1, 2, 4)), 6.0 + 12.0),
        (((0, 1, 2, 4), (0, 1, 2, 4), (0, 1)), 24.0),
        (((0, 1, 2), (0, 1, 2), (3, 4)), 12.0),
        (((0, 1, 2), (), (0,)), 6.0),
        (((0, 1, 2, 4), (0, 1, 2, 4)), 24.0),
    ],
)
@pytest.mark.parametrize("normals", [False, True])
def test_faces_of_a_binary_ply_file_are_read_at_their_places(
    faces: tuple[tuple[int, ...], ...], area: float, normals: bool
) -> None:
    """Corners that add up to as many as if all faces had those of the first; and faces that are points and lines."""
    points = np.insert(np.array(PENTAGON, dtype=float), 2, 1.0, axis=1)
    content = ply(points, *faces, binary=True)
    if normals:
        rows = np.hstack([points, 0.0 * points]).astype("<f4").tobytes()
        more = b"".join(b"property float %s\n" % name for name in (b"nx", b"ny", b"nz"))
        content = content.replace(points.astype("<f4").tobytes(), rows).replace(b"element face", more + b"element face")
    crosses = triangle_cross(MeshReader().parse(content, "a.ply").triangles)
    assert crosses[:, 2].sum() / 2 == pytest.approx(area, rel=1e-6)
    assert crosses[:, 2].min() > 0.0


def test_only_a_binary_ply_file_is_to_be_written_as_text() -> None:
    points = np.insert(np.array(PENTAGON, dtype=float), 2, 1.0, axis=1)
    for binary in (False, True):
        content = ply(points, (0, 1, 2), (0, 1, 2, 3), binary=binary).replace(b"float x", b"float q")
        with pytest.raises(Fault, match="not a readable PLY mesh") as told:
            MeshReader().parse(content, "a.ply")
        assert ("as text (ASCII)" in str(told.value)) == binary
        assert "of triangles alone" in str(told.value)


def test_a_face_with_a_window_joined_by_a_bridge_keeps_the_window() -> None:
    outer, window = [(0, 0), (4, 0), (4, 3), (0, 3)], [(1, 1), (1, 2), (2, 2), (2, 1)]
    points = np.insert(np.array(outer + window, dtype=float), 2, 0.0, axis=1)
    ring = (0, 1, 2, 3, 0, 4, 5, 6, 7, 4)
    for content, name in ((obj(points, ring), "a.obj"), (ply(points, ring), "a.ply")):
        crosses = triangle_cross(MeshReader().parse(content, name).triangles)
        assert np.abs(crosses).sum() / 2 == pytest.approx(11.0)


def test_a_face_that_crosses_itself_is_named() -> None:
    points = np.array([[0.0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]])
    with pytest.raises(Fault, match="line 5: a face of 4 corners, the first at 0, 0, 0, crosses itself; cut it"):
        MeshReader().parse(obj(points, range(4)), "a.obj")
    with pytest.raises(Fault, match="face 0 of 4 corners, the first at 0, 0, 0, crosses itself; cut it"):
        MeshReader().parse(ply(points, range(4)), "a.ply")


@pytest.mark.parametrize("apart", [1e-3, 1e-4, 1e-6, 1e-8, 1e-10])
def test_corners_that_nearly_repeat_cross_nothing(apart: float) -> None:
    """Stars with a corner drawn twice, its edges crossed by as little: covered, in every order and direction."""
    rng = np.random.default_rng(7)
    for _ in range(30):
        count = int(rng.integers(4, 12))
        angle = 2.0 * np.pi * (np.arange(count) + 0.6 * rng.random(count)) / count
        star = rng.uniform(0.5, 2.0, count)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        area = 0.5 * abs(float((star[:, 0] * np.roll(star[:, 1], -1) - star[:, 1] * np.roll(star[:, 0], -1)).sum()))
        for at in sorted(rng.integers(0, count, 3), reverse=True):
            star = np.insert(star, at + 1, star[at] + apart * rng.uniform(-0.7, 0.7, 2), axis=0)
        points = np.insert(np.roll(star, rng.integers(0, count), axis=0)[:: rng.choice([-1, 1])], 2, 1.0, axis=1)
        cut = polygon_triangles(points, [range(len(points))])[0]
        assert np.linalg.norm(triangle_cross(points[cut]), axis=1).sum() / 2 == pytest.approx(
            area, abs=10.0 * apart + 1e-5
        )


def test_degenerate_and_warped_faces_are_read() -> None:
    """A corner drawn twice a millimetre apart, one to and fro, a bridge not quite closed, quads as deep as wide."""
    face = np.array([(0, 0, 0), (-0.001, 0.001, 0), (4, 0, 0), (4, 3, 0), (0, 3, 0)])
    assert np.linalg.norm(triangle_cross(face[polygon_triangles(face, [range(5)])[0]]), axis=1).sum() / 2 == (
        pytest.approx(12.0, abs=0.01)
    )
    corner = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)])
    assert polygon_triangles(corner, [(0, 1, 2, 1)])[0].tolist() == [[0, 1, 2], [0, 2, 3]]
    spike = np.array([(0.0, 0, 0), (4, 0, 0), (4, 3, 0), (6, 3.0005, 0), (4, 2.9995, 0), (0, 3, 0)])
    assert np.linalg.norm(triangle_cross(spike[polygon_triangles(spike, [range(6)])[0]]), axis=1).sum() / 2 == (
        pytest.approx(12.0, abs=0.01)
    )
    ring = [(0, 0), (4, 0), (4, 3), (0, 3), (0.0005, -0.0005), (1, 1), (1, 2), (2, 2), (2, 1), (0.9995, 1.0005)]
    window = np.insert(np.array(ring, dtype=float), 2, 0.0, axis=1)
    assert np.linalg.norm(triangle_cross(window[polygon_triangles(window, [range(10)])[0]]), axis=1).sum() / 2 == (
        pytest.approx(11.0, abs=0.02)
    )
    rng = np.random.default_rng(3)
    for count in (4, 8):
        angle = 2.0 * np.pi * np.arange(count) / count
        for _ in range(100):
            deep = np.column_stack([np.cos(angle), np.sin(angle), rng.uniform(-1.4, 1.4, count)])
            assert len(polygon_triangles(deep, [range(count)])[0]) > 0


def test_bow_ties_are_refused_down_to_the_margin() -> None:
    """However turned and a little warped; crossed by less than a thousandth of the size, they are covered."""
    rng = np.random.default_rng(5)
    tie = np.array([(0.0, 0, 0), (4, 3, 0), (4, 0, 0), (0, 3, 0)])
    for _ in range(50):
        points = Rotation.random(random_state=rng).apply(tie + rng.uniform(-0.05, 0.05, (4, 3)))
        with pytest.raises(PolygonFault, match="crosses itself"):
            polygon_triangles(points, [range(4)])
    for over, refused in ((0.02, True), (0.002, False)):
        points = np.array([(0, 0, 0), (4, 0, 0), (4, 3, 0), (2, -over, 0), (0, 3, 0)])
        if refused:
            with pytest.raises(PolygonFault, match="crosses itself"):
                polygon_triangles(points, [range(5)])
        else:
            assert len(polygon_triangles(points, [range(5)])[0]) > 0


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("f -4 -3 -2 -1", "f -4 -3 -2 -1"),
        (" f 1 2 3 4", "\tf 5 6 7 8"),
        ("f 1 2 3 4 # a wall", "f 5 6 7 8#"),
        ("f 1 2 \\\n3\\\n4", "f 5 6 7 \\\r\n 8"),
        ("f 1/1/1 2/1/1 3/1/1 4/1/1", "f 5/1/1 6/1/1 7/1/1 8/1/1"),
    ],
)
def test_every_way_to_write_an_obj_face_is_read(first: str, second: str) -> None:
    """Corners counted backwards are of those so far: a second square does not take the place of the first."""
    other = SQUARE.replace("v 1", "v 6").replace("v 0", "v 5")
    mesh = MeshReader().parse(f"vt 0 0\nvn 0 0 1\n{SQUARE}{first}\n{other}{second}\n".encode(), "a.obj")
    assert np.abs(triangle_cross(mesh.triangles)).sum() / 2 == pytest.approx(2.0)
    assert (mesh.vertices.min(), mesh.vertices.max()) == (0.0, 6.0)


@pytest.mark.parametrize(
    "faces", ["f 1 2 3 4\n{}", "{}f 1 2\nf 3\nf\nf 1 2 3 4\n", "f\nf 1\n{}f 1 2 3\nf 1 3 4\nf 2 2\n"]
)
def test_obj_faces_may_come_first_and_be_no_faces(faces: str, tmp_path: Path) -> None:
    """Corners counted from the first are of the whole file; of fewer than three corners a face is passed over."""
    content = faces.format(SQUARE).encode()
    (tmp_path / "a.obj").write_bytes(content)
    for triangles in (MeshReader().parse(content, "a.obj").triangles, read_source(tmp_path / "a.obj")[0][0].triangles):
        assert np.abs(triangle_cross(triangles)).sum() / 2 == pytest.approx(1.0)
    for wrong in ("f 1 2 3 5\n", "f -1 -2 -3 -5\n"):
        with pytest.raises(Fault, match=r"a face names corner -?5 of 4"):
            MeshReader().parse((SQUARE + wrong).encode(), "a.obj")


@pytest.mark.parametrize(
    "line",
    [
        "",
        "v 1 2",
        "v 1 2 x",
        "f 1 2 3 99",
        "f 1 2 3 999999999999999999999",
        "f 0 1 2 3",
        "f",
        "f 1",
        "f 1 2 3 4 ",
        "f  1//1 2/2 3/3/3 4",
        "v 5 5 5 0.1 0.2 0.3",
        "v nan 0 0",
        "f 1 3 2 4",
    ],
)
def test_obj_files_of_covered_faces_are_read_at_once_to_the_same_end(
    line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is read line by line, and what is wrong with it, does not change where all lines are read together."""
    content = f"{SQUARE}vt 0 0\nf 1 2 3 4\n{line}\nf 1/1 2/1 3/1\n".encode()
    told = []
    for at_once in (obj_polygons._plainly_covered, lambda _: False):
        monkeypatch.setattr(obj_polygons, "_plainly_covered", at_once)
        try:
            told.append(str(MeshReader().parse(content, "a.obj").triangles.tolist()))
        except Fault as fault:
            told.append(str(fault))
    assert told[0] == told[1]


def test_quads_are_not_read_line_by_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """An OBJ file of many quads was read at a sixth of the speed."""
    monkeypatch.setattr(obj_polygons, "obj_corners", None)
    assert len(MeshReader().parse(f"{SQUARE}f 1 2 3 4\nf 1//1 2//1 3//1\n".encode(), "a.obj").faces) == 3


def test_a_face_of_too_many_corners_is_refused_unless_a_fan_covers_it() -> None:
    """Clipping grows with their square: a drawing's outline of 100 000 corners would take all memory."""
    turn = 2.0 * np.pi * np.arange(MOST_CORNERS + 2) / (MOST_CORNERS + 2)
    star = (
        np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
        * np.where(np.arange(len(turn)) % 2, 1.0, 0.9)[:, None]
    )
    with pytest.raises(Fault, match="4000 are allowed"):
        polygon_triangles(star, [list(range(len(star)))])
    fewer = star[:: len(star) // 200]
    assert len(polygon_triangles(fewer, [list(range(len(fewer)))])[0]) == len(fewer) - 2
