"""Round trip: a room to a file, Sionna's own PathSolver on that file, and the same paths under our identities."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sionna_comparison import compare_with_path_solver

from rislam_rt.channel.compare.channel_comparison import random_poses
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.errors import TraceError
from rislam_rt.model import RadioConfig
from rislam_rt.scene import load_scene
from rislam_rt.scene.xml import scene_of_xml, sionna_scenes, write_xml
from rislam_rt.shipped import shipped_rooms

RADIO = RadioConfig()


def as_written(name: str, folder: Path):
    """A shipped room as its XML file has it: with the nearest materials, but its own scatterers and shades."""
    room = load_scene(name)
    write_xml(room, folder)
    (folder / "scene.toml").unlink()
    read, _ = scene_of_xml(folder / "scene.xml", name)
    return replace(read, scatterers=room.scatterers, occluders=room.occluders, agent=room.agent)


def round_trip(scene, file: Path, poses: int, depth: int = 2):
    where = random_poses(scene, poses, rng=np.random.default_rng(3))
    return compare_with_path_solver(file, scene, RADIO, where, depth)


def test_sionna_finds_our_paths_in_our_file(tmp_path):
    """LOS, VT, PS and VS of a room of four ITU materials, all that have no segment below Sionna's limit of 1 cm."""
    trip = round_trip(as_written("itu_room", tmp_path / "out"), tmp_path / "out" / "scene.xml", poses=2)
    assert trip.passed
    assert trip.report.matched >= 200
    assert set(trip.report.explained) <= {"short segment"}
    assert {int(kind) for kind in trip.report.kind} == {0, 1, 2, 3}


def test_a_wall_that_moved_is_noticed(tmp_path):
    scene = as_written("itu_room", tmp_path / "out")
    wall = scene.reflectors[2]
    shifted = replace(wall, vertices=wall.vertices + np.array([1e-4, 0.0, 0.0]))
    moved = replace(scene, reflectors=(*scene.reflectors[:2], shifted, *scene.reflectors[3:]))
    assert not round_trip(moved, tmp_path / "out" / "scene.xml", poses=2).passed  # kernels of the test above


def test_another_material_is_noticed(tmp_path):
    scene = as_written("itu_room", tmp_path / "out")
    wood = replace(scene.reflectors[0], material=scene.reflectors[-2].material)
    assert scene.reflectors[0].material != wood.material
    other = replace(scene, reflectors=(wood, *scene.reflectors[1:]))
    trip = round_trip(other, tmp_path / "out" / "scene.xml", poses=2)
    assert not trip.report.unexplained
    assert not trip.passed


def test_a_file_of_another_room_is_refused(tmp_path):
    write_xml(load_scene("empty_box"), tmp_path / "out")
    with pytest.raises(TraceError, match="no object 'wall_x6'"):
        round_trip(load_scene("paper_room"), tmp_path / "out" / "scene.xml", poses=1, depth=1)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(shipped_rooms()))
def test_every_shipped_room_there_and_back(tmp_path, name):
    """As written against Sionna's solver; and read back with its scene file, against itself, to the last bit."""
    room = load_scene(name)
    trip = round_trip(as_written(name, tmp_path / "out"), tmp_path / "out" / "scene.xml", poses=10)
    assert trip.passed
    assert set(trip.report.explained) <= {"short segment"}
    write_xml(room, tmp_path / "again")
    back, _ = scene_of_xml(tmp_path / "again" / "scene.xml", name)
    where = random_poses(room, 5, rng=np.random.default_rng(4))
    here, there = (ImageSourceChannel(scene, RADIO, 2).paths(where) for scene in (room, back))
    for field in ("kind", "landmark", "tx_walls", "rx_walls", "valid", "tau", "gain", "vertices"):
        np.testing.assert_array_equal(getattr(here, field), getattr(there, field))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["box", "box_one_screen", "floor_wall", "double_reflector", "simple_street_canyon"])
def test_sionnas_own_scenes(name):
    file = sionna_scenes()[name]
    scene, _ = scene_of_xml(file, name)
    trip = round_trip(scene, file, poses=10)
    assert trip.passed
    assert trip.report.matched >= 2 * 10  # two paths a pose at least
