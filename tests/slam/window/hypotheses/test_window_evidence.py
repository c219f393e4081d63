"""Hypotheses of a track: derivatives, and the marginal likelihood against brute-force quadrature."""

import numpy as np
import pytest

from rislam_rt.model import Body
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import AXES, NONE, TX, Poses, linearise, poses_of, reflect
from rislam_rt.slam.window.hypotheses import hypothesis_fits
from rislam_rt.slam.window.hypotheses.hypothesis_fits import COMMON, Trials, smooth_paths, try_all
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary, scatter_of
from rislam_rt.slam.window.landmarks.path_forms import compile_forms


def _digest(count, *, std=0.01, rng):
    """A track seen from a way through a room; what is seen is filled in by the tests."""
    time = np.linspace(-3.0, 0.0, count)
    place = np.stack([0.3 * time, 0.2 * time + 0.05 * time**2, np.full(count, 1.0)], axis=1)
    ends = poses_of(place, 0.3 + 0.1 * time, Body())
    uncertainty = 1e-3 * rng.standard_normal((3, 6))
    wide = uncertainty + time[:, None, None] * 1e-3 * rng.standard_normal((3, 6))
    weight = np.full((1, count, 3), 1.0 / std)
    return TrackSummary(
        np.zeros((1, count, 3)), weight, time[None], ends.tx[None], ends.rx[None], wide[None],
        np.zeros(1), np.ones((1, 3)), place[-1], 0.4, np.zeros((1, count, 3, 0)),
    )  # fmt: skip


def _wall(middle):
    normal = np.array([0.9, 0.3, 0.1]) / np.linalg.norm([0.9, 0.3, 0.1])
    return middle + 2.0 * 2.5 * normal


SPOT = np.array([1.5, -1.0, 2.0])
IMAGES = ("image", "image of image", "over", "both legs", "far", "far over")


def _mirror(middle, wall):
    span = wall - middle
    turn = AXES - 2.0 * np.outer(span, span) / (span @ span)
    return turn, reflect(np.zeros(3), wall, middle)


def _trials(kind, summary, rng):
    """One hypothesis of a kind: `wall`, `point`, `pair`, `edge` (a wall beside its edge with a known one), `both ways`
    (a wall and a known one, met in either order), or an image of a known point on the Rx leg: `image`, `image of image`
    (over a known wall first), `over` (over it last), `both legs` (over it on the Tx leg); on the Tx leg: `far`, `far
    over` (the Rx hears it over a known wall)."""
    turn, shift = np.tile(AXES, (1, 2, 1, 1)), np.zeros((1, 2, 3))
    known = _mirror(summary.middle, summary.middle + np.array([-3.0, 1.0, 0.5]))
    if kind == "edge":
        start = _wall(summary.middle)
    elif kind in IMAGES:
        turn[0, 0], shift[0, 0] = 0.0, SPOT
        if kind == "image of image":
            shift[0, 0] = known[0] @ SPOT + known[1]
        if kind in ("over", "far over"):
            turn[0, 1], shift[0, 1] = known
        start = _wall(summary.middle)
    elif kind == "both ways":
        turn[0, 0], shift[0, 0] = _mirror(summary.middle, summary.middle + np.array([0.2, 0.0, 3.0]))
        start = _wall(summary.middle)
    elif kind == "wall":
        turn[0, 1], shift[0, 1] = known
        start = _wall(summary.middle)
    elif kind == "point":
        turn[0, 0], shift[0, 0] = known
        start = np.array([1.5, -1.0, 2.0])
    else:
        turn[0, 0] = np.diag([-1.0, -1.0, 1.0])
        start = np.array([3.0, 2.0, 1.0])
    uncertainty = 1e-3 * rng.standard_normal((1, 2, 3, 3))
    if kind == "pair":
        uncertainty[:] = 0.0
    flags = np.array([kind in ("wall", "edge", "both ways", *IMAGES)]), np.array([kind == "pair"])
    mixed = np.array([kind in ("edge", "both ways")])
    beyond = np.zeros((1, 3, 4))
    beyond[0, :, :3], beyond[0, :, 3] = _mirror(summary.middle, summary.middle + np.array([0.2, 0.0, 3.0]))
    return Trials(
        np.zeros(1, dtype=np.int64),
        *flags,
        start[None],
        turn,
        shift,
        uncertainty,
        mixed,
        np.array([kind == "both ways"]),
        beyond,
        np.array([kind in IMAGES]),
        np.array([kind in ("far", "far over")]),
        np.array([kind == "both legs"]),
        (known[0] @ SPOT + known[1] if kind in ("both legs", "far over") else SPOT)[None],
    )


