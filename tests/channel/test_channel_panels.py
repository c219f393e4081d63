"""Rooms of several panels: the paths of each are those of a room that has it alone, under its part of the code."""

from dataclasses import replace

import numpy as np

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.model import PathKind, RadioConfig, RisCode

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
