"""Every remark of the scene check has a scene that earns it, and a near miss that does not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from built_in_rooms.parts import box_walls, grid

from rislam_rt.errors import SceneError
from rislam_rt.geometry.triangles import connected_triangles
from rislam_rt.model import Body, RadioConfig, Reflector, RisPanel, RxArray, Scatterer, Scene, Trajectory
from rislam_rt.scene import check_scene, load_scene
from rislam_rt.scene.check.mesh_queries import ray_hits, sphere_directions, touching, winding
from rislam_rt.scene.meshes import Mesh, joined
from rislam_rt.scene.shapes import block

Change = Callable[[Scene], Scene]


@pytest.fixture(scope="module")
def paper() -> Scene:
    return load_scene(Path(__file__).parents[2] / "scenes/paper_room")


def remarks(scene: Scene, radio: RadioConfig | None = None) -> dict[str, str]:
    """Field and messages of every finding but the one on the paper's element."""
    found: dict[str, str] = {}
    for f in check_scene(scene, radio):
        if f.field != "ris.element":
            found[key] = f"{found.get(key := f'{f.severity} {f.field}', '')}{f.message}; {f.mend}"
    return found


def complaints(scene: Scene, radio: RadioConfig | None = None) -> dict[str, str]:
    """Those remarks that are no notes."""
    return {field: text for field, text in remarks(scene, radio).items() if not field.startswith("note")}


def moved(scene: Scene, start: list[float], velocity: list[float], body: Body | None = None) -> Scene:
    time = scene.agent.time
    position = np.array(start) + time[:, None] * np.array(velocity)
    speed = np.tile(velocity, (len(time), 1))
    return replace(scene, agent=Trajectory(time, position, speed, np.zeros(len(time)), body or scene.agent.body))


def panel(scene: Scene, **changes: Any) -> Scene:
    assert scene.ris is not None
    spec = replace(scene.ris.spec, **{k: v for k, v in changes.items() if k not in ("center", "host")})
    return replace(scene, ris=RisPanel(spec, changes.get("center", scene.ris.center), changes.get("host", "ceiling")))


def furnished(scene: Scene, name: str, mesh: Mesh) -> Scene:
    part = Reflector(name, mesh.vertices, mesh.faces, scene.reflectors[0].material)
    return replace(scene, reflectors=(*scene.reflectors, part))


def without(scene: Scene, *names: str) -> Scene:
    return replace(scene, reflectors=tuple(r for r in scene.reflectors if r.name not in names))


def scatterer(scene: Scene, at: list[float]) -> Scene:
    return replace(scene, scatterers=(Scatterer("sphere", np.array(at), 0.01, 0.05),))


def scaled(scene: Scene, factor: float) -> Scene:
    parts = tuple(replace(r, vertices=r.vertices * factor) for r in scene.reflectors)
    return moved(replace(scene, reflectors=parts, scatterers=(), ris=None), [factor] * 3, [0.0] * 3)


TINY = Body(np.array([-1e-4, 0.0, 0.0]), np.array([1e-4, 0.0, 0.0]))
SLIVER = Mesh(np.array([[1.0, 1, 1], [2, 1, 1], [3, 1, 1 + 1e-7]]), np.array([[0, 1, 2]]))
UP = np.array([0, 0, 1e-5])
BOARD, NEXT = (grid([x, 1, 2], [1, 0, 0], [0, 1, 0], 2, 2) for x in (1, 2))
TABLE = block([2.5, 2.5, 0.4], [3.5, 3.5, 0.6])
CRATE = block([0.2, 0.2, 0.0], [1.2, 1.2, 1.0], without=("floor",))
SCREEN = grid([1.0, 0.2, 0.1], [0.0, 5.0, 0.0], [0.0, 0.0, 2.0], 1, 1)