def _left(trials, summary, place, error):
    """Residuals of one hypothesis, through its cost's own slope: computed at `place` and `error`."""
    rows = np.zeros(1, dtype=np.int64)
    return hypothesis_fits._equations(trials, summary, rows, place[None], error[None], robust=False)


def test_slopes_are_those_of_the_cost():
    rng = np.random.default_rng(1)
    for kind in ("wall", "point", "pair", "edge", "both ways", *IMAGES):
        # measurements far off in metres and next to nothing in deviations: a slope, and tails that do not count
        summary = _digest(6, rng=rng)._replace(weight=np.full((1, 6, 3), 1e-3))
        trials = _trials(kind, summary, rng)
        step, numeric, error = 1e-4, np.zeros(COMMON + 3), np.zeros(COMMON)
        for axis in range(COMMON + 3):
            change = step * np.eye(COMMON + 3)[axis]
            high, low = (
                _left(trials, summary, trials.start[0] + sign * change[COMMON:], sign * change[:COMMON]).cost[0]
                for sign in (1.0, -1.0)
            )
            numeric[axis] = (high - low) / (2.0 * step)
        found = _left(trials, summary, trials.start[0], error).slope[0]
        # the cost is (4 + 3) log(1 + r^2 / 4): 7/4 of r^2 where residuals are small, and counts twice; ridge 1e-3 apart
        np.testing.assert_allclose(found[COMMON:], -0.5 * numeric[COMMON:] * 4.0 / 7.0, rtol=1e-3, atol=1e-8)
        np.testing.assert_allclose(found[:COMMON], -0.5 * numeric[:COMMON] * 4.0 / 7.0, rtol=1e-3, atol=1e-8)


def test_the_kernel_sees_what_the_measurement_library_sees():
    """Two ways to one prediction: affine maps here, legs over features there."""
    rng = np.random.default_rng(2)
    summary = _digest(5, rng=rng)
    middle = summary.middle
    poses = Poses(summary.tx[0], summary.rx[0], np.zeros(summary.tx.shape[1]))  # cosines in the room's axes
    known, new = middle + np.array([-3.0, 1.0, 0.5]), _wall(middle)
    anchors = np.stack([middle, middle, middle])
    for kind, form, start in (
        ("wall", (TX, NONE, NONE, 1, 0), new),
        ("point", (1, 0, NONE, NONE, NONE), np.array([1.5, -1.0, 2.0])),
        ("image", (2, NONE, NONE, 1, NONE), new),
        ("image of image", (2, NONE, NONE, 0, 1), new),
        ("over", (2, NONE, NONE, 1, 0), new),
        ("both legs", (2, 0, NONE, 1, NONE), new),
        ("far", (2, 1, NONE, NONE, NONE), new),
        ("far over", (2, 1, NONE, 0, NONE), new),
    ):
        trials = _trials(kind, summary, rng)
        features = np.stack([known, start, SPOT])
        wanted = linearise(compile_forms(np.array([form])), features, anchors, poses).seen[:, 0]
        found = summary._replace(seen=wanted[None], weight=np.ones(summary.weight.shape))
        # at the very place the cost is that of residuals of zero
        assert _left(trials, found, start, np.zeros(COMMON)).cost[0] < 1e-20


