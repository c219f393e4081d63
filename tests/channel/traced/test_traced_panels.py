"""Several panels, traced: two on one wall, one on another, of three sizes; every path as the image sources have it."""

import numpy as np

from rislam_rt.channel.compare import compare_channels
from rislam_rt.model import RadioConfig, RisPanel, RisSpec, join_panels


def test_certificate_of_a_room_with_three_panels_is_clean(rooms) -> None:
    level, beside = rooms.panel(center=(2.0, 3.0, 3.0)), rooms.panel(center=(2.1, 3.0, 3.0), rows=4, cols=6)
    upright = RisSpec(5, 3, np.array([0.015, 0.015]), np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    panels = (
        RisPanel(level.spec, level.center, "ceiling", "a"), RisPanel(beside.spec, beside.center, "ceiling", "b"),
        RisPanel(upright, np.array([6.0, 2.0, 1.5]), "wall_x1", "c"),
    )  # fmt: skip
    room = rooms.scene(rooms.box((0, 0, 0), (6, 6, 3)), ris=join_panels(panels))
    report = compare_channels(room, RadioConfig(), poses=3, depth=2, rng=np.random.default_rng(3))
    assert report.passed
    assert report.unexplained == 0
    assert report.matched > 500