CASES: dict[str, tuple[Change, str, str]] = {
    "start outside": (lambda s: moved(s, [7, 1, 1], [0, 0, 0]), "error agent.start", "lies outside"),
    "walks out": (lambda s: moved(s, [5, 1, 1], [0.1, 0, 0]), "error agent", "lies outside"),
    "start on a wall": (lambda s: moved(s, [3, 3, 0.0005], [0, 0, 0]), "error agent.start", "lies on 'floor'"),
    "Tx out of the wall": (lambda s: moved(s, [0.02, 3, 1], [0, 0, 0]), "error agent.start", "Tx at"),
    "walks through": (
        lambda s: moved(furnished(s, "screen", SCREEN), [0.5, 3, 1], [0.03, 0, 0]),
        "error agent",
        "goes through 'screen' after cycle 166",
    ),
    "astride": (
        lambda s: moved(furnished(s, "screen", SCREEN), [1.01, 3, 1], [0, 0, 0]),
        "error agent.start",
        "'screen' stands between Tx and Rx",
    ),
    "in an object": (
        lambda s: moved(furnished(s, "table", TABLE), [3, 3, 0.5], [0, 0, 0], TINY),
        "error agent.start",
        "inside the object 'table'",
    ),
    "in a bottomless object": (
        lambda s: moved(furnished(s, "crate", CRATE), [0.7, 0.7, 0.3], [0, 0, 0]),
        "error agent.start",
        "inside the object 'crate'",
    ),
    "doubled name": (lambda s: furnished(s, "sphere", TABLE), "error name", "called 'sphere'"),
    "sliver": (lambda s: furnished(s, "sliver", SLIVER), "error reflector[6].mesh (sliver)", "first is face 0"),
    "doubled faces": (
        lambda s: furnished(s, "shelf", joined([BOARD, Mesh(BOARD.vertices, BOARD.faces[:, ::-1])])),
        "warning reflector",
        "8 faces lie exactly on others of their mesh, the first in 'shelf'",
    ),
    "doubled wall": (
        lambda s: furnished(s, "again", Mesh(s.reflectors[0].vertices + UP, s.reflectors[0].faces[:, ::-1])),
        "warning reflector[0].mesh (floor)",
        "'floor' lies in the plane of 'again', 0.01 mm apart; where they overlap 'floor' reflects",
    ),
    "poster": (
        lambda s: furnished(s, "poster", grid([0, 1, 1], [0, 1, 0], [0, 0, 1], 1, 1)),
        "note reflector[6].mesh (poster)",
        "'poster' lies in the plane of 'wall_x0', 0 mm apart; as of a window in its wall, the smaller one reflects",
    ),
    "foot on the floor": (
        lambda s: furnished(s, "crate", block([2, 4, 0], [3, 5, 1])),
        "note reflector[6].mesh (crate)",
        "'crate' lies in the plane of 'floor'",
    ),
    "bent plate": (
        lambda s: furnished(s, "plate", joined([BOARD, grid([2, 1, 2], [1, 0, 1e-3], [0, 1, 0], 2, 2)])),
        "warning reflector[6].mesh (plate)",
        "splits into 2 walls, of which neighbours meet at only 1.0e-03 rad",
    ),
    "planes": (
        lambda s: furnished(s, "shelf", block([1, 4, 1], [2, 5, 2])),
        "note reflector[6].mesh (shelf)",
        "the mesh has 6 planes; its walls are shelf#0 to shelf#5",
    ),
    "scatterer outside": (lambda s: scatterer(s, [2, 1, 4]), "error scatterer[0].position (sphere)", "outside"),
    "scatterer on a wall": (
        lambda s: scatterer(s, [2, 1, 2.9995]), "error scatterer[0].position (sphere)", "on 'ceiling'"
    ),
    "scatterer in an object": (
        lambda s: scatterer(furnished(s, "table", block([2, 4, 1], [3, 5, 2])), [2.5, 4.5, 1.5]),
        "warning scatterer[0].position (sphere)",
        "inside 'table'",
    ),
    "scatterer below": (
        lambda s: scatterer(s, [2, 1, 0.4]),
        "warning scatterer[0].position (sphere)",
        "below the array, which hears from above only",
    ),
    "panel outside": (lambda s: panel(s, center=[3, 3, 3.1]), "error ris.center", "lies outside"),
    "panel off its host": (
        lambda s: panel(s, center=[3, 3, 2.94]),
        "error ris.center",
        "60 mm off 'ceiling', and a panel lies on its host, or at most 50 mm before it; give center = [3.0, 3.0, 3.0]",
    ),
    "panel behind its host": (
        lambda s: panel(furnished(s, "shelf", grid([2, 2, 2], [2, 0, 0], [0, 2, 0], 1, 1)), center=[3, 3, 2.01],
                        host="shelf"),
        "error ris.center",
        "10 mm off 'shelf'",
    ),
    "panel before its host and beside it": (
        lambda s: panel(furnished(s, "shelf", grid([1, 1, 2], [1, 0, 0], [0, 1, 0], 1, 1)), center=[3, 3, 1.98],
                        host="shelf"),
        "error ris.center",
        "beside 'shelf', in its plane; move the panel onto its host",
    ),
    "panel beside its host": (
        lambda s: panel(furnished(furnished(s, "shelf", grid([1, 1, 2], [1, 0, 0], [0, 1, 0], 1, 1)), "pane",
                                  grid([2, 2, 2], [2, 0, 0], [0, 2, 0], 1, 1)), center=[3, 3, 2], host="shelf"),
        "error ris.center",
        "beside 'shelf', in its plane; move the panel onto its host, or give host = \"pane\", which is there",
    ),
    "host unknown": (lambda s: panel(s, host="roof"), "error ris.host", "'roof' is no reflector; give one of floor"),
    "host not named": (lambda s: panel(s, host=None), "error ris.host", 'add host = "ceiling"'),
    "panel askew": (
        lambda s: panel(s, normal=[np.sin(0.05), 0, -np.cos(0.05)]),
        "error ris.normal",
        "2.86 degrees from the normal of 'ceiling'",
    ),
    "panel facing out": (lambda s: panel(s, normal=[0, 0, 1]), "error ris.normal", "points out of the room"),
    "agent behind the panel": (
        lambda s: panel(furnished(s, "shelf", grid([2, 2, 0.2], [2, 0, 0], [0, 2, 0], 1, 1)), center=[3, 3, 0.2],
                        host="shelf"),
        "warning ris.normal",
        "never in front",
    ),
    "large panel": (lambda s: panel(s, rows=40, cols=40), "warning ris.rows", "more than 1 / B = 1 ns"),
    "panel beyond the room": (
        lambda s: panel(s, rows=300, cols=500),
        "warning ris.rows",
        "the panel of 7.5 m x 4.5 m reaches 0.75 m beyond the room",
    ),
    "open room": (lambda s: without(s, "wall_x6"), "warning reflector", "rays from the start leave the room"),
    "millimetres": (lambda s: scaled(s, 1000.0), "warning meshes.units", "is it in millimetres?"),
    "too small": (lambda s: scaled(moved(s, [3, 3, 1], [0, 0, 0], TINY), 0.01), "warning meshes.units", "9 m across"),
    "too fast": (lambda s: replace(s, agent=_fast(s.agent)), "warning agent", "14.1 m/s (after cycle 0)"),
    "through a scatterer": (lambda s: moved(s, [1.8, 1, 1], [0.005, 0, 0]), "warning scatterer[0].position (sphere)",
                            "the agent comes within 0.024 m of its centre at cycle"),
    "gap": (lambda s: gap(s, 6.0), "warning agent.trajectory", "6 s without a pose after cycle 9"),
}  # fmt: skip


