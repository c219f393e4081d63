"""Which directions speak for a wall on the Tx leg: those from which something shorter comes as well."""

from types import SimpleNamespace

import numpy as np

from rislam_rt.model import RadioConfig
from rislam_rt.slam.observations import OTHER, PANEL
from rislam_rt.slam.window.births.births import _log_same_direction
from rislam_rt.slam.window.measurement_log import empty_log
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.solver_limits import ALIGNED

HEADING = 0.7
RAYS = np.array([[0.3, 0.4], [0.3, 0.4], [-0.5, 0.1], [0.3, 0.4]])
LENGTHS = np.array([4.0, 7.0, 6.0, 9.0])
SIDES = np.array([OTHER, OTHER, OTHER, PANEL])


NOWHERE, ALL = np.zeros((0, 3)), slice(None)


def _odds(points=NOWHERE, rows=ALL, panel=-1):
    """Of four tracks, the first two and the last from one direction; with points of the map (P, 3), one the panel."""
    cos, sin = np.cos(HEADING), np.sin(HEADING)
    body = RAYS @ np.array([[cos, -sin], [sin, cos]])  # from the room's axes into the agent's
    state = np.concatenate([LENGTHS[:, None], body], axis=1)
    old = np.isin(np.arange(4), np.arange(4)[rows])  # of two cycles, the others are company to nobody
    tracks = SimpleNamespace(
        hits=np.where(old, 9, 2), mean=np.stack([state, 0.0 * state], axis=-1), side=SIDES, ident=np.arange(4)
    )  # fmt: skip
    context = SimpleNamespace(
        tracks=tracks, heading=np.array([HEADING]), log=empty_log()._replace(side=SIDES),
        scene=SimpleNamespace(radio=RadioConfig()),
        landmarks=SimpleNamespace(points=np.arange(len(points)), panels=(panel,)),
    )  # fmt: skip
    histories = SimpleNamespace(weight=np.full((4, 2, 3), 100.0))
    mean = np.concatenate([np.zeros(HEAD), np.ravel(points)])
    return _log_same_direction(context, np.arange(4), [np.array([row]) for row in range(4)], histories, mean)


def test_a_longer_way_from_the_same_direction_goes_over_a_wall():
    odds = _odds()
    # by a density over the half sphere: 2 pi times the cosine of the elevation over 2 pi the variance
    variance = 0.5 * 100.0**-2 + 0.01**2
    expected = np.log1p(ALIGNED * (np.sqrt(1.0 - 0.25) / variance - 1.0))
    np.testing.assert_allclose(odds[1], expected, rtol=1e-9)
    np.testing.assert_allclose(odds[[0, 2]], np.log1p(-ALIGNED), rtol=1e-9)


def test_what_comes_over_the_panel_has_what_comes_over_the_panel_for_company():
    alone = np.log1p(-ALIGNED)
    np.testing.assert_allclose(_odds()[3], alone, rtol=1e-9)
    point = 1.5 * np.array([[0.3, 0.4, np.sqrt(0.75)]])
    np.testing.assert_allclose(_odds(point)[3], alone, rtol=1e-9)
    assert _odds(point, panel=0)[3] > 5.0


def test_points_of_the_map_are_company_as_tracks_are():
    alone = _odds(rows=slice(2, 3))
    np.testing.assert_allclose(alone[:2], np.log1p(-ALIGNED), rtol=1e-9)
    point = 1.5 * np.array([[0.3, 0.4, np.sqrt(0.75)]])
    known = _odds(point, rows=slice(2, 3))
    assert (known[:2] > 5.0).all()
    np.testing.assert_allclose(known[2], alone[2])
