"""Estimates of the window filter: pose and map, the prediction for the phase design, and a start on an earlier map."""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import MapEstimate, SlamEstimate, empty_map
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.map_geometry import MAX_LEAN, images_in, wall_planes
from rislam_rt.slam.predicted_returns import AXES, poses_of
from rislam_rt.slam.sampling import even_draws, square_root
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.window.filter import init
from rislam_rt.slam.window.landmarks.duplicate_walls import second_planes
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable, image_ident
from rislam_rt.slam.window.relinearisation import heave_now
from rislam_rt.slam.window.ris_candidate import find_candidate
from rislam_rt.slam.window.smoother import heave, window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.start_frame import present_in_room
from rislam_rt.slam.window.state import WindowState


def predict(state: WindowState, dt: float, config: SlamConfig) -> SlamEstimate:
    """Estimate by the window filter of pose and map `dt` [s] ahead at constant velocity, without process noise, with
    candidates for RIS panels that the map lacks."""
    ahead = estimate(state, config, dt)
    unknown = [panel for panel, row in enumerate(state.landmarks.panels) if row < 0]
    if state.scene.ris is None or not unknown:
        return ahead
    mean, _, landmarks = _present(state, *window_gaussian.now(state.window))
    poses = poses_of(mean[:3], np.asarray(state.heading[-1] + mean[6]), state.scene.body)
    found = [
        find_candidate(state.tracks, landmarks, mean, state.cycle - 1, poses, state.codes, state.scene.sensor, panel)
        for panel in unknown
    ]
    return replace(ahead, suspects=tuple(suspect for suspect in found if suspect is not None))


def estimate(state: WindowState, config: SlamConfig, ahead: float = 0.0) -> SlamEstimate:
    """Pose estimate (mean, covariance, equally likely samples; `ahead` [s] at constant velocity) and map estimate of
    the window filter."""
    mean, covariance, excess = window_gaussian.now_with_excess(state.window)
    further, covariance[:6, :6] = state.heave_uncertainty, covariance[:6, :6] + excess
    if ahead and state.heaves:  # the next step's heave is another one
        mean[2] -= state.window.heave[-1]
        further = state.heave_variance or further
    elif state.heaves:  # what was heard tells of floor and heave together
        slope, own = heave_now(state)
        by = np.eye(len(mean))
        by[2] -= slope
        covariance = by @ covariance @ by.T
        further = own if state.window.heave_variance[-1] else own + further  # where it has ended, there may be one
    places, walls = mean[HEAD:].reshape(-1, 3), state.landmarks.walls
    leans = wall_planes(places, covariance[HEAD:, HEAD:], state.landmarks.anchor, walls)[2][:, 0]
    mean, covariance, landmarks = _present(state, mean, covariance)
    spread = covariance[:6, :6].copy()
    spread[:3, :3] += np.diag(state.shift**2)
    spread[2, 2] += further
    position = mean[:3] + ahead * mean[3:6]
    root = square_root(spread[:3, :3])
    return SlamEstimate(
        position,
        mean[3:6],
        float(state.heading[-1] + mean[6]),
        spread,
        position + even_draws(config.num_samples, root.shape[1]) @ root.T,
        state.scene.body,
        build_map(mean[HEAD:].reshape(-1, 3), covariance[HEAD:, HEAD:], landmarks, state.shift, mean[:3], leans),
        heading_std=float(np.sqrt(covariance[6, 6])) if config.heading == "estimated" else None,
    )


def _present(state: WindowState, mean: Floats, covariance: Floats) -> tuple[Floats, Floats, WindowTable]:
    """Mean (7 + 3F,) and covariance of the window filter's present in the room, for estimates, and its landmark table
    there."""
    return present_in_room(state.frame, state.window, state.landmarks, mean, covariance)


