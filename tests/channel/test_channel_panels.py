"""Rooms of several panels: the paths of each are those of a room that has it alone, under its part of the code."""

from dataclasses import replace

import numpy as np

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.walls import build_walls
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import PathKind, RadioConfig, Reflector, RisCode

RADIO = RadioConfig()


def by_identity(paths):
    """Columns by kind, names of landmark and walls."""
    found = {}
    for path in range(paths.num_paths):
        kind, landmark, tx, rx = paths.identity(path)
        name = paths.landmarks[landmark] if landmark >= 0 else ""
        found[kind, name, tx, rx] = path
    return found


def test_each_panel_has_the_paths_that_it_has_alone(rooms):
    room = rooms.panels()
    poses, rng = rooms.at([[1.0, 1.2, 0.8], [4.0, 3.0, 1.0]]), np.random.default_rng(0)
    both = ImageSourceChannel(room, RADIO, 2)
    code = RisCode(rng.integers(4, size=(1, room.ris.spec.num_elements)), 4)
    paths = both.respond(both.paths(poses), code)
    columns, met = by_identity(paths), 0
    for number, (panel, part) in enumerate(zip(room.panels, room.ris.spec.parts(code), strict=True)):
        alone = ImageSourceChannel(replace(room, ris=panel), RADIO, 2)
        one = alone.respond(alone.paths(poses), part)
        for identity, column in by_identity(one).items():
            here = columns[identity]
            np.testing.assert_array_equal(paths.valid[:, here], one.valid[:, column])
            np.testing.assert_allclose(paths.gain[:, here], one.gain[:, column], rtol=1e-12, atol=1e-18)
            np.testing.assert_array_equal(paths.vertices[:, here], one.vertices[:, column])
            over = identity[0] in (PathKind.RIS, PathKind.VRIS)
            assert paths.panel[here] == (number if over else -1)
            met += over
    assert met == np.sum(paths.panel >= 0) > 3


def test_a_panel_before_its_host_has_the_paths_of_one_on_it(rooms):
    """Over the same walls: of the host's own bounces next to it none more comes in, whatever its distance."""
    poses = rooms.at([[1.0, 1.2, 0.8], [4.0, 3.0, 1.0]])
    flat, before = (
        ImageSourceChannel(rooms.paper(center=(3.0, 3.0, height)), RADIO, 2).paths(poses) for height in (3.0, 2.97)
    )
    assert by_identity(before).keys() == by_identity(flat).keys()
    column = int(np.flatnonzero(before.kind == PathKind.RIS)[0])
    center = np.array([3.0, 3.0, 2.97])
    length = sum(np.linalg.norm(end - center, axis=1) for end in (poses.tx, poses.rx))
    np.testing.assert_allclose(before.tau[:, column] * SPEED_OF_LIGHT, length, rtol=1e-12)


def test_the_wall_behind_a_panel_is_one_that_lies_as_it_does(rooms):
    """A step in the ceiling, of one mesh: its side passes nearer by the panel, 3 cm below, than the ceiling does."""
    corners = [(0, 0, 3), (3.01, 0, 3), (3.01, 6, 3), (0, 6, 3), (3.01, 0, 3.5), (3.01, 6, 3.5)]
    faces = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])
    ceiling = Reflector("ceiling", np.array(corners, dtype=float), faces, rooms.paper().reflectors[0].material)
    others = [one for one in rooms.paper().reflectors if one.name != "ceiling"]
    walls = build_walls(rooms.scene([*others, ceiling], ris=rooms.panel(center=(3.0, 3.0, 2.97))))
    np.testing.assert_allclose(np.abs(walls.normal[walls.hosts[0]]), [0.0, 0.0, 1.0])
