"""Several panels, traced: two on one wall, one on another, of three sizes; every path as the image sources have it."""

import numpy as np

from rislam_rt.channel.compare import compare_channels
from rislam_rt.model import RadioConfig


def test_certificate_of_a_room_with_three_panels_is_clean(rooms) -> None:
    report = compare_channels(rooms.panels(), RadioConfig(), poses=3, depth=2, rng=np.random.default_rng(3))
    assert report.passed
    assert report.unexplained == 0
    assert report.matched > 500
