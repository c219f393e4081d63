"""What comes over the floor and a sloping ceiling is no ceiling of its own."""

from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.births.track_classification import log_echo_over_floor
from rislam_rt.slam.window.hypotheses.hypotheses import BESIDE, KNOWN_WALL, POINT, WALL


def _echo(kinds, places, evidence, silent):
    """Log evidence of an echo over the floor for one track of these hypotheses, seen from the origin."""
    count = len(kinds)
    table = SimpleNamespace(
        kind=np.array(kinds), trials=SimpleNamespace(track=np.zeros(count, dtype=np.int64))
    )  # fmt: skip
    lonely = np.array([[-9.0, -9.0, -9.0, silent]])
    fits = SimpleNamespace(place=np.array(places, dtype=float))
    return float(log_echo_over_floor(table, fits, np.array(evidence), np.zeros(3), lonely)[0])


def test_a_ceiling_has_an_echo_for_a_rival_beside_what_may_be_a_lower_one():
    """As likely as the ceiling but for one wall more on its way; where nothing lower is heard it is missed besides."""
    up = [0.2, 0.0, 7.0]
    one = _echo([WALL], [up], [-20.0], 0.0)
    assert one == pytest.approx(-20.0 + 2.0 * CONSTANTS.wall_ratio)
    odds = np.exp(-20.0 - one)
    assert np.log(odds) < CONSTANTS.log_born  # not held for a ceiling
    missed = np.log1p(-CONSTANTS.shown)
    assert _echo([WALL], [up], [-20.0], missed) == pytest.approx(one + missed)
    assert -20.0 - one - missed > CONSTANTS.log_born
    both = _echo([WALL, BESIDE], [up, up], [-20.0, -20.0], 0.0)
    assert both == pytest.approx(one + np.log(2.0))


@pytest.mark.parametrize(
    ("kind", "place"), [(WALL, [5.0, 0.0, 0.3]), (WALL, [0.0, 0.0, -3.0]), (POINT, [0.0, 0.0, 3.0]),
                        (KNOWN_WALL, [0.0, 0.0, 5.0])],
    ids=["upright", "below", "a point", "over a known wall"],
)  # fmt: skip
def test_nothing_else_has_one(kind, place):
    assert _echo([kind], [place], [-20.0], 0.0) == -np.inf
