"""The table of landmarks: what is learnt of them, which of them die, who keeps his name; and the map that is shown."""

import numpy as np
import pytest

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.model import Body, RadioConfig, SensorModel
from rislam_rt.ris.path_gain import point_amplitude
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.identity import STRENGTHS
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.nested.belief_moments import POSE, Moments
from rislam_rt.slam.nested.candidates import PredictedMeasurements, look_ahead
from rislam_rt.slam.nested.landmark_table import LandmarkTable, empty_table, enter, image_idents, learn_ratio, remove
from rislam_rt.slam.nested.landmark_update import Hits, learn
from rislam_rt.slam.nested.mapping import WALL_HITS, build_map
from rislam_rt.slam.nested.measurement_prediction import MapBelief, detection_share, expected_returns
from rislam_rt.slam.nested.prune import keepers
from rislam_rt.slam.nested.tracks import no_tracks
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.returns import observe, reflect

RADIO, BODY, CONFIG = RadioConfig(noise_psd=3.52e-13), Body(), SlamConfig()
"""20 dB below the default noise, so that everything near is expected to show."""
PLACE = np.array([0.5, 0.7, 0.5])
BALL, CEILING = np.array([2.0, 1.0, 1.0]), np.array([0.5, 0.7, 5.5])
"""A scatterer, and the ceiling as the image of the agent's place."""
STRENGTH = np.sqrt(np.pi) * 0.05
"""Square root of the cross-section of the paper's sphere [m]."""


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240623)


def image_ident(landmarks: LandmarkTable, point: int, wall: int) -> tuple[LandmarkTable, int]:
    """The number of one image."""
    landmarks, idents = image_idents(landmarks, np.array([point]), np.array([wall]))
    return landmarks, int(idents[0])


def strong(landmarks: LandmarkTable) -> LandmarkTable:
    """The table with every point known to be as strong as the sphere."""
    grid = np.tile(-0.5 * ((STRENGTHS - np.log(STRENGTH)) / 0.05) ** 2, (len(landmarks.ident), 1))
    return landmarks._replace(log_grid=grid - np.logaddexp.reduce(grid, axis=1)[:, None])


def room(*features: Floats) -> tuple[Moments, LandmarkTable]:
    """A ball, the ceiling found by it, and any more points, each known to 0.01 m by itself."""
    landmarks = enter(empty_table(), False, np.zeros(3), -1)
    landmarks = enter(landmarks, True, PLACE, 0)
    for _ in features:
        landmarks = enter(landmarks, False, np.zeros(3), -1)
    mean = np.concatenate([PLACE, [0.1, 0.1, 0.0, 0.0], BALL, CEILING, *features])
    return Moments(mean, 1e-4 * np.eye(len(mean))), strong(landmarks)


def outlook_of(moments: Moments, landmarks: LandmarkTable) -> tuple[PredictedMeasurements, MapBelief]:
    """What is expected of it, without a panel."""
    belief = MapBelief(
        moments.features,
        landmarks,
        poses_of(moments.position, np.asarray(moments.heading), BODY),
        BODY,
        SensorModel(RADIO),
        None,
    )
    expected = expected_returns(belief, None, 2, False)
    return look_ahead(belief, expected, moments, no_tracks(4)), belief


def kept(moments: Moments, landmarks: LandmarkTable) -> Booleans:
    outlook, belief = outlook_of(moments, landmarks)
    return keepers(moments, landmarks, outlook, belief, CONFIG)


def live(
    moments: Moments, landmarks: LandmarkTable, cycles: int, shows: Booleans, *, rng: np.random.Generator
) -> LandmarkTable:
    """The table after cycles in which the returns of some features (F,) show, as strong as they should."""
    for _ in range(cycles):
        outlook, belief = outlook_of(moments, landmarks)
        rows = np.flatnonzero(shows[outlook.expected.owner] & outlook.expected.by_parent)
        seen, amplitude = outlook.seen[rows], _amplitudes(belief, outlook, rows)
        std = np.full(len(rows), 1e-8)
        observed = Observations(seen, np.full(seen.shape, 0.01), np.log(amplitude), std / amplitude, std, 0.0 * std)
        hits = Hits(rows, np.arange(len(rows)), np.zeros((len(rows), 3)))
        landmarks, _ = learn(belief, moments, outlook, hits, observed, None, rng=rng)
    return landmarks


def _amplitudes(belief: MapBelief, outlook: PredictedMeasurements, rows: np.ndarray) -> Floats:
    """The amplitude law with the sphere's strength, and walls that reflect 0.85."""
    returns = outlook.expected.returns
    sight = observe(returns, belief.features, belief.table.anchor, belief.poses)
    amplitude = point_amplitude(np.full(len(returns.tx), STRENGTH), sight.tx_length, sight.rx_length, RADIO)
    return np.asarray(amplitude * 0.85**outlook.expected.bounces)[rows]