def test_evidence_is_the_integral_of_the_likelihood():
    rng = np.random.default_rng(7)
    summary = _digest(8, std=0.02, rng=rng)
    trials = _trials("point", summary, rng)
    trials = trials._replace(
        turn=np.tile(AXES, (1, 2, 1, 1)), shift=np.zeros((1, 2, 3)), uncertainty=np.zeros((1, 2, 3, 3))
    )
    summary = summary._replace(uncertainty=np.zeros(summary.uncertainty.shape))
    truth = trials.start[0]
    poses = Poses(summary.tx[0], summary.rx[0], np.zeros(summary.tx.shape[1]))  # cosines in the room's axes
    form = np.array([(0, NONE, NONE, NONE, NONE)])
    exact = linearise(compile_forms(form), truth[None], np.zeros((1, 3)), poses).seen[:, 0]
    summary = summary._replace(seen=(exact + 0.01 * rng.standard_normal(exact.shape))[None])
    fits = try_all(trials._replace(start=truth[None] + 0.05), summary)
    # quadrature over a cube of 6 deviations about the fit, in its own axes; half the step changes it by 1e-6
    value, vector = np.linalg.eigh(fits.held[0])
    nodes = np.linspace(-6.0, 6.0, 21)
    grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    places = fits.place[0] + (grid * np.sqrt(value)) @ vector.T
    every = Trials(
        np.zeros(len(places), dtype=np.int64), np.zeros(len(places), dtype=bool), np.zeros(len(places), dtype=bool),
        places, *(np.repeat(field, len(places), axis=0) for field in trials[4:]),
    )  # fmt: skip
    rows = np.arange(len(places))
    cost = hypothesis_fits._equations(
        every, summary, rows, places, np.zeros((len(places), COMMON)), robust=False
    ).cost  # fmt: skip
    cell = np.prod(np.sqrt(value)) * (nodes[1] - nodes[0]) ** 3
    integral = np.logaddexp.reduce(-0.5 * cost) + np.log(cell)
    # Student's tails are not a Gaussian: 8 points of 3 numbers leave a fifth of a unit, of some 14
    assert abs(fits.log_evidence[0] - integral) < 0.25


def test_a_smooth_path_fits_what_moves_smoothly():
    rng = np.random.default_rng(8)
    summary = _digest(8, std=0.01, rng=rng)
    time = summary.time[0]
    seen = np.stack([5.0 + 0.3 * time, 0.2 - 0.05 * time, 0.1 + 0.02 * time], axis=1)
    _, smooth = smooth_paths(summary._replace(seen=seen[None]))
    broken = seen.copy()
    broken[4:, 0] += 0.5
    _, rough = smooth_paths(summary._replace(seen=broken[None]))
    assert smooth[0] < 5.0 < rough[0]


def test_scatter_is_that_of_the_noise():
    rng = np.random.default_rng(9)
    time, std = 0.1 * np.arange(200), np.full((200, 3), 0.01)
    for factor in (1.0, 5.0):
        seen = 3.0 + 0.2 * time[:, None] + 0.003 * time[:, None] ** 2 + factor * 0.01 * rng.standard_normal((200, 3))
        # of 200 measurements the deviation is known to 5 %; Student's weights take a little off
        np.testing.assert_allclose(scatter_of(seen, std, time), max(factor, 1.0), rtol=0.2)
    assert CONSTANTS.crowd > 1.0