def gap(scene: Scene, seconds: float) -> Scene:
    """The scene with an agent that nobody saw for a while after its cycle 9."""
    later = scene.agent.time + np.where(np.arange(len(scene.agent)) > 9, seconds - 0.1, 0.0)
    return replace(scene, agent=replace(scene.agent, time=later))


def _fast(agent: Trajectory) -> Trajectory:
    return Trajectory(agent.time[:2], [[1, 1, 0.5], [2, 2, 0.5]], agent.velocity[:2], agent.heading[:2], agent.body)


@pytest.mark.parametrize("case", CASES)
def test_remark(paper: Scene, case: str) -> None:
    change, field, says = CASES[case]
    found = remarks(change(paper))
    assert field in found, found
    assert says in found[field]


@pytest.mark.parametrize(
    "change",
    [
        lambda s: s,
        lambda s: gap(s, 4.9),
        lambda s: moved(s, [1.8, 1.08, 0.9], [0.005, 0, 0]),
        lambda s: moved(s, [0.06, 3, 0.9], [0, 0, 0]),
        lambda s: moved(furnished(s, "table", TABLE), [3, 3, 0.7], [0, 0, 0]),
        lambda s: moved(furnished(s, "crate", CRATE), [0.7, 1.3, 0.9], [0, 0, 0]),
        lambda s: moved(furnished(s, "screen", SCREEN), [0.5, 3, 0.9], [0.005, 0, 0]),
        lambda s: panel(s, center=[3, 3, 2.9995]),
        lambda s: panel(s, center=[3, 3, 2.5], host=None),
        lambda s: panel(s, rows=9, cols=9),
        lambda s: scatterer(s, [2, 1, 0.6]),
        lambda s: furnished(s, "poster", grid([3e-5, 1, 1], [0, 1, 0], [0, 0, 1], 1, 1)),
        lambda s: furnished(s, "tiles", joined([grid([1, 1, 2], [1, 0, 0], [0, 1, 0], 1, 1), NEXT])),
        lambda s: furnished(furnished(s, "tile", BOARD), "next", NEXT),
    ],
)
def test_no_remark_on_what_is_sound(paper: Scene, change: Change) -> None:
    assert complaints(change(paper)) == {}


