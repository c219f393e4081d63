"""Where an agent starts in a room that comes without one."""

import numpy as np
import pytest
from built_in_rooms.parts import box_walls

from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.scene import load_scene
from rislam_rt.scene.check.mesh_queries import free_ways
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.motion.suggested_motion import suggest_agent
from rislam_rt.scene.shapes import block, quad


def soup(*meshes):
    return np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes])


@pytest.mark.parametrize("name", ["paper_room", "l_room", "tilted_room", "office"])
def test_the_way_keeps_clear_in_every_room(name):
    room = load_scene(name)
    triangles = np.concatenate([r.triangles for r in room.reflectors])
    agent = suggest_agent(triangles)
    time = agent["cycle_s"] * np.arange(agent["cycles"])[::20, None]
    line = np.array(agent["start"]) + time * np.array(agent["velocity"])
    assert distance_to_triangles(line, triangles).min() > 0.2
    assert np.linalg.norm(agent["velocity"]) * time[-1, 0] > 1.0
    low, high = room.bounds
    assert ((line > low) & (line < high)).all()


def test_the_street_and_not_the_house():
    ground = quad([[-30, -30, 0], [30, -30, 0], [30, 30, 0], [-30, 30, 0]])
    houses = [block([-25, -25, 0.02], [25, -6, 12]), block([-25, 6, 0.02], [25, 25, 12])]
    start = suggest_agent(soup(ground, *houses))["start"]
    assert abs(start[1]) < 6.0
    assert start[2] == pytest.approx(1.5)


def test_free_ways_are_distances():
    """In a box of 4 x 3 x 2.5 m, and out of a box without a roof."""
    walls = box_walls(4.0, 3.0, 2.5)
    box = np.array([[0.0, 0.0, 0.0], [4.0, 3.0, 2.5]])
    place, ways = np.array([1.0, 1.2, 0.7]), np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.8, 0.0]]])
    expected = [3.0, 1.8, 1.8, 1.0, 1.2, 0.7, 1.8 / 0.8]
    np.testing.assert_allclose(free_ways(place, ways, soup(*walls.values()), box), expected)
    del walls["ceiling"]
    np.testing.assert_allclose(free_ways(place, ways, soup(*walls.values()), box), expected)


def test_a_lone_plate_has_no_place():
    with pytest.raises(Fault, match="no free place"):
        suggest_agent(soup(quad([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])))
