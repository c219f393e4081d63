"""Rooms of several panels: the paths of each are those of a room that has it alone, under its part of the code."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import PathKind, RadioConfig, RisCode, RisPanel, RisSpec, join_panels

RADIO = RadioConfig()


@pytest.fixture(scope="module")
def room(rooms):
    """Two panels on the ceiling and one on a wall, of three sizes."""
    level = rooms.panel(center=(2.0, 3.0, 3.0))
    near = rooms.panel(center=(2.4, 3.1, 3.0), rows=4, cols=8)
    upright = RisSpec(5, 3, np.array([0.015, 0.015]), np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    panels = (
        replace(level, name="a"), replace(near, name="b"), RisPanel(upright, np.array([6.0, 2.0, 1.5]), "wall_x1", "c")
    )  # fmt: skip
    return rooms.scene(rooms.box((0, 0, 0), (6, 6, 3)), ris=join_panels(panels))


def by_identity(paths):
    """Columns by kind, names of landmark and walls."""
    found = {}
    for path in range(paths.num_paths):
        kind, landmark, tx, rx = paths.identity(path)
        name = paths.landmarks[landmark] if landmark >= 0 else ""
        found[kind, name, tx, rx] = path
    return found


def test_each_panel_has_the_paths_that_it_has_alone(room, rooms):
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