def test_boxes_face_to_face_are_one_note(paper: Scene) -> None:
    """A staircase of four boxes: its faces that meet, each within the higher one's or beyond it, are seen by nobody."""
    room = paper
    for step in range(4):
        low, high = [2 + 0.3 * step, 3 + 0.2 * step, 0], [2.3 + 0.3 * step, 4 + 0.2 * step, 0.2 * (step + 1)]
        room = furnished(room, f"step{step}", block(low, high))
    assert complaints(room) == {}
    (note,) = (f for f in check_scene(room) if "plane of" in f.message)
    assert note.message.endswith("0 mm apart, and 6 other pairs likewise")  # four on the floor, three of steps
    hung = furnished(room, "plate", grid([2.3, 3.2, 0.1], [0, 0.5, 0], [0, 0, 0.3], 1, 1))  # beyond the first step
    assert "'plate' lies" in " ".join(text for text in remarks(hung).values() if "nobody sees" not in text)


def shut_off(room: Scene, part: str, opened: bool = False) -> Scene:
    """The room with a part of it shut off by sheets, below a raised floor, behind an inner wall, or above a lowered
    ceiling; or with one of its sides left open."""
    x, y, z = [3.0, 0, 0], [0, 3.0, 0], {"below": 0.0, "behind": 0.0, "above": 2.6}[part]
    up = [0, 0, {"below": 0.3, "behind": 3.0, "above": 0.4}[part]]
    lid = grid([3, 0, 0.3 if part == "below" else z], x, y, 1, 1)
    sheets = {"sheet": lid, "side": grid([3, 3, z], x, up, 1, 1), "front": grid([3, 0, z], y, up, 1, 1)}
    if part == "behind":
        sheets = {"sheet": sheets["front"], "side": sheets["side"]}
    for name in list(sheets)[: len(sheets) - opened]:
        room = furnished(room, name, sheets[name])
    return room


@pytest.mark.parametrize(
    ("part", "chest", "poster"),
    [
        ("below", block([4, 1, 0.3], [5, 2, 1.3]), grid([4, 2.2, 0.3], [1, 0, 0], [0, 0.5, 0], 1, 1)),
        ("behind", block([2.2, 1, 0.1], [3, 2, 0.9]), grid([3, 0.2, 1], [0, 0.5, 0], [0, 0, 0.5], 1, 1)),
        ("above", block([4, 1, 0.1], [4.5, 2, 2.6]), grid([4, 2.2, 2.6], [1, 0, 0], [0, 0.5, 0], 1, 1)),
    ],
)
def test_a_face_before_a_void_is_seen_if_the_void_is(paper: Scene, part: str, chest: Mesh, poster: Mesh) -> None:
    """On a raised floor, against an inner wall, under a lowered ceiling: the void is within the bounds of the room."""
    closed, opened = (furnished(shut_off(paper, part, opened), "chest", chest) for opened in (False, True))
    assert complaints(closed) == {}
    assert "'chest' lies in the plane of 'sheet'" in " ".join(remarks(closed).values())
    for room, name in ((opened, "chest"), (furnished(closed, "poster", poster), "poster")):
        told = [text for text in remarks(room).values() if f"'{name}' lies in the plane of 'sheet'" in text]
        assert (told[0] in complaints(room).values(), "nobody sees" in told[0]) == (name == "chest", False)