def shift_covariance(features: Floats, landmarks: WindowTable, shift: Floats) -> Floats:
    """Covariance (3F, 3F) that estimates of features (F, 3) have by the start's position error alone, of standard
    deviation `shift` (3,) [m], which moves them all together.

    A wall's three numbers, the image of an anchor that stays, move by `2 n n^T` of what the wall itself does.
    """
    span = features - landmarks.anchor
    normal = span / np.maximum(np.linalg.norm(span, axis=1), 1e-9)[:, None]
    by_shift = np.where(landmarks.is_wall[:, None, None], 2.0 * normal[:, :, None] * normal[:, None, :], AXES)
    rows = by_shift.reshape(-1, 3) * shift
    return np.asarray(rows @ rows.T)


def revisit(
    state: WindowState, start: StartPrior, config: SlamConfig, *, rng: np.random.Generator
) -> WindowState:  # fmt: skip
    """State of the window filter for another run, or another agent's, on the map of an earlier one, identities of its
    features included.

    The map keeps its covariance, the earlier start's error included; its frame is the earlier run's, and so must be
    the start's. What is measured tells of the start then, so that its error stands within the Gaussian.
    """
    scene = state.scene
    fresh = init(replace(start, heading_std=0.0), scene.body, scene.ris, scene.sensor, config, rng=rng)
    mean, covariance, earlier = present_in_room(
        state.frame, state.window, state.landmarks, *window_gaussian.now(state.window), images=True
    )
    features = mean[HEAD:].reshape(-1, 3)
    spread = covariance[HEAD:, HEAD:] + shift_covariance(features, earlier, state.shift)
    std = np.concatenate([np.maximum(fresh.shift, 1e-5), np.sqrt(np.diag(fresh.window.covariance))[3:HEAD]])
    std[6] = max(std[6], start.heading_std * (config.heading == "estimated"))
    velocity, turns = fresh.window.head[3:6], fresh.window.turns
    window = window_gaussian.begin_with(start.position, velocity, std, mean[HEAD:], spread, turns=turns)
    height = np.array([start.position[2], fresh.shift[2]])
    window = heave.with_heave(window, fresh.heave_variance, height)
    landmarks = earlier._replace(hidden=np.zeros(earlier.hidden.shape))
    return fresh._replace(window=window, landmarks=landmarks, shift=np.zeros(3), start_height=height)


def build_map(
    features: Floats, covariance: Floats, landmarks: WindowTable, shift: Floats, middle: Floats, leans: Floats
) -> MapEstimate:  # fmt: skip
    """Map estimate of points, their mirror images in each wall, and walls; covariances include the start's error, which
    moves all together.

    Of planes that are one wall, seen from `middle` (3,) [m], one is shown; none whose direction is hardly known, by its
    deviation `leans` (W,) [rad], but for what all are turned by together.
    """
    if not len(landmarks.ident):
        return empty_map()
    wide = covariance + shift_covariance(features, landmarks, shift)
    points, walls = landmarks.points, landmarks.walls
    parent, wall = np.repeat(points, len(walls)), np.tile(walls, len(points))
    place, spread = images_in(features, wide, landmarks.anchor, parent, wall)
    columns = 3 * points[:, None] + np.arange(3)
    normal, offset, std = wall_planes(features, wide, landmarks.anchor, walls)
    known = (np.sqrt(2.0) * leans < MAX_LEAN).nonzero()[0]
    known = known[~second_planes(features, covariance, landmarks, walls[known], middle)]
    strength, ratio = np.exp(landmarks.log_strength[0][points]), np.exp(landmarks.ratio[wall])
    probability = np.concatenate(
        [landmarks.ris_probability[points], np.zeros((len(place), landmarks.log_ris.shape[1]))]
    )
    return MapEstimate(
        np.concatenate([landmarks.ident[points], image_ident(landmarks.ident[parent], landmarks.ident[wall])]),
        np.concatenate([features[points], place]),
        np.concatenate([wide[columns[:, :, None], columns[:, None, :]], spread]),
        np.concatenate([np.full(len(points), -1), np.searchsorted(points, parent)]),
        probability.max(axis=1),
        np.concatenate([strength, ratio]),
        normal[known],
        offset[known],
        std[known],
        None if probability.shape[1] == 1 else np.argmax(probability, axis=1),
    )
