"""Single returns of two walls: those that are heard where the pair is heard now."""

from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.births.unheard_returns import missing_legs
from rislam_rt.slam.window.smoother.motion_basis import HEAD

CORNER = np.array([1.2, 1.6])
"""[m] from the agent to two upright walls at right angles."""


@pytest.mark.parametrize(
    ("heard", "expected"),
    [
        ([0, 1], 0.0),
        ([0], np.log1p(-CONSTANTS.steady)),
        ([], CONSTANTS.log_rare),
    ],
)
def test_a_corner_has_the_single_returns_of_its_walls_beside_it(heard, expected):
    # lengths and cosines of the two walls' own returns and of the corner's; all as loud as mirrors
    length = 2.0 * np.append(CORNER, np.hypot(*CORNER))
    rays = np.array([[1.0, 0.0], [0.0, 1.0], CORNER / np.hypot(*CORNER)])
    state = np.concatenate([length[:, None], rays], axis=1)
    hits = np.array([9 if row in heard else 2 for row in range(2)] + [9])
    tracks = SimpleNamespace(
        hits=hits, mean=np.stack([state, 0.0 * state], axis=-1), log_amplitude=-np.log(length), side=np.zeros(3)
    )
    landmarks = SimpleNamespace(walls=np.zeros(0, dtype=np.int64), anchor=np.zeros((0, 3)))
    context = SimpleNamespace(tracks=tracks, heading=np.zeros(1), landmarks=landmarks)
    assert missing_legs(context, np.array([2]), np.zeros(HEAD))[0] == pytest.approx(expected)