def test_a_poster_behind_a_cupboard_is_seen(paper: Scene) -> None:
    """5 cm off the wall that the poster hangs on, a cupboard hides it from nearly everywhere."""
    room = furnished(paper, "poster", grid([0, 3.4, 1], [0, 0.2, 0], [0, 0, 0.2], 1, 1))
    room = furnished(room, "cupboard", block([0.05, 3, 0.1], [0.6, 4, 2]))
    assert "nobody sees" not in remarks(room)["note reflector[6].mesh (poster)"]
    room = furnished(room, "sides", joined([grid([0, y, 0.1], [0.05, 0, 0], [0, 0, 1.9], 1, 1) for y in (3, 4)]))
    lids = joined([grid([0, 3, z], [0.05, 0, 0], [0, 1, 0], 1, 1) for z in (0.1, 2)])
    assert "nobody sees" in remarks(furnished(room, "lids", lids))["note reflector[6].mesh (poster)"]


def test_room_of_a_larger_building_is_no_object(paper: Scene) -> None:
    """Two closed rooms, one a thousandth of the scene's box: its landmark says that it is lived in."""
    far = block([40.0, 40.0, 0.0], [60.0, 60.0, 20.0])
    walls = joined(list(box_walls(6.0, 6.0, 3.0).values()))
    building = replace(furnished(furnished(paper, "house", walls), "far", far), ris=None)
    building = without(building, "floor", "ceiling", "wall_x0", "wall_x6", "wall_y0", "wall_y6")
    assert complaints(building) == {}
    empty = replace(building, scatterers=())
    assert "inside the object 'house'" in remarks(empty)["error agent.start"]


def test_element_remark_depends_on_carrier_and_pattern(paper: Scene) -> None:
    """Excess of `tang` over a plate: 8 dx dy against 4 pi (dx dy)^2 / lambda^2, 4.05 dB at 15 mm and 10 GHz."""
    at_10, at_20 = (check_scene(paper, RadioConfig(carrier=f, bandwidth=1e9)) for f in (10e9, 20e9))
    assert [f.message for f in at_10] == ["at 10 GHz 'tang' elements reflect 4.05 dB more than a perfect plate"]
    assert [f.field for f in at_20] == ["ris.spacing_m"]  # 15 mm are a wavelength there
    assert check_scene(panel(paper, element="energy")) == []


def test_isotropic_array_hears_from_below(paper: Scene) -> None:
    radio = RadioConfig(array=RxArray(pattern="isotropic"))
    assert complaints(scatterer(paper, [2, 1, 0.4]), radio) == {}


def test_loader_refuses_what_the_check_calls_an_error(room: Path, damaged: Callable[[str, str], Path]) -> None:
    damaged("start = [0.5, 0.7, 0.5]", "start = [0.5, 7.7, 0.5]")
    findings = check_scene(room)
    assert [f.severity for f in findings] == ["error"]
    with pytest.raises(SceneError, match=r"scene\.toml: agent\.start: agent at ") as caught:
        load_scene(room)
    assert str(caught.value) == findings[0].line
    damaged("host = \"ceiling\"", "host = \"roof\"")  # fmt: skip
    with pytest.raises(SceneError, match=r"\(and 1 more\)$"):
        load_scene(room)


