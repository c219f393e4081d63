"""Laws of any room: what must not change when it is moved, re-meshed, or looked at from the other end."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import Body, PathKind, RadioConfig, Reflector, Scatterer

RADIO = RadioConfig()
NAMES = ["paper", "l_shape", "parted"]
SPOTS = [[1.13, 2.31, 1.2], [2.4, 4.73, 0.52], [2.61, 1.2, 1.9]]


def path_set(paths, cycle):
    """Identity in names -> (tau, departure, arrival, gain)."""
    found = {}
    for p in np.flatnonzero(paths.valid[cycle]):
        kind, landmark, tx, rx = paths.identity(p)
        name = paths.landmarks[landmark] if landmark >= 0 else ""
        key = kind, name, tuple(paths.walls[w] for w in tx), tuple(paths.walls[w] for w in rx)
        found[key] = paths.tau[cycle, p], paths.departure[cycle, p], paths.arrival[cycle, p], paths.gain[cycle, p]
    return found


def assert_same(a, b, turn=None):
    """The same identities with the same numbers, directions turned by a rotation."""
    for cycle in range(a.num_cycles):
        one, other = path_set(a, cycle), path_set(b, cycle)
        assert one.keys() == other.keys()
        for key, (tau, departure, arrival, gain) in one.items():
            matrix = np.eye(3) if turn is None else turn
            # Coordinates of up to 100 m in float64: 1e-14 m, of which the phase makes 2e-12; images add a few more.
            assert other[key][0] == pytest.approx(tau, rel=1e-12)
            np.testing.assert_allclose(other[key][1], matrix @ departure, atol=1e-9)
            np.testing.assert_allclose(other[key][2], matrix @ arrival, atol=1e-9)
            assert other[key][3] == pytest.approx(gain, rel=1e-7, abs=1e-16)


def paths_of(scene, trajectory, depth=2):
    return ImageSourceChannel(scene, RADIO, depth).paths(trajectory)


@pytest.mark.parametrize("name", NAMES)
def test_reciprocity(rooms, name):
    scene = getattr(rooms, name)()
    there = rooms.at(SPOTS)
    back = replace(there, body=Body(there.body.rx_offset, there.body.tx_offset))
    forward, reverse = paths_of(scene, there), paths_of(scene, back)
    for cycle in range(len(there)):
        one, other = path_set(forward, cycle), path_set(reverse, cycle)
        turned = {}
        for (kind, name, tx, rx), (tau, departure, arrival, gain) in other.items():
            swapped = (rx[::-1], tx[::-1]) if name else (tx[::-1], rx)
            turned[kind, name, *swapped] = tau, arrival, departure, gain
        assert one.keys() == turned.keys()
        for key, value in one.items():
            for a, b in zip(value, turned[key], strict=True):
                np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-9 if np.ndim(a) else 0.0)


def moved(scene, rotation, shift):
    """The whole room turned about the origin and shifted."""

    def place(points):
        return points @ rotation.T + shift

    reflectors = tuple(replace(r, vertices=place(r.vertices)) for r in scene.reflectors)
    scatterers = tuple(replace(s, position=place(s.position)) for s in scene.scatterers)
    spec = replace(scene.ris.spec, normal=rotation @ scene.ris.spec.normal, up=rotation @ scene.ris.spec.up)
    ris = replace(scene.ris, spec=spec, center=place(scene.ris.center))
    return replace(scene, reflectors=reflectors, scatterers=scatterers, ris=ris)


@settings(max_examples=4, deadline=None)
@given(st.sampled_from(NAMES), st.tuples(*[st.floats(-np.pi, np.pi)] * 3), st.tuples(*[st.floats(-30.0, 30.0)] * 3))
def test_rotation_and_translation(rooms, name, angles, shift):
    """Rounding the turned meshes moves planes by some 1e-14 m; the tolerances of `assert_same` allow for it."""
    scene, here = getattr(rooms, name)(), rooms.at(SPOTS)
    matrix = Rotation.from_euler("xyz", angles).as_matrix()
    there = replace(
        here,
        position=here.position @ matrix.T + np.array(shift),
        body=Body(matrix @ here.body.tx_offset, matrix @ here.body.rx_offset),
    )
    assert_same(paths_of(scene, here), paths_of(moved(scene, matrix, np.array(shift)), there), turn=matrix)


@pytest.mark.parametrize("name", NAMES)
def test_flipped_normals(rooms, name):
    scene = getattr(rooms, name)()
    flipped = replace(scene, reflectors=tuple(replace(r, faces=r.faces[:, ::-1]) for r in scene.reflectors))
    assert_same(paths_of(scene, rooms.at(SPOTS)), paths_of(flipped, rooms.at(SPOTS)))


def subdivided(reflector: Reflector) -> Reflector:
    """Every triangle cut into four at the middles of its edges."""
    a, b, c = reflector.triangles.swapaxes(0, 1)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    small = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return replace(reflector, vertices=small.reshape(-1, 3), faces=np.arange(3 * len(small)).reshape(-1, 3))


@pytest.mark.parametrize("name", NAMES)
def test_subdivided_meshes(rooms, name):
    scene = getattr(rooms, name)()
    finer = replace(scene, reflectors=tuple(subdivided(subdivided(r)) for r in scene.reflectors))
    assert_same(paths_of(scene, rooms.at(SPOTS)), paths_of(finer, rooms.at(SPOTS)))


@pytest.mark.parametrize("name", NAMES)
def test_permuted_objects(rooms, name):
    scene = getattr(rooms, name)()
    second = Scatterer("post", np.array([1.0, 2.9, 0.4]), 1e-2)
    scene = replace(scene, scatterers=(*scene.scatterers, second))
    order = np.random.default_rng(2).permutation(len(scene.reflectors))
    shuffled = replace(scene, reflectors=tuple(scene.reflectors[i] for i in order), scatterers=scene.scatterers[::-1])
    assert_same(paths_of(scene, rooms.at(SPOTS)), paths_of(shuffled, rooms.at(SPOTS)))


def test_one_mesh_for_the_whole_room(rooms):
    """A room modelled as one object has the same paths; its walls are facets of it."""
    scene = replace(rooms.l_shape(), ris=None)
    parts = [r.triangles for r in scene.reflectors]
    soup = np.concatenate(parts)
    whole = Reflector(
        "room", soup.reshape(-1, 3), np.arange(3 * len(soup)).reshape(-1, 3), scene.reflectors[0].material
    )
    one, other = (paths_of(s, rooms.at(SPOTS)) for s in (scene, replace(scene, reflectors=(whole,))))
    assert all(name.startswith("room#") for name in other.walls)
    for cycle in range(3):
        taus = [np.sort(p.tau[cycle, p.valid[cycle]]) for p in (one, other)]
        np.testing.assert_allclose(*taus, rtol=1e-12)


def test_depth_only_adds_paths(rooms):
    scene, trajectory = rooms.parted(), rooms.at(SPOTS)
    sets = [path_set(paths_of(scene, trajectory, depth), 0) for depth in (0, 1, 2)]
    for less, more in itertools.pairwise(sets):
        assert less.keys() < more.keys()
        assert all(more[key][0] == less[key][0] for key in less)


def test_a_wall_shifted_in_its_plane_keeps_its_paths(rooms):
    """The floor grown beyond the walls: no path changes, for nothing outside can be seen."""
    scene = rooms.paper()
    floor = rooms.polygon("floor", [(-2, -3, 0), (9, -3, 0), (9, 8, 0), (-2, 8, 0)])
    wider = replace(scene, reflectors=(floor, *scene.reflectors[1:]))
    assert_same(paths_of(scene, rooms.at(SPOTS)), paths_of(wider, rooms.at(SPOTS)))


def test_a_panel_reflects_to_its_front_only_and_not_over_its_host(rooms):
    scene = rooms.paper()
    above = rooms.at([[3.1, 3.2, 4.0], [3.1, 3.2, 2.0]])
    open_top = replace(
        scene, reflectors=tuple(r for r in scene.reflectors if r.name != "ceiling"), ris=replace(scene.ris, host=None)
    )
    paths = paths_of(open_top, above)
    panel = np.isin(paths.kind, (PathKind.RIS, PathKind.VRIS))
    assert not (paths.valid[0] & panel & (paths.kind == PathKind.RIS)).any()
    assert (paths.valid[1] & (paths.kind == PathKind.RIS)).any()
    hung = paths_of(scene, above[1:])
    ceiling = hung.walls.index("ceiling")
    legs = [hung.identity(p) for p in range(hung.num_paths) if hung.kind[p] == PathKind.VRIS]
    assert not any(tx[-1:] == (ceiling,) or rx[:1] == (ceiling,) for _, _, tx, rx in legs)
    floor = hung.walls.index("floor")
    assert any(tx == (ceiling, floor) for _, _, tx, _ in legs)


def test_the_host_does_not_hide_a_panel_that_hangs_just_behind_it(rooms):
    """Mesh files may hold float32: 3 micrometres are no reason to lose the panel."""
    scene = rooms.paper()
    sunk = replace(scene, ris=replace(scene.ris, center=scene.ris.center + np.array([0.0, 0.0, 3e-6])))
    kinds = [paths_of(s, rooms.at(SPOTS)).kind.tolist() for s in (scene, sunk)]
    assert kinds[0] == kinds[1]
    assert PathKind.RIS in kinds[0]


def test_no_reflectors_leave_the_open_space(rooms):
    free = rooms.scene([])
    paths = paths_of(free, rooms.at(SPOTS), 3)
    assert paths.kind.tolist() == [PathKind.LOS, PathKind.PS]
    assert paths.valid.all()


def test_an_agent_on_a_face_loses_that_face_only(rooms):
    paths = paths_of(rooms.paper(), rooms.at([2.0, 2.5, 0.0], tx=(-0.05, 0, 0), rx=(0.05, 0, 0)), 1)
    direct = [paths.walls[paths.identity(p)[2][0]] for p in np.flatnonzero(paths.kind == PathKind.VT)]
    assert sorted(direct) == ["ceiling", "wall_x0", "wall_x1", "wall_y0", "wall_y1"]