def test_all_stay_that_should() -> None:
    assert kept(*room()).all()
    assert len(kept(Moments(np.zeros(POSE), np.eye(POSE)), empty_table())) == 0


def test_a_ghost_dies_and_what_shows_lives(rng: np.random.Generator) -> None:
    """A second point that never shows where it should: gone within 60 cycles, (1 - 0.06)^k < 0.1 from k = 38 on."""
    moments, landmarks = room(np.array([1.0, 2.0, 1.5]))
    shows = np.array([True, True, False])
    assert kept(moments, live(moments, landmarks, 10, shows, rng=rng)).all()
    np.testing.assert_array_equal(kept(moments, live(moments, landmarks, 60, shows, rng=rng)), [True, True, False])


def test_what_has_long_been_silent_does_not_say_that_the_agent_is_lost(rng: np.random.Generator) -> None:
    """A return that should certainly show counts by the share of the cycles in which its landmark showed lately."""
    moments, landmarks = room(np.array([1.0, 2.0, 1.5]))
    before = outlook_of(moments, landmarks)[0].expected
    np.testing.assert_array_equal(detection_share(landmarks, before), 1.0)
    landmarks = live(moments, landmarks, 60, np.array([True, True, False]), rng=rng)
    expected = outlook_of(moments, landmarks)[0].expected
    ghost = (expected.bounces == 0) & (expected.owner == 2)
    assert ghost.any()
    assert expected.likely[ghost].all()
    assert (detection_share(landmarks, expected)[ghost] < 0.1).all()
    assert (detection_share(landmarks, expected)[(expected.bounces == 0) & ~ghost] == 1.0).all()


def test_a_landmark_that_contradicts_the_measurements_dies() -> None:
    moments, landmarks = room(np.array([1.0, 2.0, 1.5]))
    drift = landmarks.drift.copy()
    drift[2, 1] = 1.0
    np.testing.assert_array_equal(kept(moments, landmarks._replace(drift=drift)), [True, True, False])


def test_of_a_double_the_younger_dies() -> None:
    """Two points 0.02 m apart, each known to 0.01 m, are one; half a metre apart they are two."""
    np.testing.assert_array_equal(kept(*room(np.add(BALL, [0.02, 0.0, 0.0]))), [True, True, False])
    assert kept(*room(np.add(BALL, [0.0, 0.5, 0.0]))).all()


def test_an_image_taken_for_a_point_dies() -> None:
    """What stands where the ceiling mirrors the ball, or mirrors it on both legs, follows from what is known."""
    image = reflect(BALL, CEILING, PLACE)
    np.testing.assert_array_equal(kept(*room(image)), [True, True, False])


def test_a_wall_that_amplifies_dies_and_the_images_with_it() -> None:
    moments, landmarks = room()
    landmarks, _ = image_ident(landmarks, 0, 1)
    bad = landmarks._replace(ratio=np.array([0.0, 0.5]))
    keep = kept(moments, bad)
    np.testing.assert_array_equal(keep, [True, False])
    left = remove(bad, keep)
    assert left.ident.tolist() == [0]
    assert len(left.images) == len(left.image_hits) == 0


def test_strengths_converge_to_what_the_amplitudes_say(rng: np.random.Generator) -> None:
    """Forty amplitudes without error under a flat prior: within half a step (5 %) of the grid of the sphere's own.

    And the wall's ratio within a tenth of log 0.85, the prior having been 0.74.
    """
    moments, landmarks = room()
    flat = np.full_like(landmarks.log_grid, -np.log(len(STRENGTHS)))
    after = live(moments, landmarks._replace(log_grid=flat), 40, np.array([True, True]), rng=rng)
    mean, std = after.log_strength
    assert abs(mean[0] - np.log(STRENGTH)) < 0.05
    assert std[0] < 0.05
    assert abs(after.ratio[1] - np.log(0.85)) < 0.1
    assert after.ratio_variance[1] < landmarks.ratio_variance[1]


def test_a_wall_ratio_is_kalmans(rng: np.random.Generator) -> None:
    """Against the closed form: prior N(-0.3, 0.5^2), n readings of deviation 0.3 each."""
    _, landmarks = room()
    readings = rng.normal(-0.2, 0.1, size=7)
    for reading in readings:
        landmarks = learn_ratio(landmarks, 1, float(reading))
    precision = 1.0 / 0.5**2 + 7.0 / 0.3**2
    assert landmarks.ratio_variance[1] == pytest.approx(1.0 / precision)
    assert landmarks.ratio[1] == pytest.approx((-0.3 / 0.5**2 + readings.sum() / 0.3**2) / precision)