def test_warnings_do_not_keep_a_scene_from_loading(room: Path, damaged: Callable[[str, str], Path]) -> None:
    text = (room / "scene.toml").read_text()
    start = text.index('[[reflector]]\nname = "wall_x6"')
    (room / "scene.toml").write_text(text[:start] + text[text.index("[[reflector]]", start + 5) :])
    assert len(load_scene(room).reflectors) == 5
    assert any("leave the room" in f.message for f in check_scene(room))


def test_winding_of_a_closed_and_an_open_box() -> None:
    closed = block([0, 0, 0], [2, 1, 1])
    triangles = closed.vertices[closed.faces]
    rng = np.random.default_rng(5)
    for point in rng.uniform([-1, -1, -1], [3, 2, 2], (200, 3)):
        inside = bool(((point > 0) & (point < [2, 1, 1])).all())
        assert np.isclose(abs(winding(point, triangles)), float(inside), rtol=0, atol=1e-9)
    # Without one face of a cube its centre keeps five sixths of the full solid angle.
    cube = block([0, 0, 0], [1, 1, 1], without=("ceiling",))
    assert np.isclose(abs(winding(np.full(3, 0.5), cube.vertices[cube.faces])), 5 / 6, rtol=0, atol=1e-9)


def test_rays_hit_the_nearest_face() -> None:
    room = joined([*box_walls(6.0, 5.0, 3.0).values(), block([4, 2, 0], [5, 3, 3])])
    triangles = room.vertices[room.faces]
    origin, directions = np.array([1.0, 2.5, 1.0]), sphere_directions(1000)
    hits = ray_hits(origin, directions, triangles)
    assert (hits >= 0).all()
    # The pillar's front face at x = 4 is the only one with a constant x of 4 m.
    front = (triangles[hits][:, :, 0] == 4.0).all(axis=1)
    at = origin + directions * (3.0 / directions[:, :1])
    expected = (directions[:, 0] > 0) & (at[:, 1] > 2) & (at[:, 1] < 3) & (at[:, 2] > 0) & (at[:, 2] < 3)
    assert np.array_equal(front, expected)
    assert expected.sum() > 10


def test_touching_equals_brute_force_over_samples() -> None:
    """A triangle's neighbourhood against the distance to a fine sampling of it (1 mm apart, so 2 mm either side)."""
    triangle = np.array([[[0.0, 0, 0], [1, 0, 0.2], [0.3, 0.8, 0]]])
    u, v = np.meshgrid(np.linspace(0, 1, 700), np.linspace(0, 1, 700))
    keep = u + v <= 1
    edges = triangle[0, 1:] - triangle[0, 0]
    cloud = triangle[0, 0] + u[keep][:, None] * edges[0] + v[keep][:, None] * edges[1]
    rng = np.random.default_rng(9)
    points = cloud[rng.integers(len(cloud), size=60)] + rng.normal(0, 0.02, (60, 3))
    distance = np.array([np.linalg.norm(cloud - p, axis=1).min() for p in points])
    near = np.isin(np.arange(60), touching(points, triangle, 0.02)[0])
    assert near[distance < 0.018].all()
    assert not near[distance > 0.03].any()  # beyond a corner the edges' lines reach further than the triangle


def test_connected_triangles_counts_pieces_not_vertices() -> None:
    pieces = joined([block([0, 0, 0], [1, 1, 1]), block([2, 0, 0], [3, 1, 1]), block([1, 1, 1], [1.5, 2, 2])])
    label = connected_triangles(pieces.vertices[pieces.faces])
    assert np.array_equal(label[:12], np.full(12, label[0]))
    assert label[12] != label[0]
    assert label[24] == label[0]  # the third box shares a corner with the first


def test_several_meshes_of_many_planes_are_one_note(paper: Scene) -> None:
    """Twelve crates are twelve times the same remark, under which the warnings would be lost."""
    for x in (2.0, 3.0, 4.0):
        paper = furnished(paper, f"shelf_{x:g}", block([x, 4.0, 1.0], [x + 0.5, 5.0, 2.0]))
    (note,) = (text for text in remarks(paper).values() if "planes" in text)
    assert "the mesh has 6 planes, and 2 other reflectors more than one; its walls are shelf_2#0 to shelf_2#5" in note
