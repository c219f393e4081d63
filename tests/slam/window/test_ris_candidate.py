"""RIS candidates: which track or point the phase design aims at while no panel is known."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import PanelCandidate
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import PANEL
from rislam_rt.slam.predicted_returns import Poses
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable, empty_table, enter
from rislam_rt.slam.window.landmarks.ris_identification import unknown
from rislam_rt.slam.window.ris_candidate import find_candidate, log_images
from rislam_rt.slam.window.tracks import WindowTracks, no_tracks

HERE = np.array([2.0, 2.0, 1.0])
CYCLE = 40


def poses() -> Poses:
    return Poses(HERE, HERE, np.array(0.0))


def tracks_at(places: Floats, log_odds: list[float], hits: int = 3) -> WindowTracks:
    """Tracks of the last cycle that come from places (T, 3), with log odds of being a panel, at the odds of none."""
    count, empty, span = len(places), no_tracks(1), places - HERE
    length = 2.0 * np.linalg.norm(span, axis=1)
    mean = np.zeros((count, 3, 2))
    mean[:, 0, 0], mean[:, 1:, 0] = length, span[:, :2] / np.linalg.norm(span, axis=1)[:, None]
    whole = np.full(count, CYCLE)
    fields = {name: np.zeros((count, *getattr(empty, name).shape[1:])) for name in ("log_grid", "hidden", "rises")}
    return empty._replace(
        ident=np.arange(count), mean=mean, covariance=np.zeros((count, 3, 2, 2)), log_amplitude=np.zeros(count),
        side=whole * 0 + PANEL, born=whole - hits, last=whole, hits=whole * 0 + hits, looked=whole * 0,
        log_ris=np.log(CONSTANTS.panels) + np.array(log_odds)[:, None], next_ident=count, **fields,
    )  # fmt: skip


def best(tracks: WindowTracks, walls: list[Floats] | None = None) -> PanelCandidate | None:
    """Candidate beside walls whose mirror images of the agent are given."""
    landmarks: WindowTable = empty_table(1)
    for _ in walls or []:
        landmarks = enter(landmarks, True, HERE, 9, 5.0, unknown(1, 1))
    mean = np.concatenate([HERE, np.zeros(4), *(walls or [])])
    return find_candidate(tracks, landmarks, mean, CYCLE, poses())


def test_a_wall_in_front_makes_a_candidate_unlikely_but_may_end_before_it():
    panel, front = np.array([4.0, 4.0, 2.5]), np.array([4.0, 2.0, 1.0])  # a wall at x = 3
    told = -CONSTANTS.log_rare
    sure, unsure = tracks_at(panel[None], [told]), tracks_at(panel[None], [-0.5])
    found = best(sure, [front])
    assert found is not None
    np.testing.assert_allclose(found.position, panel, atol=1e-9)
    assert best(unsure) is not None  # likely enough in the open ...
    assert best(unsure, [front]) is None  # ... and not where a rare event is asked for besides


def test_of_the_panel_and_its_image_in_a_wall_the_nearer_is_aimed_at():
    panel, image = np.array([4.0, 4.0, 2.5]), np.array([5.0, 6.0, 2.5])
    both = tracks_at(np.stack([image, panel]), [12.0, 8.0])
    found = best(both)
    assert found is not None
    np.testing.assert_allclose(found.position, panel, atol=1e-9)
    # a nearer track that nothing speaks for is not the panel whose image the farther one would be
    found = best(tracks_at(np.stack([image, panel]), [12.0, -6.0]))
    assert found is not None
    np.testing.assert_allclose(found.position, image, atol=1e-9)


def test_images_count_by_the_power_that_a_wall_takes():
    gain = log_images(np.array([1.0, 2.0, 3.0]), np.array([2.0, 3.0, -np.inf]))
    np.testing.assert_allclose(gain, [np.log1p(np.exp(2.0 * CONSTANTS.wall_ratio + 3.0)), 0.0, 0.0])