def test_names_are_for_life(rng: np.random.Generator) -> None:
    """Twenty births and deaths at random: no number is ever used twice, and rows keep what is theirs."""
    landmarks, born, kinds = empty_table(), 0, {}
    for _ in range(20):
        for _ in range(int(rng.integers(1, 4))):
            wall = bool(rng.integers(2))
            kinds[landmarks.next_ident] = wall
            landmarks, born = enter(landmarks, wall, rng.normal(size=3), -1), born + 1
        landmarks = remove(landmarks, rng.uniform(size=len(landmarks.ident)) < 0.7)
        assert len(set(landmarks.ident.tolist())) == len(landmarks.ident)
        assert all(kinds[int(i)] == w for i, w in zip(landmarks.ident, landmarks.is_wall, strict=True))
        assert all(len(getattr(landmarks, name)) == len(landmarks.ident) for name in landmarks._fields[:11])
    assert landmarks.next_ident == born


def test_an_image_keeps_its_name() -> None:
    """Through hits, births and deaths of others; and a new one gets a number that nobody had."""
    _, landmarks = room(np.array([1.0, 2.0, 1.5]))
    landmarks, first = image_ident(landmarks, 0, 1)
    landmarks, second = image_ident(landmarks, 2, 1)
    assert len({first, second, *landmarks.ident.tolist()}) == 5
    landmarks, again = image_ident(landmarks, 0, 1)
    assert again == first
    assert landmarks.image_hits.tolist() == [2, 1]
    landmarks = remove(landmarks, np.array([True, True, False]))
    landmarks, still = image_ident(enter(landmarks, False, np.zeros(3), -1), 0, 1)
    assert still == first
    _, fresh = image_ident(landmarks, 2, 1)
    assert fresh not in {first, second}


def test_images_on_the_map_have_the_covariance_of_what_they_hang_on(rng: np.random.Generator) -> None:
    """Against differences of the mirror image by point and wall, correlated as they are."""
    moments, landmarks = room()
    root = 0.02 * rng.normal(size=(13, 13))
    moments = Moments(moments.mean + 0.1, root @ root.T)
    landmarks, _ = image_ident(landmarks, 0, 1)
    landmarks = landmarks._replace(image_hits=np.array([9]))
    shown = build_map(moments, landmarks)
    wide, features = 1e-6, moments.mean[POSE:]

    def image(x: Floats) -> Floats:
        return reflect(x[:3], x[3:], landmarks.anchor[1])

    slope = np.stack(
        [(image(features + wide * e) - image(features - wide * e)) / (2 * wide) for e in np.eye(6)], axis=1
    )
    np.testing.assert_allclose(shown.position[1], image(features), atol=1e-12)
    # differences err by 1e-16 / 1e-6 and by third derivatives times 1e-12
    np.testing.assert_allclose(shown.covariance[1], slope @ moments.covariance[POSE:, POSE:] @ slope.T, rtol=1e-7)
    np.testing.assert_array_equal(shown.parent, [-1, 0])


def proven(landmarks: LandmarkTable) -> LandmarkTable:
    """Every wall measured often enough to be shown, its reflection too."""
    return landmarks._replace(
        hits=np.full(len(landmarks.ident), WALL_HITS), ratio_variance=np.full(len(landmarks.ident), 0.01)
    )


def test_walls_are_on_the_map_once_they_are_known() -> None:
    """Not those of few measurements, of no reflection of their own, or of an unknown lean."""
    moments, landmarks = room()
    sure = proven(landmarks)
    span = np.linalg.norm(CEILING - PLACE)
    assert len(build_map(moments, sure).wall_offset) == 1
    assert len(build_map(moments, sure._replace(hits=sure.hits - 1)).wall_offset) == 0
    assert len(build_map(moments, sure._replace(ratio_variance=landmarks.ratio_variance)).wall_offset) == 0
    for angle, count in ((0.9, 1), (1.1, 0)):  # degrees, of both tilts together
        wide = moments.covariance.copy()
        wide[-3:, -3:] = 0.5 * (np.radians(angle) * span) ** 2 * np.eye(3)
        assert len(build_map(Moments(moments.mean, wide), sure).wall_offset) == count


def test_walls_on_the_map_err_as_told(rng: np.random.Generator) -> None:
    """Normal, offset and their deviations against 20 000 draws of the image: 1 % for a deviation, and curvature."""
    moments, landmarks = room()
    shown = build_map(moments, proven(landmarks))
    np.testing.assert_allclose(shown.wall_normal, [[0.0, 0.0, 1.0]], atol=1e-12)
    np.testing.assert_allclose(shown.wall_offset, [3.0])
    draws = CEILING + 0.01 * rng.normal(size=(20_000, 3))
    span = draws - PLACE
    normal = span / np.linalg.norm(span, axis=1, keepdims=True)
    offset = np.sum(normal * (draws + PLACE), axis=1) / 2.0
    tilt = np.sqrt(np.mean(normal[:, :2] ** 2))
    # the offset of the plane at the foot of the anchor: that of the image along the normal, halved
    along = 0.5 * np.std(draws[:, 2])
    np.testing.assert_allclose(shown.wall_std[0], [tilt, along], rtol=0.03)
    assert abs(offset.mean() - 3.0) < 1e-3