def _seen_of_a_wall_ahead(off, height):
    """A track of 6 components, as an agent at 9 cm hears of the wall 0.8 m ahead while it is held for moving slowly and
    has set off: `off` (6,) [m] longer than it moves. First guesses put the wall's image at some `height` [m]."""
    time = np.linspace(-0.5, 0.0, 6)
    rx = np.array([0.049, 0.024, 0.09]) + (time[:, None] + 0.5) * np.array([0.0073, 0.0045, 0.0])
    tx, image = rx - [0.088, 0.048, 0.0], np.array([-1.6, 0.0, 0.09])
    mirrored = tx * [-1.0, 1.0, 1.0] + [image[0], 0.0, 0.0]
    way = mirrored - rx
    length = np.linalg.norm(way, axis=1)
    seen = np.column_stack([length + off, way[:, :2] / length[:, None]])
    std = np.array([0.019, 1.0, 0.0017])  # at the array's own line one cosine is hardly measured
    place = 1e-3 * np.concatenate([np.tile(AXES, (6, 1, 1)), time[:, None, None] * AXES], axis=2)
    summary = TrackSummary(
        seen[None], np.tile(1.0 / std, (1, 6, 1)), time[None], tx[None], rx[None], place[None], np.zeros(1),
        np.ones((1, 3)), np.array([0.0, 0.0, 0.09]), 0.05, np.zeros((1, 6, 3, 0)),
    )  # fmt: skip
    trials = _trials("wall", summary, np.random.default_rng(1))
    start = np.array([image[0], 0.0, height])
    return summary, trials._replace(
        start=start[None],
        turn=np.tile(AXES, (1, 2, 1, 1)),
        shift=np.zeros((1, 2, 3)),
        uncertainty=np.zeros((1, 2, 3, 3)),
    )


def test_near_the_horizon_no_step_leads_the_fit_astray():
    """There a length changes next to nothing with the height of the image, so that a full step, for a length that is
    millimetres off, went half a metre up or down, at 110 of cost, and the wall was out of the question."""
    off = np.array([0.0, 0.0, 0.0, 0.0, 0.007, 0.03])
    for height in (0.10, 0.11, 0.12):
        fits = try_all(*_seen_of_a_wall_ahead(off, height)[::-1])
        assert fits.cost[0] < 10.0
        np.testing.assert_allclose(fits.place[0], [-1.6, 0.0, 0.09], atol=0.15)


def _of_a_point(std, rng):
    """A track of 8 components of a point, heard from poses that are known, the trial that begins at its place, and
    exact lengths and cosines (8, 3)."""
    summary = _digest(8, std=std, rng=rng)._replace(uncertainty=np.zeros((1, 8, 3, 6)))
    trials = _trials("point", summary, rng)._replace(
        turn=np.tile(AXES, (1, 2, 1, 1)), shift=np.zeros((1, 2, 3)), uncertainty=np.zeros((1, 2, 3, 3))
    )
    poses = Poses(summary.tx[0], summary.rx[0], np.zeros(8))
    form = compile_forms(np.array([(0, NONE, NONE, NONE, NONE)]))
    return summary, trials, linearise(form, trials.start, np.zeros((1, 3)), poses).seen[:, 0]


def test_outliers_do_not_swing_the_fit():
    """A point heard well but for two of eight components, which are 50 deviations off: weights by the residuals of the
    step before swing between two places. Iterated to the end, it is where all but those two put it."""
    summary, trials, seen = _of_a_point(0.001, np.random.default_rng(5))
    seen[[2, 6], 0] += 0.05
    fits = try_all(trials._replace(start=trials.start + 0.02), summary._replace(seen=seen[None]))
    least = 7.0 * 2.0 * np.log1p(50.0**2 / 4.0)  # the cost of the two, where all others fit
    assert fits.cost[0] < least + 0.1
    np.testing.assert_allclose(fits.place[0], trials.start[0], atol=1e-3)


def test_a_fit_that_begins_at_its_place_is_not_left_with_the_weights_of_an_outlier():
    """A component 30 deviations off pulls the first step, which counts all alike, to where the others do not lie; it is
    rejected, and the next one is by what they weigh. Iterated to the end, the cost is next to the same."""
    worse = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        summary, trials, seen = _of_a_point(0.005, rng)
        seen += 0.005 * rng.standard_normal(seen.shape)
        seen[rng.integers(8)] += 0.15 * rng.standard_normal(3)
        summary = summary._replace(seen=seen[None])
        found = try_all(trials, summary).cost[0]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(hypothesis_fits, "STEPS", 40)
            worse.append(found - min(try_all(trials, summary).cost[0], found))
    assert np.mean(worse) < 0.1  # 1.6 on average where its first step's weights stayed
