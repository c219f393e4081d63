"""Scatterers with a shape: solids as large as what they stand for, keys of the scene file, check, and writing."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from rislam_rt.errors import SceneError
from rislam_rt.geometry.triangles import triangle_planes
from rislam_rt.model import Occluder, RadioConfig, RisPanel, Scatterer, Scene
from rislam_rt.scene import check_scene, load_scene, write_scene
from rislam_rt.scene.check.mesh_queries import ray_hits, sphere_directions, winding
from rislam_rt.scene.meshes import Mesh, ply_bytes
from rislam_rt.scene.shapes import block, cylinder_mesh, sphere_mesh

CENTER = np.array([2.0, 1.0, 1.0])
TILTED = np.array([2.0, -1.0, 2.0]) / 3.0


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices - CENTER)[mesh.faces].swapaxes(0, 1)
    return float(np.einsum("fi,fi->f", np.cross(a, b), c).sum() / 6.0)


def shadow(mesh: Mesh, direction: np.ndarray) -> float:
    """Area [m^2] of a convex solid's shadow in parallel light along `direction`."""
    across = np.linalg.svd(direction[None])[2][1:]
    return float(ConvexHull(mesh.vertices @ across.T).volume)


@pytest.mark.parametrize("mesh", [sphere_mesh(CENTER, 0.3), cylinder_mesh(CENTER, 0.3, 1.1, TILTED)], ids=str)
def test_solids_are_closed_and_outwards(mesh: Mesh) -> None:
    edges = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert np.unique(edges, axis=0, return_counts=True)[1].tolist() == [2] * (len(edges) // 2)
    assert winding(CENTER, mesh.vertices[mesh.faces]) == pytest.approx(1.0)
    normal, offset = triangle_planes(mesh.vertices[mesh.faces])
    assert (normal @ CENTER < offset).all()


def test_sphere_casts_the_true_shadow_in_the_mean() -> None:
    mesh = sphere_mesh(CENTER, 0.3)
    assert mesh.faces.shape == (320, 3)
    reach = np.linalg.norm(mesh.vertices - CENTER, axis=1)
    normal, offset = triangle_planes(mesh.vertices[mesh.faces])
    assert np.ptp(reach) < 1e-12
    assert reach.max() / 0.3 < 1.015
    assert (offset - normal @ CENTER).min() / 0.3 > 0.98
    areas = [shadow(mesh, direction) for direction in sphere_directions(200)]
    # the mean of 200 evenly spread directions, which differ by less than 1 %
    assert np.mean(areas) == pytest.approx(np.pi * 0.09, rel=2e-4)
    assert np.ptp(areas) < 0.01 * np.pi * 0.09


def test_cylinder_lies_along_its_axis_with_the_true_girth() -> None:
    mesh = cylinder_mesh(CENTER, 0.3, 1.1, TILTED)
    along = (mesh.vertices - CENTER) @ TILTED
    assert along.min() == pytest.approx(-0.55)
    assert along.max() == pytest.approx(0.55)
    # a polygon of 32 sides with the circle's girth has 0.3 % less area; from aside its width is 0.5 % more or less
    assert shadow(mesh, TILTED) == pytest.approx(np.pi * 0.09, rel=5e-3)
    aside = np.cross(TILTED, [0.0, 0.0, 1.0]) / np.linalg.norm(TILTED[:2])
    for angle in np.linspace(0.0, 0.2, 7):
        direction = np.cos(angle) * aside + np.sin(angle) * np.cross(TILTED, aside)
        assert shadow(mesh, direction) == pytest.approx(0.6 * 1.1, rel=5e-3)
    assert volume(mesh) == pytest.approx(np.pi * 0.09 * 1.1, rel=5e-3)


def test_rays_from_the_centre_find_no_hole() -> None:
    for mesh in (sphere_mesh(CENTER, 0.3), cylinder_mesh(CENTER, 0.3, 1.1, TILTED)):
        assert (ray_hits(CENTER, sphere_directions(2000), mesh.vertices[mesh.faces]) >= 0).all()


def test_keys_of_the_scene_file(damaged: Callable[[str, str], Path]) -> None:
    folder = damaged("radius = 0.05", "radius = 0.05\nshadow = true\nmie = true")
    ball = load_scene(folder).scatterers[0]
    assert (ball.law, ball.rcs, ball.radius, ball.height) == ("mie", np.pi * 0.05**2, 0.05, None)
    assert ball.shade is not None
    assert np.array_equal(ball.shade.vertices, sphere_mesh(CENTER, 0.05).vertices)
    folder = damaged("shadow = true\nmie = true", "height_m = 0.2\naxis = [0.0, 3.0, 0.0]")
    post = load_scene(folder).scatterers[0]
    assert (post.law, post.height, post.axis.tolist(), post.shade) == ("cylinder", 0.2, [0.0, 1.0, 0.0], None)
    assert post.rcs == pytest.approx(np.pi * 0.05 * 0.2 / 2)
    folder = damaged("height_m = 0.2", "height_m = 0.2\nrcs_m2 = 0.03")
    assert (load_scene(folder).scatterers[0].law, load_scene(folder).scatterers[0].rcs) == ("constant", 0.03)


def test_mesh_of_a_scatterer(room: Path, damaged: Callable[[str, str], Path]) -> None:
    before = load_scene(room).digest
    mesh = block([1.9, 0.9, 0.8], [2.1, 1.1, 1.2])
    (room / "meshes/ball.ply").write_bytes(ply_bytes(mesh.vertices, mesh.faces))
    damaged("radius = 0.05", 'rcs_m2 = 0.01\nmesh = "meshes/ball.ply"')
    scene = load_scene(room)
    assert scene.scatterers[0].shade is not None
    assert np.array_equal(scene.scatterers[0].shade.triangles, mesh.vertices[mesh.faces])
    first = scene.digest
    (room / "meshes/ball.ply").write_bytes(ply_bytes(mesh.vertices * 1.001, mesh.faces))
    assert len({before, first, load_scene(room).digest}) == 3


def paper() -> Scene:
    return load_scene(Path(__file__).parents[2] / "scenes/paper_room")


def with_shade(scene: Scene, mesh: Mesh, at: np.ndarray = CENTER) -> Scene:
    return replace(scene, scatterers=(Scatterer("ball", at, 0.01, shade=Occluder(mesh.vertices, mesh.faces)),))


def remarks(scene: Scene) -> list[str]:
    return [f"{f.severity} {f.field}: {f.message}" for f in check_scene(scene) if f.field != "ris.element"]


def test_a_sound_shade_earns_no_remark() -> None:
    assert remarks(with_shade(paper(), sphere_mesh(CENTER, 0.05))) == []


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            lambda s: with_shade(s, sphere_mesh(CENTER + np.array([0.2, 0, 0]), 0.1)),
            "does not enclose the scatterer's position",
        ),
        (lambda s: with_shade(s, sphere_mesh(CENTER - np.array([0, 0, 0.3]), 0.95)), "is inside it at or after cycle"),
        (lambda s: with_shade(s, sphere_mesh(s.agent.position[0], 0.2), s.agent.position[0]), "the agent is inside it"),
        (
            lambda s: replace(
                with_shade(s, sphere_mesh(CENTER, 0.3)),
                ris=RisPanel(s.ris.spec, CENTER + np.array([0.0, 0.0, 0.1]), None),
            ),
            "'ris' lies inside it",
        ),
        (
            lambda s: with_shade(s, Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 1e-8]]), np.array([[0, 1, 2]]))),
            "1 faces without area",
        ),
    ],
    ids=["elsewhere", "in the way", "around the start", "around the panel", "degenerate"],
)
def test_unsound_shades(change: Callable[[Scene], Scene], says: str) -> None:
    found = [line for line in remarks(change(paper())) if line.startswith("error scatterer[0].mesh (ball)")]
    assert found
    assert says in found[0]


def test_cylinders_are_for_the_far_field() -> None:
    """The path keeps 0.9 m off the post; 2 h^2 / lambda is 0.6 m for 9.5 cm and 1.5 m for 15 cm at 10 GHz."""
    scene = paper()
    for height, near in ((0.095, False), (0.15, True)):
        post = Scatterer("post", CENTER, 0.01, 0.02, "cylinder", height)
        found = check_scene(replace(scene, scatterers=(post,)), RadioConfig())
        lines = [f.line for f in found if f.field == "scatterer[0].height_m (post)"]
        assert bool(lines) == near
        assert all("begins at 2 h^2 / lambda = 1.5 m" in line for line in lines)
        ends = np.stack([scene.agent.tx, scene.agent.rx])
        sigma = np.pi * 0.02 * np.linalg.norm(ends - CENTER, axis=-1).min()
        assert all(f"give 'rcs_m2': pi r times the distance, {sigma:.2g} m^2 there" in line for line in lines)


@pytest.mark.parametrize(
    "scatterer",
    [
        Scatterer("ball", CENTER, np.pi * 0.05**2, 0.05, "mie"),
        Scatterer("post", CENTER, np.pi * 0.05 * 0.3 / 2, 0.05, "cylinder", 0.3, TILTED),
        Scatterer("post", CENTER, 0.02, 0.05, "constant", 0.3, TILTED),
        Scatterer("ball", CENTER, 0.02, shade=Occluder(*block([1.9, 0.9, 0.9], [2.1, 1.1, 1.1]))),
        Scatterer("ball", CENTER, np.pi * 0.05**2, 0.05, shade=Occluder(*sphere_mesh(CENTER, 0.05))),
        Scatterer(
            "post", CENTER, 0.02, 0.05, "constant", 0.3, TILTED, Occluder(*cylinder_mesh(CENTER, 0.05, 0.3, TILTED))
        ),
    ],
    ids=["mie", "cylinder", "cylinder with rcs", "mesh", "own shadow", "cylinder shadow"],
)
def test_round_trip(tmp_path: Path, scatterer: Scatterer) -> None:
    folder = write_scene(replace(paper(), scatterers=(scatterer,)), tmp_path / "room")
    again = load_scene(folder).scatterers[0]
    assert (again.name, again.radius, again.law, again.height) == (
        scatterer.name, scatterer.radius, scatterer.law, scatterer.height
    )  # fmt: skip
    assert again.rcs == pytest.approx(scatterer.rcs, rel=1e-15)
    assert np.allclose(again.axis, scatterer.axis, rtol=0, atol=1e-15)
    assert (again.shade is None) == (scatterer.shade is None)
    if again.shade is not None and scatterer.shade is not None:
        # the axis is brought to length 1 once more on reading
        assert np.allclose(again.shade.triangles, scatterer.shade.triangles, rtol=0, atol=1e-14)
        own = scatterer.radius is not None
        assert (folder / f"meshes/{scatterer.name}.ply").exists() != own
        assert ("shadow = true" in (folder / "scene.toml").read_text()) == own


def test_records_refuse_what_makes_no_sense() -> None:
    with pytest.raises(SceneError, match="Mie series is a sphere's"):
        Scatterer("s", CENTER, 1.0, law="mie")
    with pytest.raises(SceneError, match="needs a radius and a height"):
        Scatterer("s", CENTER, 1.0, 0.1, law="cylinder")
    with pytest.raises(SceneError, match="law 'cone' received"):
        Scatterer("s", CENTER, 1.0, law="cone")
    with pytest.raises(SceneError, match="give a unit vector"):
        Scatterer("s", CENTER, 1.0, 0.1, "cylinder", 0.2, np.array([0.0, 0.0, 2.0]))
    with pytest.raises(SceneError, match="shade: the mesh has no faces"):
        Occluder(np.zeros((3, 3)), np.zeros((0, 3), dtype=int))


def test_shades_alone_are_written_read_and_checked(room: Path, tmp_path: Path) -> None:
    scene = load_scene(room)
    heap = Occluder(*block([2.9, 2.9, 0.2], [3.1, 3.1, 0.4]), name="heap")
    again = load_scene(write_scene(replace(scene, occluders=(heap,)), tmp_path / "again"))
    assert [shade.name for shade in again.occluders] == ["heap"]
    assert np.array_equal(again.occluders[0].triangles, heap.triangles)
    around = Occluder(*block([0.2, 0.2, 0.1], [1.0, 1.0, 0.9]), name="heap")
    inside = [f.line for f in check_scene(replace(scene, occluders=(around,)))]
    assert any("the agent is inside it at or after cycle 0" in line and "shade[0]" in line for line in inside)
    twice = [f.line for f in check_scene(replace(scene, occluders=(replace(heap, name="floor"),)))]
    assert any("called 'floor'" in line for line in twice)
